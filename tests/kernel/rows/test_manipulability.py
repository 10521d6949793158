"""The gradient of the manipulability against finite differences of its definition."""

import numpy as np
import pytest
from records import believe, chain_record

import ftqp
from ftqp.control.task.task import axis_frame, row_indices
from ftqp.kernel.arm.kinematics import forward_kinematics
from ftqp.kernel.layout import enums as codes
from ftqp.kernel.rows.manipulability import FLOOR, manipulability_gradient
from ftqp.kernel.rows.task_rows import task_rows

PANDA = ftqp.robots.load("panda")
SLIDER = ftqp.Robot.from_dh(
    [
        [0.0, 0.3, 0.0, np.pi / 2],
        [0.0, 0.2, 0.1, -np.pi / 2],
        [0.3, 0.0, 0.2, np.pi / 2],
        [0.0, 0.0, 0.3, 0.0],
    ],
    limits={"v_max": 1.0, "q_min": -3.0, "q_max": 3.0},
)


def task_record(robot, rows, failed=()):
    """A record with the robot's chain, a task of those rows, and joints that are locked."""
    K = chain_record(robot)
    task, chosen = K.task, row_indices(rows)
    task.m, task.rows[: len(chosen)] = len(chosen), chosen
    task.length, task.row_scale[:] = robot.length, [1.0, 1.0, 1.0, *[robot.length] * 3]
    task.tool_rows, task.axis[:] = rows == "position_axis", axis_frame([0.3, -0.2, 1.0]).ravel()
    believe(K, dict.fromkeys(failed, codes.LOCKED))
    return K


def rows_at(K, q):
    """The task's rows at q, into the record."""
    K.state.q[: len(q)] = q
    forward_kinematics(K, K.state)
    task_rows(K, 0.0)


def measure(K, robot, q, failed):
    """log sqrt det(A_f A_f' + (FLOOR length)^2 I)."""
    n, m = robot.nv, int(K.task.m)
    rows_at(K, q)
    A = K.qp.A[:m, :n][:, [i for i in range(n) if i not in failed]]
    return 0.5 * np.linalg.slogdet(A @ A.T + (FLOOR * robot.length) ** 2 * np.eye(m))[1]


@pytest.mark.parametrize("rows", ["pose", "position", "position_axis", ("x", "z", "ry")])
@pytest.mark.parametrize("failed", [(), (2,), (0, 5)])
@pytest.mark.parametrize("seed", range(3))
def test_gradient_is_that_of_finite_differences(rows, failed, seed):
    check(PANDA, rows, failed, PANDA.neutral + np.random.default_rng(seed).uniform(-0.5, 0.5, 7))


@pytest.mark.parametrize("rows", ["position", "position_axis", ("x", "y")])
def test_gradient_of_an_arm_with_other_axes(rows):
    check(SLIDER, rows, (), np.array([0.3, -0.4, 0.7, 0.2]))


def test_gradient_at_a_singular_posture_is_finite():
    q = np.zeros(7)
    check(PANDA, "pose", (), q, 1e-3)


def check(robot, rows, failed, q, tolerance=1e-6):
    K = task_record(robot, rows, failed)
    rows_at(K, q)
    manipulability_gradient(K)
    found = K.scratch.joints[: robot.nv].copy()
    h = 3e-5
    for i in (i for i in range(robot.nv) if i not in failed):
        ends = [measure(K, robot, q + sign * h * np.eye(robot.nv)[i], failed) for sign in (1.0, -1.0)]
        assert found[i] == pytest.approx((ends[0] - ends[1]) / (2.0 * h), rel=tolerance, abs=tolerance), i
