"""Error, Jacobian and derivatives of a study's rows against pinocchio and finite differences."""

import numpy as np
import pinocchio as pin
import pytest
from random_chains import random_robot
from studies import study_of

from ftqp.model.robot import Robot

ROWS = [(0, 1, 2, 3, 4, 5), (0, 1, 2), (0, 2, 4), (1, 5)]
STEP = 1e-6


def error(robot: Robot, rows: tuple[int, ...], q: np.ndarray, goal: np.ndarray) -> np.ndarray:
    pose = robot.pose(q)
    turn = pin.log3(goal[:3, :3] @ pose[:3, :3].T)
    return np.concatenate([goal[:3, 3] - pose[:3, 3], robot.length * turn])[list(rows)]


@pytest.mark.parametrize("rows", ROWS)
def test_values_of_any_chain_are_those_of_pinocchio(rows: tuple[int, ...]) -> None:
    rng = np.random.default_rng(3)
    robot = random_robot(rng, 12)
    study = study_of(robot, rows)
    goal = robot.pose(rng.uniform(-1.0, 1.0, 12))
    study.aim(goal)
    q = rng.uniform(-1.0, 1.0, (5, 12))
    e, A, D, H = study.values(q, rates=True)
    scale = np.array([1.0, 1.0, 1.0, *[robot.length] * 3])
    for k in range(5):
        assert e[k] == pytest.approx(error(robot, rows, q[k], goal), abs=1e-12)
        J = (scale[:, None] * robot.jacobian(q[k]))[list(rows)]
        assert pytest.approx(J, abs=1e-12) == A[k]
        for l in range(12):
            d = STEP * np.eye(12)[l]
            rate = (error(robot, rows, q[k] - d, goal) - error(robot, rows, q[k] + d, goal)) / (2.0 * STEP)
            assert D[k, :, l] == pytest.approx(rate, abs=1e-7)
            both = [(scale[:, None] * robot.jacobian(q[k] + s * d))[list(rows)] for s in (1.0, -1.0)]
            assert H[k, l] == pytest.approx((both[0] - both[1]) / (2.0 * STEP), abs=1e-7)


def test_columns_of_held_joints_are_zero() -> None:
    rng = np.random.default_rng(3)
    robot = random_robot(rng, 7)
    study = study_of(robot, ROWS[0])
    study.hold([2, 5])
    _, A, D, _ = study.values(rng.uniform(-1.0, 1.0, (1, 7)))
    assert not A[0][:, [2, 5]].any()
    assert not D[0][:, [2, 5]].any()
    assert A[0].any(axis=0).sum() == 5
