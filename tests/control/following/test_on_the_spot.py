"""Motions on the spot: a path that has stalled goes on from a posture that a self-motion reaches."""

import numpy as np

import ftqp
from ftqp.core.pose import rotation_exp

PANDA = ftqp.robots.load("panda")
DT = 4e-3


def test_a_blocked_path_says_what_was_looked_for_and_a_failed_arm_goes_on_in_fewer_rows():
    start = np.array([1.445, -1.071, 0.615, -2.617, -2.145, 1.41, -1.885])
    goal = PANDA.pose(start).copy()
    goal[:3, 3] += [0.169, 0.147, -0.278]
    goal[:3, :3] = rotation_exp(np.array([0.356, 0.093, -0.232])) @ goal[:3, :3]
    found = {}
    for degrade in ((), None, ("pose", "position_axis", "position")):
        planner = ftqp.Planner(PANDA, DT, task=ftqp.Task(mode="scaled", degrade=degrade))
        planner.reset(start)
        planner.report(ftqp.Locked(4, mode="instant"))
        leader = ftqp.PathFollower(planner, ftqp.paths.PointToPoint(PANDA.pose(start), goal, duration=2.7))
        q, v, seen = start.copy(), np.zeros(7), []
        for _ in range(3000):
            step = leader.step(q, v)
            q, v = step.q.copy(), step.v.copy()
            if leader.status not in seen:
                seen.append(leader.status)
            if leader.status in (ftqp.PathStatus.DONE, ftqp.PathStatus.BLOCKED):
                break
        found[degrade] = seen, leader.blocked, np.linalg.norm(PANDA.pose(q)[:3, 3] - goal[:3, 3])
    assert found[()][0][-1] is ftqp.PathStatus.BLOCKED
    assert "no joint is left for a motion on the spot" in found[()][1]
    fewer = found["pose", "position_axis", "position"]
    assert ftqp.PathStatus.FEWER_ROWS in fewer[0] and fewer[2] < 0.5 * found[()][2]
    unasked = found[None]  # nobody has named sets: a search says that the path goes on with the position
    assert unasked[0][-2:] == [ftqp.PathStatus.FEWER_ROWS, ftqp.PathStatus.DONE] and unasked[2] < 1e-3


def test_rows_that_would_not_help_are_not_given_up_unasked():
    goal = PANDA.pose(PANDA.neutral).copy()
    goal[:3, 3] += [1.5, 0.0, 0.0]
    for fault in (
        None,
        ftqp.Locked(2, mode="instant"),
    ):  # without a fault nothing is given up, nor out of reach
        planner = ftqp.Planner(PANDA, DT, task=ftqp.Task(mode="scaled"))
        planner.reset(PANDA.neutral)
        if fault is not None:
            planner.report(fault)
        path = ftqp.paths.PointToPoint(PANDA.pose(PANDA.neutral), goal, duration=6.0)
        leader, q, v = ftqp.PathFollower(planner, path), PANDA.neutral.copy(), np.zeros(7)
        while leader.status is not ftqp.PathStatus.BLOCKED:
            step = leader.step(q, v)
            q, v = step.q.copy(), step.v.copy()
            assert leader.status is not ftqp.PathStatus.DONE and planner.tick < 20.0 / DT
            if fault is None:
                assert leader.status is not ftqp.PathStatus.FEWER_ROWS
        assert leader.blocked is not None
