"""Plans and postures of a robot with branches are those of the arm on the way to a frame."""

import numpy as np
import pytest

import ftqp
from ftqp.analysis import plan

DUAL = ftqp.robots.load("dual_panda")
LEFT, RIGHT = DUAL.tips
OF = {LEFT: slice(0, 7), RIGHT: slice(7, 14)}
DT = 2e-3


def line(frame):
    return ftqp.paths.Line(DUAL.pose(DUAL.neutral, frame), (0.0, 0.05, 0.05), duration=1.0)


@pytest.fixture(scope="module")
def planned():
    return plan(DUAL, line(LEFT), DUAL.neutral, "constant", dt=0.1)


@pytest.mark.parametrize("frame", [LEFT, RIGHT])
def test_a_plan_is_that_of_the_arm_to_the_frame(frame):
    found = plan(DUAL, line(frame), DUAL.neutral, "constant", dt=0.25, frame=frame)
    arm = DUAL.arm_to(frame)
    alone = plan(arm, line(frame), arm.neutral, "constant", dt=0.25)
    assert found.joints == arm.joints and np.array_equal(found.q, alone.q)
    goals = line(frame).sample(found.t).pose
    for row, goal in zip(found.q, goals, strict=True):
        whole = DUAL.neutral.copy()
        whole[OF[frame]] = row
        assert DUAL.pose(whole, frame) == pytest.approx(goal, abs=1e-8)


def followed(lock=None, lead=None):
    planner = ftqp.Planner(DUAL, DT, plan=lead, scheme="rmp", tasks=[ftqp.Task()])
    q = DUAL.neutral.copy()
    planner.reset(q)
    way = line(LEFT).sample(DT * np.arange(500))
    targets = ftqp.Targets(way.pose, way.twist, way.acceleration)
    for k in range(500):
        if k == 250 and lock is not None:
            planner.report(ftqp.Locked(lock))
        step = planner.step(q, None, targets.at(k))
        q = step.q.copy()
    return planner, q, step


def test_a_plan_of_one_arm_leads_the_whole_robot(planned):
    _, led, step = followed(lead=planned)
    assert step.status is ftqp.StepStatus.OK and step.position_error < 1e-4
    free = followed()[1]
    away = [float(np.abs(q[OF[LEFT]] - planned.q[-1]).max()) for q in (led, free)]
    assert away[0] < 0.5 * away[1], "its postures lead the null space"
    assert np.abs(led[OF[RIGHT]] - DUAL.neutral[OF[RIGHT]]).max() < 1e-6


@pytest.mark.parametrize("lock", ["left_joint3", "right_joint2"])
def test_what_is_left_after_a_lock_is_said_of_all_joints(planned, lock):
    planner, q, step = followed(lock, planned)
    assert step.status is ftqp.StepStatus.OK
    options = planner.options()
    assert options and all(one.q.shape[1] == DUAL.nv for one in options)
    assert all((one.q[:, OF[RIGHT]] == one.q[0, OF[RIGHT]]).all() for one in options)
    assert options[0].q[0] == pytest.approx(q, abs=1e-6)


@pytest.mark.parametrize("frame", [LEFT, RIGHT])
def test_postures_move_the_arm_to_the_frame_and_leave_the_others(frame):
    near = DUAL.neutral + 0.05
    goal = DUAL.pose(near, frame)
    goal[:3, 3] += (0.05, 0.05, 0.05)
    fault = ftqp.Locked(f"{frame.split('_', maxsplit=1)[0]}_joint3")
    found = ftqp.postures(
        DUAL, goal, near=near, faults=[fault, ftqp.Locked(13 if frame == LEFT else 0)], frame=frame
    )
    assert len(found) > 0 and found.joints == DUAL.joints
    others = np.setdiff1d(np.arange(14), np.arange(14)[OF[frame]])
    for one in found:
        assert DUAL.pose(one.q, frame) == pytest.approx(goal, abs=1e-9)
        assert (one.q[others] == near[others]).all()
        assert one.q[DUAL.joint(fault.joint)] == near[DUAL.joint(fault.joint)]
