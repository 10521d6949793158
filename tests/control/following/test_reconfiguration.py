"""Blocked paths: bridges to another posture, and paths that may be left by some millimetres."""

import numpy as np
import pytest
from tests.going import closed_loop, follow, started

import ftqp
from ftqp.core.pose import rotation_exp

PANDA = ftqp.robots.load("panda")
STATUS = ftqp.PathStatus
DT = 4e-3
START = np.array([1.445, -1.071, 0.615, -2.617, -2.145, 1.41, -1.885])
"""With joint 5 locked here, joint 1 comes to its upper limit on the line; another posture goes on."""


def goal():
    T = PANDA.pose(START).copy()
    T[:3, 3] += [0.169, 0.147, -0.278]
    T[:3, :3] = rotation_exp(np.array([0.356, 0.093, -0.232])) @ T[:3, :3]
    return T


def follower(level="acceleration", degrade=(), **given):
    planner = started(PANDA, DT, level=level, task=ftqp.Task(mode="scaled", degrade=degrade), at=START)
    planner.report(ftqp.Locked(4, mode="instant"))
    line = ftqp.paths.PointToPoint(PANDA.pose(START), goal(), duration=2.7)
    return ftqp.PathFollower(planner, line, **given)


def test_blocked_path_is_finished_over_a_bridge_within_limits(level):
    leader = follower(level, bridges=True)
    rows, seen = follow(leader, START)
    assert seen[-1] is STATUS.DONE and STATUS.BRIDGING in seen
    assert np.abs(PANDA.pose(rows[-1]) - goal()).max() < 1e-3
    assert (rows[:, 4] == START[4]).all() and leader.blocked is None
    inside = (rows >= PANDA.limits.q_min - 1e-9) & (rows <= PANDA.limits.q_max + 1e-9)
    assert inside.all()


def test_steps_on_a_bridge_say_how_far_the_tip_is_from_its_path_and_are_not_ok():
    leader, q, v, off = follower(bridges=True), START.copy(), np.zeros(7), 0.0
    for _ in range(1600):
        before, step = q.copy(), leader.step(q, v)
        q, v = step.q.copy(), step.v.copy()
        if leader.status is STATUS.BRIDGING and "the joints go" in leader.blocked:
            away = leader.target.position - PANDA.pose(before)[:3, 3]
            assert step.position_error == pytest.approx(np.linalg.norm(away), abs=1e-9)
            assert np.abs(step.task_error[:3] - away).max() < 1e-9
            off = max(off, step.position_error)
            far = step.position_error > 0.01 or step.rotation_error > 0.05
            assert (step.status is ftqp.StepStatus.LAGGING) == far
    assert off > 0.04


def test_without_bridges_the_tip_waits_on_the_path():
    leader = follower()
    rows, seen = follow(leader, START)
    assert seen[-1] is STATUS.BLOCKED and STATUS.BRIDGING not in seen
    at = leader.path.sample(np.array([leader.progress])).pose[0]
    assert np.linalg.norm(PANDA.pose(rows[-1])[:3, 3] - at[:3, 3]) < 2e-3
    assert "panda_joint1 (upper position limit)" in leader.blocked


def test_what_is_done_is_said_and_a_path_without_a_bridge_says_what_was_looked_for():
    leader, said = follower(bridges=True), set()
    follow(leader, START, each=lambda k: said.add(leader.blocked))
    text = "\n".join(str(one) for one in said)
    assert "is looked for" in text and "the joints go to another posture, from which the path goes on" in text
    T = PANDA.pose(START).copy()
    T[:3, 3] += [1.5, 0.0, 0.0]
    planner = started(PANDA, DT, task=ftqp.Task(mode="scaled", degrade=()), at=START)
    away = ftqp.PathFollower(
        planner, ftqp.paths.PointToPoint(PANDA.pose(START), T, duration=6.0), bridges=True
    )
    _, seen = follow(away, START, longest=40.0)
    assert seen[-1] is STATUS.BLOCKED and "no bridge was found" in away.blocked


@pytest.mark.parametrize("when", ["is looked for", "the joints go"])
def test_second_failure_on_the_bridge_is_borne_and_a_repair_lets_the_path_go_on(when):
    leader, told = follower(bridges=True), []

    def each(k):
        if not told and leader.blocked is not None and when in leader.blocked:
            leader.planner.report(ftqp.Locked(2))
            told.append(k)

    rows, seen = follow(leader, START, longest=15.0, each=each)
    assert told and seen[-1] in (STATUS.BLOCKED, STATUS.DONE, STATUS.BRIDGING)
    assert np.abs(rows[-1] - rows[-2]).max() < 1e-4


