"""What is wrong of a model is found and refused in a sentence."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import ftqp
from ftqp.control.planner.planner import Planner
from ftqp.core.errors import InputError, ModelError
from ftqp.model import catalog
from ftqp.model.chain import Skeleton, chain_of
from ftqp.model.limits import JointLimits
from ftqp.model.robot import Robot
from ftqp.model.serial import Inertial

PANDA, DUAL, PUMA, SRS7 = (catalog.load(name) for name in ("panda", "dual_panda", "puma560", "srs7"))
PLANAR = catalog.load("planar6").model
FACTS = Skeleton.of(catalog.load("planar(3)").chain).facts()
BASE = Inertial(mass=40.0, com=np.array([0.1, 0.0, 0.2]), inertia=np.diag([2.0, 2.5, 3.0]))
LOAD = ftqp.Payload(1.5)
MIMIC = """<robot name="m"><link name="base"/><link name="one"/><link name="two"/>
<joint name="a" type="revolute"><parent link="base"/><child link="one"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
<joint name="b" type="revolute"><parent link="one"/><child link="two"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/><mimic joint="a"/></joint></robot>"""

of = Robot.from_pinocchio


def rotor(value: float) -> pin.Model:
    model = PLANAR.copy()
    model.armature = np.array([0.0, value, 0.0, 0.0, 0.0, 0.0])
    return model


def with_shelf() -> pin.Model:
    model = DUAL.model.copy()
    model.addFrame(pin.Frame("shelf", 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    return model


def shoulder(joint: Any) -> pin.Model:
    model = pin.Model()
    parent = model.addJoint(0, joint, pin.SE3.Identity(), "shoulder")
    model.addFrame(pin.Frame("tip", parent, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    return model


def based(robot: Robot = PANDA, **given: Any) -> Robot:
    return robot.on_planar_base(**{"v_max": 1.0, "a_max": 1.0, **given})


def branch(limits: Any) -> Planner:
    return Planner(PUMA, branch_limits=limits)


REFUSED = [
    # models
    (lambda: of(PLANAR, "tip", [f"j{k}" for k in range(1, 7)]), "no joint moves 'tip'"),
    (lambda: of(PANDA.model, "panda_hand_tpc"), r"not a frame of panda \(did you mean 'panda_hand_tcp'\?\)"),
    (lambda: of(pin.Model()), "no joint that moves"),
    (lambda: of(pin.buildSampleModelHumanoid(), "rarm_effector_body"), "is of type FreeFlyer"),
    (lambda: of(pin.buildModelFromXML(MIMIC, mimic=True), "two"), "built with mimic joints; build it"),
    (lambda: of(rotor(-0.1)), r"joint 'j2' has a rotor inertia \(armature\) of -0.1"),
    (lambda: of(rotor(np.nan)), r"joint 'j2' has a rotor inertia \(armature\) of nan"),
    (lambda: chain_of(shoulder(pin.JointModelSpherical()), "tip"), "'shoulder' is of type Spherical"),
    (lambda: chain_of(shoulder(pin.JointModelHZ(0.1)), "tip"), "'shoulder' is of type HZ"),
    # tips and frames
    (lambda: of(DUAL.model, tips=()), "tips is empty, expected at least one name"),
    (lambda: of(DUAL.model, tips="left_hand"), r"tips is 'left_hand', .* names; give tip='left_hand'"),
    (lambda: of(DUAL.model, tips=7), "tips is 7, expected a list of names"),
    (lambda: of(DUAL.model, tips=["left_hand", 3]), "expected a list of names"),
    (lambda: of(DUAL.model, tips=["left_hand", "right_hand", "left_hand"]), "tips has 'left_hand' 2 times"),
    (lambda: of(DUAL.model, "left_hand", tips=["right_hand"]), r"both tip='left_hand' and tips="),
    (lambda: of(with_shelf(), tips=["left_hand", "shelf"]), "no joint moves 'shelf'"),
    (lambda: of(DUAL.model), r"2 possible tips; .* tip=, or several with tips=\(...\): left_hand"),
    (lambda: DUAL.pose(DUAL.neutral, "left_hnd"), "frame is 'left_hnd'.* one of dual_panda: left_joint1"),
    (lambda: DUAL.jacobian(DUAL.neutral, 3), "frame is 3"),
    (lambda: DUAL.with_first_tip("universe"), "no joint moves 'universe'"),
    (lambda: PANDA.with_tip(np.eye(4), "panda_hand_tcp"), "is already a frame of panda; give the new tip"),
    # joints and branches
    (lambda: PUMA.joint("c"), "'c' is not a joint of puma560; it has j1, j2"),
    (lambda: PUMA.joint(6), "index 6 of puma560 is out of range, expected 0 to 5"),
    (lambda: PUMA.joint(-1), "index -1 of puma560 is out of range"),
    (lambda: PUMA.joint(1.0), "by name or 0-based index, got 1.0"),
    (lambda: PUMA.joint(True), "by name or 0-based index, got True"),
    (lambda: branch({"j3": 1.0}), r"branch limits of j3 are 1.0, expected \(low, high\)"),
    (lambda: branch({"j3": (1.0, 2.0)}), r"of j3 leave nothing: \(1, 2\) of its range \[-3.92699, 0.785398"),
    # loads, friction, masses
    (lambda: ftqp.Payload(1.0, inertia=np.diag([1.0, 1.0, -0.1])), "principal moments -0.1, 1, 1 kg m2"),
    (lambda: ftqp.Payload(1.0, inertia=np.diag([1.0, 1.0, 3.0])), "principal moments 1, 1, 3 kg m2"),
    (lambda: ftqp.Payload(1.0, inertia=[[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]), "inertia is not symmetric"),
    (lambda: ftqp.Payload(1e308), r"mass of a payload is 1e\+308 kg, expected at most 1e\+06 kg; look"),
    (lambda: ftqp.Payload(1.0, com=(0.0, -1e308, 0.0)), r"com of a payload is 1e\+308 m, expected at most"),
    (lambda: ftqp.Payload(1.0, inertia=1e308 * np.eye(3)), r"inertia of a payload is 1e\+308 kg m2"),
    (lambda: PUMA.with_payload(LOAD), "puma560 has no masses, so a payload means nothing to it"),
    (lambda: PANDA.with_friction(viscous=-1.0), "'panda_joint1' has a viscous friction .* of -1"),
    (lambda: PUMA.mass_matrix(PUMA.neutral), "puma560 has no masses, so no mass matrix"),
    (lambda: PUMA.bias(PUMA.neutral, np.zeros(6)), "so no bias"),
    # bases
    (lambda: based(), "a base without a mass leaves the joint-space inertia of panda singular"),
    (lambda: based(q_range=[1.0, 2.0]), "q_range"),
    (lambda: based(q_range="wide", inertial=BASE), "q_range"),
    (lambda: based(q_range=[[1.0, 1.0], [0.0, 1.0]], inertial=BASE), "'base_x' cannot move: both limits"),
    (lambda: based(a_max=0.0, inertial=BASE), "'base_x' has a zero acceleration limit"),
    (lambda: based(inertial=3.0), "inertial is 3.0, expected an ftqp.model.serial.Inertial"),
    (lambda: based(based(SRS7)), "has a joint 'base_x' already"),
    (lambda: based(SRS7, inertial=BASE), "srs7 has no masses"),
    (lambda: catalog.load("dual_panda", apart=0.0), "apart"),
    # skeletons in logs
    (lambda: Skeleton.from_facts(FACTS | {"parent": [-1]}), "the arm's geometry"),
    (lambda: Skeleton.from_facts(FACTS | {"tip_joint": "x"}), "the arm's geometry"),
    (lambda: Skeleton.from_facts(FACTS | {"tip": None}), "the arm's geometry"),
    (lambda: Skeleton.from_facts(FACTS | {"placements": [[0.0]]}), "the arm's geometry"),
]


@pytest.mark.parametrize(("call", "sentence"), REFUSED)
def test_what_is_none_is_refused_in_a_sentence(call: Callable[[], Any], sentence: str) -> None:
    with pytest.raises((InputError, ModelError), match=sentence):
        call()


@pytest.mark.parametrize(
    ("keywords", "sentence"),
    [
        ({"limits": {"q_max": {"c": 1.0}}}, "'c' is not a joint of the limits q_max"),
        ({"limits": {"q_max": {"a": "far"}}}, "q_max of a is 'far', expected a number"),
        ({"limits": {"q_top": {"a": 1.0}}}, "'q_top' is not a limit of a robot"),
        ({"limits": JointLimits.of(3)}, r"limits are of 3 joints, expected \(nv,\) = \(2,\)"),
        ({"limits": 3.0}, "limits is of type float"),
        ({"neutral": [9.0, 0.0]}, r"neutral\[0\] is 9, expected a position from -1 to 2"),
        ({"default_rows": ()}, "default_rows is empty"),
        ({"locked": "a"}, r"locked is 'a', expected a list of joints"),
        ({"q_locked": {"b": 0.1}}, "'b', which is not held"),
    ],
)
def test_wrong_options_of_reading_are_refused(two_joints, keywords: dict, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        Robot.from_urdf(two_joints(), **keywords)


Urdf = Callable[..., str]

UNSAFE = [
    ({"limit": 'lower="2" upper="1" velocity="1" effort="1"'}, "'a' has crossed limits 2 > 1"),
    (
        {"limit": 'lower="1" upper="1" velocity="1" effort="1"'},
        r"'a' cannot move: both limits are 1; hold it with",
    ),
    ({"limit": ""}, "'a' has a position limit that is missing or not a number"),
    ({"limit": ""}, "'a' has a velocity limit that is missing or not a number"),
    ({"limit": 'lower="-1" upper="1" effort="1"'}, "'a' has a velocity limit that is missing"),
    ({"limit": 'lower="-1" upper="1" velocity="1"'}, "'a' has a torque limit that is missing"),
    (
        {"limit": 'lower="nan" upper="1" velocity="1" effort="1"'},
        "'a' has a position limit that is missing or not",
    ),
    (
        {"limit": 'lower="-1" upper="1" velocity="fast" effort="1"'},
        "'a' has a velocity limit that is missing or not",
    ),
    (
        {"limit": 'lower="-1" upper="1" velocity="0" effort="1"'},
        r"'a' has a zero velocity limit.*limits=\{'v_max': \{'a'",
    ),
    (
        {"limit": 'lower="-1" upper="1" velocity="1" effort="0"'},
        r"'a' has a zero torque limit.*limits=\{'tau_max': \{'a'",
    ),
    (
        {"limit": 'lower="-1" upper="1" velocity="-2" effort="1"'},
        "'a' has a velocity limit of -2, expected > 0",
    ),
    ({"axis": "0 0 0"}, "'a' has a zero axis"),
    ({"axis": "0 0"}, "'a' has an axis that is not three finite numbers"),
    (
        {"joint": '<mimic joint="c"/>'},
        r"'a' mimics 'c', but that is no joint that moves; or hold it with locked=\['a'\]",
    ),
    ({"ixx": "-0.01"}, "body behind joint 'a' has a negative principal moment of inertia"),
]


@pytest.mark.parametrize(("figures", "message"), UNSAFE)
def test_unsafe_figure_is_refused(two_joints: Urdf, figures: dict[str, str], message: str) -> None:
    with pytest.raises(ModelError, match=message):
        Robot.from_urdf(two_joints(**figures), "two")


def test_a_misspelt_tip_is_all_that_is_said(two_joints: Urdf) -> None:
    with pytest.raises(
        ModelError, match=r"^two has no such tip\n  - 'twoo' is not a frame of .*'two'.*$"
    ) as caught:
        Robot.from_urdf(two_joints(), "twoo")
    assert len(caught.value.findings) == 1 and "note" not in str(caught.value)


def test_all_findings_come_at_once(two_joints: Urdf) -> None:
    text = two_joints(
        axis="0 0 0",
        limit='lower="2" upper="1" velocity="0" effort="nan"',
        mass="-1",
        joint='<mimic joint="c"/>',
    )
    with pytest.raises(ModelError) as caught:
        Robot.from_urdf(text, "twoo")
    everything = "\n".join(caught.value.findings)
    parts = (
        "not a frame",
        "zero axis",
        "crossed",
        "zero velocity",
        "torque limit that",
        "mass of -1",
        "mimics",
    )
    for part in parts:
        assert part in everything


def test_body_without_mass_is_a_warning_and_the_last_one_makes_the_inertia_singular(two_joints: Urdf) -> None:
    light = Robot.from_urdf(
        two_joints(mass="0", ixx="0").replace('iyy="0.02"', 'iyy="0"', 1).replace("0.015", "0", 1)
    )
    assert any("behind joint 'a' has no mass" in f.sentence for f in light.findings)
    model = catalog.load("planar6").model.copy()
    model.inertias[6] = pin.Inertia.Zero()
    with pytest.raises(ModelError, match="joint-space inertia that is not positive definite"):
        Robot.from_pinocchio(model)
    assert not Robot.from_pinocchio(model, kinematics_only=True).has_inertia


def test_joint_that_follows_a_moving_one_but_is_held_is_a_warning(two_joints: Urdf) -> None:
    more = """<link name="three"/><joint name="c" type="revolute"><parent link="one"/><child link="three"/>
    <axis xyz="0 0 1"/><mimic joint="a"/></joint>"""
    robot = Robot.from_urdf(two_joints(more=more), "two")
    assert any("'c' mimics 'a' but is held still" in f.sentence for f in robot.findings)
    asked = Robot.from_urdf(two_joints(more=more), "two", ["c"])
    assert not any("mimics" in f.sentence for f in asked.findings)
