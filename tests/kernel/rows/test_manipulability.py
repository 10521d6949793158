"""The gradient of the manipulability against finite differences of its definition."""

import numpy as np
import pytest
from tests.kernel.records import address, on_record

import ftqp
from ftqp.control.task.task import axis_frame, row_indices
from ftqp.kernel.arm.kinematics import forward_kinematics
from ftqp.kernel.jit import jit
from ftqp.kernel.layout import enums as codes
from ftqp.kernel.layout.record import load_chain, record
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


@on_record
@jit
def rows_at(K):
    forward_kinematics(K)
    task_rows(K)


@on_record
@jit
def gradient_at(K):
    forward_kinematics(K)
    task_rows(K)
    manipulability_gradient(K)


def planner_record(robot, rows, failed=()):
    W = record()
    load_chain(W, **robot.chain.constants())
    chosen = row_indices(rows)
    W["m"], W["rows"][0, : len(chosen)] = len(chosen), chosen
    W["length"], W["row_scale"] = robot.length, [1.0, 1.0, 1.0, *[robot.length] * 3]
    W["tool_rows"], W["axis"] = rows == "position_axis", axis_frame([0.3, -0.2, 1.0]).ravel()
    for joint in failed:
        W["fault"][0, joint] = codes.LOCKED
    return W


def measure(W, robot, q, failed):
    """log sqrt det(A_f A_f' + (FLOOR length)^2 I)."""
    n, m = robot.nv, int(W["m"][0])
    W["q"][0, :n] = q
    rows_at(address(W))
    A = W["A"][0, :m, :n][:, [i for i in range(n) if i not in failed]]
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
    W = planner_record(robot, rows, failed)
    W["q"][0, : robot.nv] = q
    gradient_at(address(W))
    found = W["scratch"][0, : robot.nv].copy()
    h = 3e-5
    for i in (i for i in range(robot.nv) if i not in failed):
        ends = [measure(W, robot, q + sign * h * np.eye(robot.nv)[i], failed) for sign in (1.0, -1.0)]
        assert found[i] == pytest.approx((ends[0] - ends[1]) / (2.0 * h), rel=tolerance, abs=tolerance), i