def test_stop_on_the_bridge_is_a_stop_and_resume_goes_on():
    leader, told = follower(bridges=True), []

    def each(k):
        if not told and leader.blocked is not None and "the joints go" in leader.blocked:
            leader.planner.stop()
            told.append(k)
        if told and k == told[0] + 200:
            assert leader.planner.stopped_because is not None
            leader.planner.resume()

    rows, seen = follow(leader, START, each=each)
    assert told and seen[-1] is STATUS.DONE and np.abs(PANDA.pose(rows[-1]) - goal()).max() < 1e-3


@pytest.mark.slow
def test_rows_that_were_given_up_stay_so_over_a_bridge_and_the_tip_stays_on_its_path():
    """The posture that is gone to is one of the rows that are kept; all of them would throw the tip off."""
    q, v, off, stopped = np.array([0.32, -0.816, -0.615, -2.476, 2.073, 1.224, 1.931]), np.zeros(7), 0.0, 0
    T = PANDA.pose(q).copy()
    T[:3, 3] += [0.189, -0.197, -0.07]
    T[:3, :3] = rotation_exp(np.array([-0.087, 0.295, -0.228])) @ T[:3, :3]
    planner = started(PANDA, DT, task=ftqp.Task(mode="scaled"), at=q)
    planner.report(ftqp.Locked(3, mode="instant"))
    line = ftqp.paths.PointToPoint(PANDA.pose(q), T, duration=2.111)
    leader, led, rows = ftqp.PathFollower(planner, line, bridges=True), False, set()
    for _ in range(round(9.0 / DT)):
        on_bridge = "the joints go" in (leader.blocked or "")
        step = leader.step(q, v)
        q, v = step.q.copy(), step.v.copy()
        led |= on_bridge
        if led and not on_bridge:
            off, stopped = max(off, step.position_error), stopped + (step.status is ftqp.StepStatus.STOPPED)
            rows.add(len(planner.task_rows))
    assert led and rows == {3} and not stopped and off < 5e-3


def test_path_that_ends_in_a_wall_is_blocked_soon_and_names_the_wall():
    """What is looked at ahead meets the scene, too: no motion on the spot is gone in vain."""
    panda = ftqp.robots.load("panda")
    pose = panda.pose(panda.neutral)
    scene = ftqp.Scene()
    scene.add("crate", ftqp.Box((0.1, 0.3, 0.3), tuple(pose[:3, 3] + [0.25, 0.0, 0.0])))
    planner = started(
        panda, 4e-3, task=ftqp.Task(mode="scaled"), scene=scene, clearance=ftqp.Clearance(keep=0.02)
    )
    line = ftqp.paths.Line(pose, (0.2, 0.0, 0.0), duration=2.0)
    follower = ftqp.PathFollower(planner, line, bridges=True)
    for _ in closed_loop(follower, None, 750, reset=False):
        assert "another posture, from which" not in (follower.blocked or "")
        if follower.status is STATUS.BLOCKED:
            break
    assert follower.status is STATUS.BLOCKED
    assert "panda_link7 and crate are as near as they may be" in follower.blocked
    assert "postures found" in follower.blocked
    assert follower.blocked.endswith("and the path goes on from none")


def test_arm_all_of_whose_joints_are_locked_says_that_none_works():
    panda = ftqp.robots.load("panda")
    planner = started(panda, 4e-3, task=ftqp.Task(mode="scaled"), remember=5.0)
    for joint in range(7):
        planner.report(ftqp.Locked(joint, mode="instant"))
    line = ftqp.paths.Line(panda.pose(panda.neutral), (0.1, 0.0, 0.0), duration=2.0)
    follower = ftqp.PathFollower(planner, line, bridges=True)
    q = panda.neutral.copy()
    for _ in range(300):
        follower.step(q, np.zeros(7))
    assert follower.status is ftqp.PathStatus.BLOCKED
    assert "no joint is left for a motion on the spot" in follower.blocked
    assert "no joints work, and the goal has 6 rows" in follower.blocked
    assert [way.kind for way in planner.ways_out()] == ["stop"]


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


@pytest.mark.slow
def test_path_through_what_is_out_of_reach_is_passed_by_within_what_it_may_be_left_by():
    leader, q = round_a_hole()
    status, off, _, _ = went(leader, q, 20.0)
    assert status is STATUS.BLOCKED and off < 2e-3
    leader, q = round_a_hole(leave=0.03)
    status, off, seen, _ = went(leader, q, 30.0)
    assert status is STATUS.DONE and STATUS.PASSING in seen and STATUS.BRIDGING not in seen
    assert 5e-3 < off < 0.015  # the line is 10 mm inside of the hole
    leader, q = round_a_hole(leave=5e-3)
    status, off, _, _ = went(leader, q, 20.0)
    assert status is STATUS.BLOCKED and off < 5e-3
    assert "the end effector within 5 mm of its path" in leader.blocked


def test_bridge_goes_past_what_no_posture_goes_through():
    leader, q = round_a_hole(4e-3, bridges=True)
    status, _, seen, _ = went(leader, q, 30.0)
    assert status is STATUS.DONE and STATUS.BRIDGING in seen and STATUS.PASSING not in seen


