"""The outlook of a stalled path: a way past the singularity where there is one, else none."""

import numpy as np
import pytest
from session_ticks import Ticks

import ftqp
from ftqp.kernel.arm.kinematics import forward_kinematics
from ftqp.kernel.arm.pose_error import pose_error
from ftqp.kernel.calm.path_outlook import outlook
from ftqp.kernel.entry.session import PathMemory
from ftqp.kernel.rows.task_rows import task_rows

SPEED = 0.05


def seen(name, q, way, speed=SPEED):
    """The path's room after a look from q along a twist, and the record."""
    robot = ftqp.robots.load(name)
    n = robot.nv
    K = Ticks(robot, 0.002, torque_limits=False).K
    K.faults.order[:n], K.faults.working, K.faults.movable = np.arange(n), n, n
    K.calm.on = 1
    path = PathMemory(np.zeros((1, 50))).path
    path.speed = speed
    K.state.q[:n] = q
    K.task.target[:] = ftqp.Target(pose=robot.pose(q), twist=[*way, 0.0, 0.0, 0.0]).packed
    forward_kinematics(K, K.state)
    pose_error(K)
    task_rows(K, 1.0)
    error = K.task.error.copy()
    outlook(K, path)
    np.testing.assert_array_equal(K.task.error, error)
    return path, robot


CASES = {
    "planar, stretched": ("planar(4)", np.zeros(4), (1.0, 0.0, 0.0)),
    "iiwa, straight": ("iiwa14", np.zeros(7), (0.0, 0.0, 1.0)),
    "srs7, straight": ("srs7", np.zeros(7), (0.0, 0.0, 1.0)),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_there_is_a_way_back_from_the_end_of_the_reach_and_none_beyond(case):
    name, q, out = case
    assert not seen(name, q, out)[0].found
    path, robot = seen(name, q, -np.array(out))
    assert path.found and path.driven
    way = path.drive[: robot.nv]
    assert np.abs(way).max() == pytest.approx(SPEED)
    for step in (way, -way):  # a self-motion to first order, along the path to second
        moved = robot.pose(q + 0.2 * step)[:3, 3] - robot.pose(q)[:3, 3]
        assert moved @ -np.array(out) > 1e-6 and np.linalg.norm(moved) < 0.01 * robot.length


def test_nothing_is_looked_for_that_was_not_asked_for_or_where_the_posture_is_regular():
    assert not seen("planar(4)", np.zeros(4), (-1.0, 0.0, 0.0), speed=0.0)[0].found
    panda = ftqp.robots.load("panda")
    assert not seen("panda", panda.neutral, (-1.0, 0.0, 0.0))[0].found


def test_the_way_goes_on_to_the_side_on_which_it_was_begun():
    path, _ = seen("planar(4)", np.zeros(4), (-1.0, 0.0, 0.0))
    first = path.drive[:4].copy()
    robot = ftqp.robots.load("planar(4)")
    K = Ticks(robot, 0.002, torque_limits=False).K
    K.faults.order[:4], K.faults.working, K.faults.movable = np.arange(4), 4, 4
    K.calm.on = 1
    path.drive[:4] = -first
    K.task.target[:] = ftqp.Target(pose=robot.pose(np.zeros(4)), twist=[-1.0, 0.0, 0.0, 0.0, 0.0, 0.0]).packed
    K.state.q[:4] = 0.0
    forward_kinematics(K, K.state)
    pose_error(K)
    task_rows(K, 1.0)
    outlook(K, path)
    np.testing.assert_allclose(path.drive[:4], -first, atol=1e-12)
