"""Motions on the spot: a path that has stalled goes on from a posture that a self-motion reaches."""

import numpy as np

import ftqp
from ftqp.control.following.ahead import Ahead
from ftqp.control.following.on_the_spot import OnTheSpot
from ftqp.core.pose import rotation_exp

PANDA = ftqp.robots.load("panda")
DT = 4e-3


def near_a_limit():
    """A planner of a healthy arm a self-motion away from a limit, and a path that this blocks."""
    planner = ftqp.Planner(PANDA, DT, task=ftqp.Task(mode="scaled", degrade=()), emergency=None)
    q = PANDA.neutral.copy()
    planner.reset(q)
    goal = PANDA.pose(q)
    goal[:3, 3] += [0.1, 0.1, -0.1]
    return planner, ftqp.paths.PointToPoint(PANDA.pose(q), goal, duration=3.0)


def thought_over(search):
    for _ in range(5000):
        search.think()
        if search.is_over or search.way is not None:
            return
    raise AssertionError("it does not end")


def test_postures_of_the_way_have_the_tip_where_it_is_and_the_path_goes_on_from_the_last():
    planner, path = near_a_limit()
    ahead = Ahead(planner, path, 0.0)
    search = OnTheSpot(planner, ahead)
    thought_over(search)
    assert search.way is not None and search.starts >= 1
    before = PANDA.neutral
    for q in search.way:
        assert np.abs(PANDA.pose(q) - path.start).max() < 1e-6
        assert 0.0 < np.abs(q - before).max() < 0.5
        assert ((q >= PANDA.limits.q_min) & (q <= PANDA.limits.q_max)).all()
        before = q
    pieces = ahead.reached(search.way[-1])
    while True:
        try:
            next(pieces)
        except StopIteration as end:
            assert end.value == 1.0
            break


def test_the_joints_are_led_along_it_at_half_of_their_speed_limits_at_most():
    planner, path = near_a_limit()
    search = OnTheSpot(planner, Ahead(planner, path, 0.0))
    thought_over(search)
    drive = search.drive(DT)
    assert drive is not None and 0.0 < (np.abs(drive) / PANDA.limits.v_max).max() <= 0.5 + 1e-12


def test_an_arm_without_a_joint_to_spare_has_no_motion_on_the_spot():
    planner, path = near_a_limit()
    planner.report(ftqp.Locked(2))
    search = OnTheSpot(planner, Ahead(planner, path, 0.0))
    thought_over(search)
    assert search.way is None and search.is_over and search.sentence.startswith("no joint is left")


def test_the_same_ticks_find_the_same_way():
    ways = []
    for _ in range(2):
        planner, path = near_a_limit()
        search = OnTheSpot(planner, Ahead(planner, path, 0.0))
        thought_over(search)
        ways.append(search.way)
    np.testing.assert_array_equal(*ways)


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
