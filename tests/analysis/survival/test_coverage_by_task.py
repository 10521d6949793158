"""Coverage of one task of a robot with several tips: that of the serial arm to its frame."""

import numpy as np
import pytest
from tests.going import closed_loop, targets_along

import ftqp
from ftqp.analysis import coverage
from ftqp.analysis.survival.continuing import track
from ftqp.analysis.survival.task_path import task_path
from ftqp.core.errors import InputError
from ftqp.kernel.layout.enums import Survival
from ftqp.model import catalog

BODY = ftqp.robots.load("dual_panda")
LEFT, RIGHT = BODY.tips


def lifted():
    """A motion of both arms along a line of the right hand, and that line."""
    planner = ftqp.Planner(BODY, tasks=[ftqp.PoseTask(LEFT), ftqp.PoseTask(RIGHT, level=0)])
    line = ftqp.paths.Line(BODY.pose(BODY.neutral, RIGHT), displacement=(0.0, 0.05, 0.1), duration=1.0)
    right, home = targets_along(line, 1201, 0.001), BODY.pose(BODY.neutral)
    steps = closed_loop(planner, lambda k: {LEFT: home, RIGHT: right.at(k)}, 1200)
    q = [BODY.neutral, *(step.q.copy() for step in steps)]
    return np.array(q[::50]), 0.05


def test_only_joints_on_the_way_count_and_the_verdicts_are_those_of_that_arm():
    q, dt = lifted()
    poses = np.array([BODY.pose(one, RIGHT) for one in q])
    found = coverage(BODY, poses, q, dt=dt, task=RIGHT, rows="position", stride=6)
    assert all(joint.startswith("right_joint") for joint in found.per_joint) and len(found.per_joint) == 7
    arm = BODY.arm_to(RIGHT)
    alone = coverage(arm, poses, q[:, 7:], dt=dt, rows="position", stride=6)
    assert np.array_equal(found.status, alone.status) and 0.0 < found.coverage <= 1.0


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


Q0 = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])


@pytest.mark.slow
def test_free_joints_of_a_panda_lose_a_pose_except_where_nothing_pulls_at_them() -> None:
    panda = catalog.load("panda")
    task = task_path(panda, ftqp.paths.Line(panda.pose(Q0), (0.0, 0.25, 0.0), duration=4.0), dt=0.05)
    q = track(task, Q0, 0.3)
    found = coverage(panda, task, q, fault="free_swinging", joints=[0, 1, 3], stride=36)
    assert found.post == "planner" and found.status.shape == (3, 3)
    assert found.status[0, 2] == Survival.SURVIVED and (found.status[1:] == Survival.ERROR).all()
    position, _ = found.best_effort()
    assert (position[1:] == found.position[1:]).all() and found.position[1:].min() > 2e-3
    with pytest.raises(InputError, match="run the planner"):
        found.continue_after(0, 3.6)


@pytest.mark.slow
@pytest.mark.parametrize("theta", [0.0, 0.6])
def test_planner_does_what_was_predicted_in_every_clear_case(theta: float) -> None:
    panda = catalog.load("panda")
    start = np.diag([1.0, -1.0, -1.0, 1.0])
    start[:3, 3] = 0.45, -0.2, 0.35
    task = task_path(panda, ftqp.paths.Line(start, (0.0, 0.4, 0.0), duration=6.0), dt=0.025)
    q = track(task, Q0, theta)
    predicted = coverage(panda, task, q, lock="ramp", stride=16)
    executed = coverage(panda, task, q, lock="ramp", stride=16, post="planner")
    clear = ~predicted.borderline()
    assert (predicted.survived == executed.survived)[clear].all()
    assert clear.mean() > 0.8 and 0 < predicted.survived[clear].sum() < clear.sum()
    assert executed.position[predicted.survived & clear].max() < 2e-3


def test_arm_without_masses_is_refused() -> None:
    arm = catalog.load("zhang7")
    task = task_path(arm, ftqp.paths.Line(arm.pose(arm.neutral), (0.5, 0.0, 0.0), duration=4.0), dt=0.1)
    with pytest.raises(InputError, match="zhang7 has no masses"):
        coverage(arm, task, track(task, arm.neutral), fault="free_swinging")
