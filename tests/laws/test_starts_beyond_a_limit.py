"""An arm that a limit moves, whatever its task asks for, is not stopped for the error that this leaves."""

import numpy as np
import pytest

import ftqp

DT = 2e-3
ARMS = (
    "panda",
    "iiwa14",
    "puma560",
    "zhang7",
    "modular11",
    "srs7",
    "xarm7",
    "planar6",
    "planar(5)",
)


def beyond(robot):
    """Every joint beyond each end of its range, by little and by much."""
    for i in range(robot.nv):
        for limit, side in ((robot.limits.q_max[i], 1.0), (robot.limits.q_min[i], -1.0)):
            for way in (0.05, 0.4) if np.isfinite(limit) else ():
                q = robot.neutral.copy()
                q[i] = limit + side * way
                yield q


def farthest(robot, q):
    """By how much the joint that is farthest beyond its range is beyond it."""
    return max((q - robot.limits.q_max).max(), (robot.limits.q_min - q).max())


def led(planner, q, target, ticks):
    """The steps of an arm that does what it is told, until it is stopped."""
    for _ in range(ticks):
        step = planner.step(q, None, target)
        q = step.q.copy()
        yield step
        if step.status is ftqp.StepStatus.STOPPED:
            return


@pytest.mark.long
@pytest.mark.parametrize("rows", ["pose", "position"])
@pytest.mark.parametrize("name", ARMS)
def test_an_arm_that_starts_beyond_a_limit_comes_back_and_is_not_stopped(name, level, rows):
    robot = ftqp.robots.load(name)
    task = ftqp.Task() if rows == "pose" else ftqp.Task(rows="position")
    planner = ftqp.Planner(robot, DT, level=level, task=task)
    slow = 0.4 / (0.25 * robot.limits.v_max.min())  # the way back, at a quarter of the speed limit
    for q in beyond(robot):
        planner.reset(q)
        target = ftqp.Target(pose=robot.pose(q))
        for step in led(planner, q, target, round((3.0 + slow) / DT)):
            where = step.q
        assert planner.stopped_because is None and farthest(robot, where) <= 1e-6, (
            q,
            planner.stopped_because,
        )


def test_so_does_a_slow_arm_whose_tip_passes_its_target():
    """As it passed, its error neither rose nor fell, and what the way back has left was taken for gone."""
    robot = ftqp.robots.load("canadarm2")
    planner = ftqp.Planner(robot, 5.0 * DT)
    q = robot.neutral.copy()
    q[2] = robot.limits.q_min[2] - 0.4
    planner.reset(q)
    *_, last = led(planner, q, ftqp.Target(pose=robot.pose(q)), 4000)
    assert planner.stopped_because is None and farthest(robot, last.q) <= 1e-6


@pytest.mark.parametrize("drive", ["velocity", "torque"])
def test_so_does_one_whose_drives_take_velocities_or_torques(drive):
    robot = ftqp.robots.load("iiwa14")
    planner = ftqp.Planner(robot, DT, drive=drive)
    for q in beyond(robot):
        planner.reset(q)
        *_, last = led(planner, q, ftqp.Target(pose=robot.pose(q)), 2500)
        assert planner.stopped_because is None and farthest(robot, last.q) <= 1e-6, q


def test_an_arm_whose_range_is_narrowed_behind_it_comes_back_and_is_not_stopped(level):
    robot = ftqp.robots.load("puma560")
    for joint in range(3):
        planner = ftqp.Planner(robot, DT, level=level)
        q = robot.neutral.copy()
        planner.reset(q)
        planner.report(ftqp.Degraded(joint, q_max=float(q[joint]) - 0.3))
        *_, last = led(planner, q, ftqp.Target(pose=robot.pose(q)), 2000)
        assert planner.stopped_because is None, joint
        assert last.q[joint] <= q[joint] - 0.3 + 1e-6


def test_a_point_that_starts_on_the_wrong_side_comes_back_and_is_not_stopped(level):
    robot = ftqp.robots.load("panda")
    q, pose = robot.neutral.copy(), robot.pose(robot.neutral)
    keep = ftqp.Keep(robot.tip, above=pose[:3, 3] + [0.0, 0.0, 0.15])
    planner = ftqp.Planner(robot, DT, level=level, constraints=[keep])
    planner.reset(q)
    *_, last = led(planner, q, ftqp.Target(pose=pose), 3000)
    assert planner.stopped_because is None
    assert robot.pose(last.q)[2, 3] >= pose[2, 3] + 0.15 - 1e-3


def test_bodies_that_start_too_near_come_apart_and_the_arm_is_not_stopped(level):
    robot = ftqp.robots.load("panda")
    q, pose = robot.neutral.copy(), robot.pose(robot.neutral)
    scene = ftqp.Scene()
    scene.add("ball", ftqp.Sphere(0.05, pose[:3, 3] - [0.0, 0.0, 0.2]))
    planner = ftqp.Planner(
        robot, DT, level=level, scene=scene, clearance=ftqp.Clearance(keep=0.25, self_pairs=False)
    )
    planner.reset(q)
    nearest = planner.step(q, None, ftqp.Target(pose=pose)).clearance
    *_, last = led(planner, q, ftqp.Target(pose=pose), 3000)
    assert planner.stopped_because is None and last.clearance > nearest


@pytest.mark.parametrize("started", ["inside", "beyond"])
def test_an_error_that_the_task_itself_leaves_still_stops_the_arm(level, started):
    """Also of an arm that has come back: what the way back has left does not count, the rest does."""
    robot = ftqp.robots.load("puma560")
    planner = ftqp.Planner(robot, DT, level=level, task=ftqp.Task(rows="position"))
    q = robot.neutral.copy()
    if started == "beyond":
        q[0] = robot.limits.q_max[0] + 0.15
    planner.reset(q)
    target = ftqp.Target(position=robot.pose(q)[:3, 3])
    for step in led(planner, q, target, 2000):
        q = step.q.copy()
    assert planner.stopped_because is None
    p, way = robot.pose(q)[:3, 3], robot.pose(q)[:3, 3] / np.linalg.norm(robot.pose(q)[:3, 3])
    for k in range(4000):  # away from the base, beyond its reach
        step = planner.step(
            q, None, ftqp.Target(position=p + 5e-4 * k * way, twist=[*(way * 5e-4 / DT), 0, 0, 0])
        )
        q = step.q.copy()
        if step.status is ftqp.StepStatus.STOPPED:
            break
    assert "task error" in planner.stopped_because
