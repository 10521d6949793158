"""Which locks a task survives anywhere."""

import numpy as np
import pytest
from tests.arm_at import arm_at

import ftqp
from ftqp.model.posture import locks

POSE = ("x", "y", "z", "rx", "ry", "rz")


@pytest.mark.parametrize(
    ("name", "fatal"), [("srs7", ("j4",)), ("panda", ()), ("xarm7", ()), ("iiwa14", ("iiwa_joint_4",))]
)
def test_elbow_between_spherical_shoulder_and_wrist_is_the_only_fatal_lock_of_a_pose(name, fatal):
    assert locks(ftqp.robots.load(name), POSE).fatal == fatal


def test_position_of_those_arms_survives_every_lock():
    for name in ("srs7", "panda", "iiwa14"):
        assert locks(ftqp.robots.load(name), POSE[:3]).fatal == ()


def test_every_lock_is_fatal_without_redundancy_and_none_said_where_the_task_is_impossible():
    puma = locks(ftqp.robots.load("puma560"), POSE)
    assert puma.possible
    assert len(puma.fatal) == 6
    assert not locks(ftqp.robots.load("planar(4)"), POSE).possible


def test_share_that_is_left_is_that_of_fresh_postures():
    """Against other samples and the kernel's Jacobian."""
    robot, generator, count = ftqp.robots.load("panda"), np.random.default_rng(5), 0
    scale = np.array([1.0] * 3 + [robot.length] * 3)[:, None]
    for _ in range(400):
        J = arm_at(robot, generator.uniform(robot.limits.q_min, robot.limits.q_max)).J
        rest = np.delete(scale * J, 3, axis=1)
        count += np.linalg.svd(rest, compute_uv=False)[-1] >= 0.02 * robot.length
    assert count / 400 == pytest.approx(locks(robot, POSE).left["panda_joint4"], abs=0.1)
