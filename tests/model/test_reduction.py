"""Held joints, tips."""

import numpy as np
import pinocchio as pin
import pytest

from ftqp.core.errors import InputError, ModelError
from ftqp.model import catalog
from ftqp.model.robot import Robot


def mass_matrix(model: pin.Model, q: np.ndarray) -> np.ndarray:
    M = np.asarray(pin.crba(model, model.createData(), q))
    return np.triu(M) + np.triu(M, 1).T


def test_held_joint_leaves_the_inertia_matrix_of_the_others_as_it_is() -> None:
    robot = catalog.load("panda")
    q = robot.neutral.copy()
    q[3] = -1.2
    held = Robot.from_pinocchio(robot.model, robot.tip, ["panda_joint4"], q_locked={"panda_joint4": -1.2})
    free = [0, 1, 2, 4, 5, 6]
    expected = mass_matrix(robot.model, q)[np.ix_(free, free)]
    assert held.nv == 6
    assert np.abs(mass_matrix(held.model, q[free]) - expected).max() < 1e-13 * expected.max()
    assert np.abs(held.pose(q[free]) - robot.pose(q)).max() < 1e-14
    assert held.chain.mass.sum() == pytest.approx(robot.chain.mass.sum())


def test_continuous_joint_is_held_at_an_angle() -> None:
    model = pin.Model()
    first = model.addJoint(0, pin.JointModelRUBZ(), pin.SE3.Identity(), "turn")
    second = model.addJoint(first, pin.JointModelRX(), pin.SE3(np.eye(3), np.array([1.0, 0.0, 0.0])), "bend")
    model.addFrame(pin.Frame("tip", second, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    robot = Robot.from_pinocchio(model, "tip", ["turn"], q_locked={"turn": np.pi / 2})
    assert robot.pose([0.0])[:3, 3] == pytest.approx([0.0, 1.0, 0.0], abs=1e-15)


PLANAR, PANDA = catalog.load("planar6").model, catalog.load("panda").model
MIMIC = """<robot name="m"><link name="base"/><link name="one"/><link name="two"/>
<joint name="a" type="revolute"><parent link="base"/><child link="one"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
<joint name="b" type="revolute"><parent link="one"/><child link="two"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/><mimic joint="a"/></joint></robot>"""


def rotor(value: float) -> pin.Model:
    model = PLANAR.copy()
    model.armature = np.array([0.0, value, 0.0, 0.0, 0.0, 0.0])
    return model


@pytest.mark.parametrize(
    ("model", "given", "sentence"),
    [
        (PLANAR, ("tip", [f"j{k}" for k in range(1, 7)]), "no joint moves 'tip'"),
        (PANDA, ("panda_hand_tpc",), r"not a frame of panda \(did you mean 'panda_hand_tcp'\?\)"),
        (pin.Model(), (), "no joint that moves"),
        (pin.buildSampleModelHumanoid(), ("rarm_effector_body",), "is of type FreeFlyer"),
        (pin.buildModelFromXML(MIMIC, mimic=True), ("two",), "built with mimic joints; build it without"),
        *(
            (rotor(x), (), rf"joint 'j2' has a rotor inertia \(armature\) of {x}")
            for x in (-0.1, np.nan, np.inf)
        ),
    ],
)
def test_model_that_is_no_arm_is_refused(model: pin.Model, given: tuple, sentence: str) -> None:
    with pytest.raises((InputError, ModelError), match=sentence):
        Robot.from_pinocchio(model, *given)


def test_several_tips_without_a_choice_are_listed() -> None:
    model = PLANAR.copy()
    model.addFrame(pin.Frame("camera", 3, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    with pytest.raises(ModelError, match=r"2 possible tips; .* tip=, or several with tips=.*: tip, camera"):
        Robot.from_pinocchio(model)
    assert Robot.from_pinocchio(model, "camera").joints == ("j1", "j2", "j3")


def test_rotor_inertias_stay_with_their_joints_when_one_is_held() -> None:
    model = catalog.load("panda").model.copy()
    model.armature = np.arange(1.0, 8.0)
    robot = Robot.from_pinocchio(model, "panda_hand_tcp", ["panda_joint3"])
    assert robot.chain.armature.tolist() == [1.0, 2.0, 4.0, 5.0, 6.0, 7.0]
    assert robot.model.armature.tolist() == [1.0, 2.0, 4.0, 5.0, 6.0, 7.0]
