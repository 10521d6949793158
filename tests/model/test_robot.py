"""A robot as its users see it."""

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest

from ftqp.model import catalog
from ftqp.model.limits import within_branch
from ftqp.model.robot import Robot

Urdf = Callable[..., str]
PLAIN = {"kind": "continuous", "limit": 'velocity="1.5" effort="20"'}


def test_limits_of_one_joint_are_replaced_by_its_name(two_joints: Urdf) -> None:
    plain = Robot.from_urdf(two_joints())
    robot = Robot.from_urdf(two_joints(), limits={"q_max": {"a": 0.5}, "a_max": {"b": 2.0}})
    np.testing.assert_array_equal(robot.limits.q_max, [0.5, plain.limits.q_max[1]])
    np.testing.assert_array_equal(robot.limits.a_max, [plain.limits.a_max[0], 2.0])
    guess = next(f.sentence for f in robot.findings if "acceleration" in f.sentence)
    assert "a " in guess and "b " not in guess.split("RISE")[0].split(":")[-1]
    again = plain.with_limits(v_max={"b": 0.1})
    np.testing.assert_array_equal(again.limits.v_max, [plain.limits.v_max[0], 0.1])


def test_one_number_that_widens_limits_is_a_finding(two_joints: Urdf) -> None:
    plain = Robot.from_urdf(two_joints())
    wide = Robot.from_urdf(two_joints(), limits={"q_max": 9.0}).findings
    assert any("q_max = 9 for all joints is beyond that of the model for a " in f.sentence for f in wide)
    narrow = Robot.from_urdf(two_joints(), limits={"q_max": 0.5 * plain.limits.q_max.min()}).findings
    assert not any("for all joints is beyond" in f.sentence for f in narrow)
    assert any("v_max = 99 for all" in f.sentence for f in plain.with_limits(v_max=99.0).findings)


def test_pose_of_a_continuous_joint_takes_angles_or_the_configuration(two_joints: Urdf) -> None:
    robot = Robot.from_urdf(two_joints(**PLAIN))
    assert (robot.nq, robot.nv) == (3, 2)
    assert robot.continuous.tolist() == [True, False]
    angles = np.array([2.5, 0.3])
    full = np.array([np.cos(2.5), np.sin(2.5), 0.3])
    assert np.abs(robot.pose(angles) - robot.pose(full)).max() < 1e-15
    assert robot.configuration(angles) == pytest.approx(full, abs=1e-15)
    assert robot.angles(full) == pytest.approx(angles, abs=1e-15)
    assert robot.limits.q_min.tolist() == [-np.inf, -2.0]


def test_given_limits_replace_those_of_the_file_and_of_the_model(two_joints: Urdf) -> None:
    robot = Robot.from_urdf(two_joints(), limits={"v_max": 0.5, "q_max": [0.5, 0.6]})
    assert robot.limits.v_max.tolist() == [0.5, 0.5]
    assert robot.limits.q_max.tolist() == [0.5, 0.6]
    assert robot.limits.tau_max.tolist() == [20.0, 10.0]
    assert robot.model.upperPositionLimit.tolist() == [0.5, 0.6]


def test_branch_limits_narrow_a_range_and_never_widen_it() -> None:
    puma = catalog.load("puma560")
    found = within_branch(puma, {"j3": (-1.4, np.inf), 1: (-99.0, 0.5)})
    assert found.limits.q_min[2] == -1.4 and found.limits.q_max[2] == puma.limits.q_max[2]
    assert found.limits.q_min[1] == puma.limits.q_min[1] and found.limits.q_max[1] == 0.5
    np.testing.assert_array_equal(found.limits.q_min[3:], puma.limits.q_min[3:])
    assert np.all((found.neutral >= found.limits.q_min) & (found.neutral <= found.limits.q_max))


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


MIMIC = """<robot name="m"><link name="base"/><link name="one"/><link name="two"/>
<joint name="a" type="revolute"><parent link="base"/><child link="one"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
<joint name="b" type="revolute"><parent link="one"/><child link="two"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/><mimic joint="a"/></joint></robot>"""
