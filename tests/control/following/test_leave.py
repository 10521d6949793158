"""A blocked path that may be left by some millimetres: how far the tip goes, and that it comes back."""

import numpy as np
import pytest
from tests.going import follow

import ftqp

STATUS = ftqp.PathStatus
INCH = 0.0254


def went(leader, q, longest):
    """Status at the end, how far the tip was from its path [m], the statuses, and how far each joint went."""
    rows, seen = follow(leader, q, longest, blocked=0.0)
    places = leader.path.sample(np.linspace(0.0, leader.path.duration, 4001)).pose[:, :3, 3]
    tips = np.array([leader.planner.robot.pose(one)[:3, 3] for one in rows])
    off = max(float(np.linalg.norm(places - tip, axis=1).min()) for tip in tips)
    return seen[-1], off, seen, np.abs(rows - q).max(axis=0)


def round_a_hole(dt=2e-3, **given):
    """Two links whose tip cannot come nearer to the base than 0.2 m, on a line that passes it at 0.19 m."""
    robot = ftqp.robots.load("planar", lengths=(0.5, 0.3), continuous=True)
    planner = ftqp.Planner(robot, dt, task=ftqp.Task(mode="scaled"))
    begin, end = np.eye(4), np.eye(4)
    begin[:2, 3], end[:2, 3] = (0.4, 0.19), (-0.4, 0.19)
    q = ftqp.postures(robot, begin[:2, 3])[0].q.copy()
    planner.reset(q)
    start = robot.pose(q)
    goal = start.copy()
    goal[:3, 3] = end[:3, 3]
    return ftqp.PathFollower(planner, ftqp.paths.PointToPoint(start, goal, duration=4.0), **given), q


def test_path_through_what_is_out_of_reach_is_passed_by_within_what_it_may_be_left_by():
    leader, q = round_a_hole()
    status, off, _, _ = went(leader, q, 20.0)
    assert status is STATUS.BLOCKED and off < 2e-3
    leader, q = round_a_hole(leave=0.03)
    status, off, seen, _ = went(leader, q, 30.0)
    assert status is STATUS.DONE and STATUS.BRIDGING in seen
    assert 5e-3 < off < 0.03
    leader, q = round_a_hole(leave=5e-3)
    status, off, _, _ = went(leader, q, 20.0)
    assert status is STATUS.BLOCKED and off < 5e-3
    assert "the tip within 5 mm of its path" in leader.blocked


def eleven_joints(**given):
    """The 11-joint arm on its line with joints 2, 3, 7 and 11 locked, which blocks it at nine tenths."""
    robot = ftqp.robots.load("modular11")
    planner = ftqp.Planner(
        robot, 0.02, level="velocity", task=ftqp.Task(mode="scaled", kp=2.0, degrade=()), emergency=None
    )
    q = np.deg2rad([0.0, -50.0, 0.0, -30.0, 0.0, 70.0, 0.0, 30.0, 0.0, 0.0, 0.0])
    path = ftqp.paths.Line(robot.pose(q), (-100.0 * INCH, 0.0, 0.0), duration=20.0, law="constant")
    leader = ftqp.PathFollower(planner, path, **given)
    for joint in (1, 2, 6, 10):
        planner.report(ftqp.Locked(joint, mode="instant"))
    leader.reset(q)
    return leader, q


def test_arm_goes_back_along_its_path_to_where_a_self_motion_leads_on_within_half_an_inch():
    leader, q = eleven_joints()
    status, off, _, _ = went(leader, q, 40.0)
    assert status is STATUS.BLOCKED and "on the spot were looked at" in leader.blocked
    leader, q = eleven_joints(leave=0.5 * INCH)
    status, off, seen, moved = went(leader, q, 60.0)
    assert status is STATUS.DONE and STATUS.BRIDGING in seen
    assert off < 0.5 * INCH and (moved[[1, 2, 6, 10]] == 0.0).all()


@pytest.mark.parametrize("leave", [-0.01, np.nan, "a little", True])
def test_what_is_no_length_is_refused(leave):
    with pytest.raises(ftqp.InputError, match="leave is"):
        round_a_hole(leave=leave)


def test_bridges_that_may_not_leave_the_path_are_refused():
    with pytest.raises(ftqp.InputError, match="bridges is True and leave 0"):
        round_a_hole(leave=0.0, bridges=True)


@pytest.mark.parametrize("when", ["is looked for", "the joints go"])
def test_failure_while_the_path_is_left_is_borne(when):
    leader, q = eleven_joints(leave=0.5 * INCH)
    v, told, last = np.zeros(11), [], q
    for k in range(3000):
        if not told and leader.blocked is not None and when in leader.blocked:
            leader.planner.report(ftqp.Locked(9, mode="instant"))
            told.append(k)
        step = leader.step(q, v)
        last, q, v = q, step.q.copy(), step.v.copy()
        assert step.status not in (ftqp.StepStatus.FALLBACK, ftqp.StepStatus.INVALID_INPUT)
        if told and leader.status in (STATUS.DONE, STATUS.BLOCKED) and np.abs(v).max() < 1e-6:
            break
    assert told and leader.status in (STATUS.DONE, STATUS.BLOCKED) and np.abs(q - last).max() < 1e-6