@pytest.mark.parametrize(("beyond", "ended"), [(5e-3, STATUS.DONE), (0.015, STATUS.BLOCKED)])
def test_end_out_of_reach_is_come_as_near_to_as_the_arm_can_beside_its_path(beyond, ended, level):
    robot = ftqp.robots.load("planar", lengths=(0.5, 0.3), continuous=True)
    start = np.array([0.6, -0.4])
    q = ftqp.postures(robot, start)[0].q.copy()
    goal = robot.pose(q).copy()
    goal[:2, 3] = (0.8 + beyond) * np.array([np.cos(0.7), np.sin(0.7)])
    left = {}
    for leave in (0.0, 0.06):
        planner = started(robot, DT, level=level, task=ftqp.Task(mode="scaled"), at=q)
        path = ftqp.paths.PointToPoint(robot.pose(q), goal, duration=4.0)
        leader = ftqp.PathFollower(planner, path, leave=leave)
        rows, seen = follow(leader, q)
        left[leave] = np.linalg.norm(robot.pose(rows[-1])[:3, 3] - goal[:3, 3])
        assert (STATUS.PASSING in seen) == (leave > 0.0)
        assert seen[-1] is (ended if leave > 0.0 else STATUS.BLOCKED)
    assert left[0.06] < beyond + 1e-4 and left[0.0] > 1.3 * beyond


def eleven_joints(locked=(1, 8, 10), **given):
    """The 11-joint arm on its line with joints 2, 9 and 11 locked, which blocks it at nine tenths."""
    robot = ftqp.robots.load("modular11")
    planner = ftqp.Planner(
        robot, 0.02, level="velocity", task=ftqp.Task(mode="scaled", kp=2.0, degrade=()), emergency=None
    )
    q = np.deg2rad([0.0, -50.0, 0.0, -30.0, 0.0, 70.0, 0.0, 30.0, 0.0, 0.0, 0.0])
    path = ftqp.paths.Line(robot.pose(q), (-100.0 * INCH, 0.0, 0.0), duration=20.0, law="constant")
    leader = ftqp.PathFollower(planner, path, **given)
    for joint in locked:
        planner.report(ftqp.Locked(joint, mode="instant"))
    leader.reset(q)
    return leader, q


@pytest.mark.slow
def test_arm_goes_back_along_its_path_to_where_a_self_motion_leads_on_within_half_an_inch():
    leader, q = eleven_joints()
    status, off, _, _ = went(leader, q, 40.0)
    assert status is STATUS.BLOCKED and "on the spot were looked at" in leader.blocked
    leader, q = eleven_joints(leave=0.5 * INCH)
    status, off, seen, moved = went(leader, q, 60.0)
    assert status is STATUS.DONE and STATUS.BRIDGING in seen
    assert off < 0.5 * INCH and (moved[[1, 8, 10]] == 0.0).all()


@pytest.mark.slow
def test_arm_that_stalls_goes_on_by_a_motion_on_the_spot_with_the_tip_on_its_path():
    locked = [1, 2, 6, 10]
    leader, q = eleven_joints(locked)
    status, off, seen, moved = went(leader, q, 60.0)
    assert status is STATUS.DONE and STATUS.ESCAPING in seen and STATUS.BRIDGING not in seen
    assert off < 5e-3 and (moved[locked] == 0.0).all() and moved.max() > 0.5


@pytest.mark.parametrize(
    ("given", "said"),
    [
        *(({"leave": leave}, "leave is") for leave in (-0.01, np.nan, "a little", True)),
        ({"leave": 0.0, "bridges": True}, "bridges is True and leave 0"),
        ({"bridges": "yes"}, "bridges"),
    ],
)
def test_what_is_no_length_and_no_word_is_refused(given, said):
    with pytest.raises(ftqp.InputError, match=said):
        round_a_hole(**given)


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


def test_a_blocked_path_says_what_was_looked_for_and_a_failed_arm_goes_on_in_fewer_rows():
    found = {}
    for degrade in ((), None, ("pose", "position_axis", "position")):
        leader = follower(degrade=degrade)
        rows, seen = follow(leader, START, 12.0, blocked=0.0)
        found[degrade] = seen, leader.blocked, np.linalg.norm((PANDA.pose(rows[-1]) - goal())[:3, 3])
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
        planner = started(PANDA, DT, task=ftqp.Task(mode="scaled"))
        if fault is not None:
            planner.report(fault)
        path = ftqp.paths.PointToPoint(PANDA.pose(PANDA.neutral), goal, duration=6.0)
        leader = ftqp.PathFollower(planner, path)
        _, seen = follow(leader, PANDA.neutral, blocked=0.0)
        assert seen[-1] is STATUS.BLOCKED and leader.blocked is not None
        assert fault is not None or STATUS.FEWER_ROWS not in seen
