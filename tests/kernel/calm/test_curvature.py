"""The curvature of the error against finite differences of the error itself."""

import numpy as np
import pytest
from session_ticks import Ticks

import ftqp
from ftqp.kernel.arm.kinematics import forward_kinematics
from ftqp.kernel.arm.pose_error import pose_error
from ftqp.kernel.calm.curvature import curvature, weigh_rows
from ftqp.kernel.rows.task_rows import task_rows

STEP = 1e-4


def record_at(robot, task, q, target):
    K = Ticks(robot, 0.002, level="velocity", task=task, torque_limits=False).K
    n = robot.nv
    K.faults.order[:n], K.faults.working, K.faults.movable = np.arange(n), n, n
    K.task.target[:] = target.packed
    K.state.q[:n] = q
    return K


def energy(K, q):
    n = int(K.chain.n)
    K.state.q[:n] = q
    forward_kinematics(K, K.state)
    pose_error(K)
    task_rows(K, 1.0)
    return 0.5 * weigh_rows(K.task, K.kinematics, K.chain, K.qp, K.calm)


def hessian(K, q):
    n = len(q)
    H = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            a, b = np.zeros(n), np.zeros(n)
            a[i] = b[j] = STEP
            H[i, j] = H[j, i] = (
                energy(K, q + a + b) - energy(K, q + a - b) - energy(K, q - a + b) + energy(K, q - a - b)
            ) / (4.0 * STEP * STEP)
    return H


def sliding_arm():
    """Six joints, two of which slide."""
    table = [
        (0.0, 0.3, 0.0, 1.2), (0.3, 0.1, 0.3, -0.9), (0.2, 0.2, 0.0, 1.5),
        (0.5, 0.1, 0.2, -1.1), (-0.4, 0.15, 0.1, 0.8), (0.0, 0.1, 0.05, 0.3),
    ]  # fmt: skip
    limits = {"q_min": -3.0, "q_max": 3.0, "v_max": 2.0}
    return ftqp.Robot.from_dh(table, limits=limits, acceleration=5.0, prismatic=(2, 4))


CASES = [
    ("panda", ftqp.Task(), 0.3),
    ("panda", ftqp.Task(priority="position_first"), 0.3),
    ("panda", ftqp.Task(), 2.5),
    ("iiwa14", ftqp.Task(rows="position"), 0.3),
    ("xarm7", ftqp.Task(rows="position_axis"), 0.3),
    ("xarm7", ftqp.Task(rows="position_axis", axis=(1.0, 1.0, 0.0)), 2.0),
    ("puma560", ftqp.Task(rows=("x", "z")), 0.3),
    ("planar6", ftqp.Task(rows=("x", "y", "rz")), 0.5),
    ("slider", ftqp.Task(), 0.4),
]


@pytest.mark.parametrize(("name", "task", "angle"), CASES)
def test_the_curvature_is_the_hessian_of_half_the_squared_error(name, task, angle):
    rng = np.random.default_rng(3)
    robot = sliding_arm() if name == "slider" else ftqp.robots.load(name)
    q = robot.neutral + rng.uniform(-0.4, 0.4, robot.nv)
    away = q + rng.uniform(-0.2, 0.2, robot.nv)
    pose = robot.pose(away)
    axis = rng.normal(size=3) if robot.default_rows != ("x", "y") else np.array([0.0, 0.0, 1.0])
    axis *= angle / np.linalg.norm(axis)
    pose[:3, :3] = rotation(axis) @ robot.pose(q)[:3, :3]
    pose[:3, 3] += rng.uniform(-0.3, 0.3, 3)
    K = record_at(robot, task, q, ftqp.Target(pose=pose))
    expected = hessian(K, q)
    energy(K, q)
    n, m = robot.nv, int(K.task.m)
    s = curvature(K.faults, K.task, K.kinematics, K.chain, K.calm)
    A, e = K.calm.A[:m, :n].copy(), K.calm.e[:m].copy()
    gradient = [(energy(K, q + d) - energy(K, q - d)) / (2.0 * STEP) for d in STEP * np.eye(n)]
    np.testing.assert_allclose(-A.T @ e, gradient, atol=1e-7)
    energy(K, q)
    S = K.calm.S[:n, :n]
    assert s == pytest.approx(np.linalg.norm(S))
    np.testing.assert_allclose(K.calm.A[:m, :n].T @ K.calm.A[:m, :n] + S, expected, atol=2e-7)


def rotation(vector):
    angle = np.linalg.norm(vector)
    x, y, z = vector / angle
    X = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * X + (1.0 - np.cos(angle)) * X @ X
