"""An arm that a limit moves, whatever its task asks for, is not stopped for the error that this leaves."""

import numpy as np
import pytest
from tests.going import closed_loop, started

import ftqp

DT = 2e-3
ARMS = (
    "panda", "iiwa14", "puma560", "zhang7", "modular11", "srs7", "xarm7", "planar6", "planar(5)",
)  # fmt: skip


def beyond(robot):
    """Every joint beyond each end of its range, by little and by much."""
    for i in range(robot.nv):
        for limit, side in ((robot.limits.q_max[i], 1.0), (robot.limits.q_min[i], -1.0)):
            for way in (0.05, 0.4) if np.isfinite(limit) else ():
                q = robot.neutral.copy()
                q[i] = limit + side * way
                yield q


def last_of(planner, q, ticks):
    """The last step of an arm that does what it is told, where it begins: it is not stopped meanwhile."""
    *_, last = closed_loop(planner, ftqp.Target(pose=planner.robot.pose(q)), ticks, q)
    assert planner.stopped_because is None, (q, planner.stopped_because)
    return last


def farthest(robot, q):
    """By how much the joint that is farthest beyond its range is beyond it."""
    return max((q - robot.limits.q_max).max(), (robot.limits.q_min - q).max())


@pytest.mark.long
@pytest.mark.parametrize("rows", ["pose", "position"])
@pytest.mark.parametrize("name", ARMS)
def test_an_arm_that_starts_beyond_a_limit_comes_back_and_is_not_stopped(name, level, rows):
    robot = ftqp.robots.load(name)
    task = ftqp.Task() if rows == "pose" else ftqp.Task(rows="position")
    planner = ftqp.Planner(robot, DT, level=level, task=task)
    slow = 0.4 / (0.25 * robot.limits.v_max.min())  # the way back, at a quarter of the speed limit
    for q in beyond(robot):
        assert farthest(robot, last_of(planner, q, round((3.0 + slow) / DT)).q) <= 1e-6, q


def test_so_does_a_slow_arm_whose_tip_passes_its_target():
    """As it passed, its error neither rose nor fell, and what the way back has left was taken for gone."""
    robot = ftqp.robots.load("canadarm2")
    q = robot.neutral.copy()
    q[2] = robot.limits.q_min[2] - 0.4
    assert farthest(robot, last_of(ftqp.Planner(robot, 5.0 * DT), q, 4000).q) <= 1e-6


@pytest.mark.parametrize("drive", ["velocity", "torque"])
def test_so_does_one_whose_drives_take_velocities_or_torques(drive):
    robot = ftqp.robots.load("iiwa14")
    planner = ftqp.Planner(robot, DT, drive=drive)
    for q in beyond(robot):
        assert farthest(robot, last_of(planner, q, 2500).q) <= 1e-6, q


def test_an_arm_whose_range_is_narrowed_behind_it_comes_back_and_is_not_stopped(level):
    robot = ftqp.robots.load("puma560")
    for joint in range(3):
        planner = started(robot, DT, level=level)
        end = float(robot.neutral[joint]) - 0.3
        planner.report(ftqp.Degraded(joint, q_max=end))
        assert last_of(planner, robot.neutral, 2000).q[joint] <= end + 1e-6


def test_a_point_that_starts_on_the_wrong_side_comes_back_and_is_not_stopped(level):
    robot = ftqp.robots.load("panda")
    place = robot.pose(robot.neutral)[:3, 3] + [0.0, 0.0, 0.15]
    planner = ftqp.Planner(robot, DT, level=level, constraints=[ftqp.Keep(robot.tip, above=place)])
    assert robot.pose(last_of(planner, robot.neutral, 3000).q)[2, 3] >= place[2] - 1e-3


def test_bodies_that_start_too_near_come_apart_and_the_arm_is_not_stopped(level):
    robot = ftqp.robots.load("panda")
    scene = ftqp.Scene()
    scene.add("ball", ftqp.Sphere(0.05, robot.pose(robot.neutral)[:3, 3] - [0.0, 0.0, 0.2]))
    planner = ftqp.Planner(
        robot, DT, level=level, scene=scene, clearance=ftqp.Clearance(keep=0.25, self_pairs=False)
    )
    nearest = last_of(planner, robot.neutral, 1).clearance
    assert last_of(planner, robot.neutral, 3000).clearance > nearest


@pytest.mark.parametrize("begins", ["inside", "beyond"])
def test_an_error_that_the_task_itself_leaves_still_stops_the_arm(level, begins):
    """Also of an arm that has come back: what the way back has left does not count, the rest does."""
    robot = ftqp.robots.load("puma560")
    planner = ftqp.Planner(robot, DT, level=level, task=ftqp.Task(rows="position"))
    q = robot.neutral.copy()
    if begins == "beyond":
        q[0] = robot.limits.q_max[0] + 0.15
    q = last_of(planner, q, 2000).q.copy()
    p = robot.pose(q)[:3, 3]
    v = p / np.linalg.norm(p) * 5e-4 / DT  # away from the base, beyond its reach
    away = lambda k: ftqp.Target(position=p + k * DT * v, twist=[*v, 0, 0, 0])  # noqa: E731
    for step in closed_loop(planner, away, 4000, q, reset=False):
        if step.status is ftqp.StepStatus.STOPPED:
            break
    assert "task error" in planner.stopped_because
