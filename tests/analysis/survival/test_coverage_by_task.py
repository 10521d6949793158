"""Coverage of one task of a robot with several tips: that of the serial arm to its frame."""

import numpy as np
import pytest

import ftqp
from ftqp.analysis import coverage
from ftqp.core.errors import InputError

BODY = ftqp.robots.load("dual_panda")
LEFT, RIGHT = BODY.tips


def lifted():
    """A motion of both arms along a line of the right hand, and that line."""
    planner = ftqp.Planner(BODY, tasks=[ftqp.PoseTask(LEFT), ftqp.PoseTask(RIGHT, level=0)])
    line = ftqp.paths.Line(BODY.pose(BODY.neutral, RIGHT), displacement=(0.0, 0.05, 0.1), duration=1.0)
    q, found = BODY.neutral.copy(), []
    planner.reset(q)
    sampled = line.sample(0.001 * np.arange(1201))
    right = ftqp.Targets(sampled.pose, sampled.twist, sampled.acceleration)
    home = BODY.pose(q)
    for k in range(1201):
        if k % 50 == 0:
            found.append(q)
        q = planner.step(q, None, {LEFT: home, RIGHT: right.at(k)}).q.copy()
    return np.array(found), 0.05


def test_only_joints_on_the_way_count_and_the_verdicts_are_those_of_that_arm():
    q, dt = lifted()
    poses = np.array([BODY.pose(one, RIGHT) for one in q])
    found = coverage(BODY, poses, q, dt=dt, task=RIGHT, rows="position", stride=6)
    assert all(joint.startswith("right_joint") for joint in found.per_joint) and len(found.per_joint) == 7
    arm = BODY.arm_to(RIGHT)
    alone = coverage(arm, poses, q[:, 7:], dt=dt, rows="position", stride=6)
    assert np.array_equal(found.status, alone.status) and 0.0 < found.coverage <= 1.0


def test_without_a_name_it_is_the_first_tip():
    q = np.repeat(BODY.neutral[None], 5, axis=0)
    found = coverage(BODY, np.array([BODY.pose(one) for one in q]), q, dt=0.1)
    assert all(joint.startswith("left_joint") for joint in found.per_joint)


def test_wrong_frames_and_motions_are_refused_in_a_sentence():
    q = np.repeat(BODY.neutral[None], 5, axis=0)
    poses = np.array([BODY.pose(one) for one in q])
    with pytest.raises(InputError, match="frame is 'nose'"):
        coverage(BODY, poses, q, dt=0.1, task="nose")
    with pytest.raises(InputError, match=r"q has shape \(5, 7\), expected \(N \+ 1, nv\)"):
        coverage(BODY, poses, q[:, :7], dt=0.1)


def test_the_arm_to_a_frame_has_its_joints_with_their_limits_and_moves_alike():
    arm = BODY.arm_to(RIGHT)
    assert arm.is_serial and arm.joints == BODY.joints[7:] and arm.length == BODY.length
    assert np.array_equal(arm.limits.q_max, BODY.limits.q_max[7:])
    rng = np.random.default_rng(0)
    q = BODY.neutral + rng.uniform(-0.3, 0.3, 14)
    assert arm.pose(q[7:]) == pytest.approx(BODY.pose(q, RIGHT), abs=1e-14)
    assert arm.jacobian(q[7:]) == pytest.approx(BODY.jacobian(q, RIGHT)[:, 7:], abs=1e-14)
    still = BODY.neutral.copy()
    still[7:] = q[7:]
    assert arm.bias(q[7:], np.zeros(7)) == pytest.approx(BODY.bias(still, np.zeros(14))[7:], abs=1e-10)
