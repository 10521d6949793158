"""The linearisation against central differences, and its eigenvalues at the goal."""

import numpy as np
import pytest
from planar_arms import links

from ftqp.analysis.goals import goal_study
from ftqp.analysis.rest.linearisation import convergence_rates, reduced_jacobians, weighted_inverse
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.model import catalog
from ftqp.model.robot import Robot

STEP = 1e-6


def weights(rng: np.random.Generator, n: int) -> FloatArray:
    B = rng.normal(size=(n, n))
    return np.asarray(B @ B.T + 0.5 * np.eye(n))


def arms() -> list[tuple[Robot, str]]:
    return [
        (links(1, 1, 1), "position"),
        (links(1, 0.7, 0.9, 0.4), "position"),
        (catalog.load("panda"), "pose"),
    ]


@pytest.mark.parametrize("which", range(3))
def test_linearisation_is_that_of_central_differences(which: int) -> None:
    robot, rows = arms()[which]
    rng = np.random.default_rng(which)
    n = robot.nv
    q = robot.neutral + rng.uniform(-0.4, 0.4, n)
    study = goal_study(robot, robot.pose(robot.neutral), rows)
    M = np.linalg.inv(weights(rng, n))

    def command(p: FloatArray) -> FloatArray:
        e, A, _, _ = study.free.values(p[None])
        return np.asarray(weighted_inverse(A[0], M) @ e[0])

    rates = np.column_stack([(command(q + d) - command(q - d)) / (2.0 * STEP) for d in STEP * np.eye(n)])
    for locked in ([0], [n - 1], [0, 1]):
        found = reduced_jacobians(study, M, q[None], locked)[0]
        expected = np.delete(np.delete(rates, locked, 0), locked, 1)
        assert found == pytest.approx(expected, abs=1e-7 * np.abs(rates).max())


@pytest.mark.parametrize("which", range(3))
def test_eigenvalues_at_the_goal_are_minus_one_zero_and_minus_rho(which: int) -> None:
    robot, rows = arms()[which]
    rng = np.random.default_rng(which)
    n = robot.nv
    q = robot.neutral + rng.uniform(-0.4, 0.4, n)
    study = goal_study(robot, robot.pose(q), rows)
    for W in (np.eye(n), weights(rng, n)):
        rho = convergence_rates(robot, q, rows, W)
        for i, joint in enumerate(robot.joints):
            found = reduced_jacobians(study, np.linalg.inv(W), q[None], [i])[0]
            expected = [-1.0] * (study.m - 1) + [0.0] * (study.redundancy - 1) + [-rho[joint]]
            assert np.sort(np.linalg.eigvals(found).real) == pytest.approx(np.sort(expected), abs=1e-10)


def test_rate_without_weights_is_the_squared_relative_manipulability() -> None:
    robot = catalog.load("panda")
    J = robot.jacobian(robot.neutral)[:3]
    for i, rho in enumerate(convergence_rates(robot, robot.neutral).values()):
        left = np.delete(J, i, axis=1)
        assert rho == pytest.approx(np.linalg.det(left @ left.T) / np.linalg.det(J @ J.T), abs=1e-10)


def test_weights_that_are_not_diagonal_can_make_the_goal_repel() -> None:
    robot, q = links(1, 1, 1), np.array([0.3, 0.9, 0.02])
    W = np.eye(3)
    W[1, 2] = W[2, 1] = 0.9
    assert min(convergence_rates(robot, q).values()) >= 0.0
    assert convergence_rates(robot, q, W=W)["j2"] < -0.5


def test_singular_configuration_and_wrong_weights_are_refused() -> None:
    robot = links(1, 1, 1)
    with pytest.raises(InputError, match="is singular at q"):
        convergence_rates(robot, np.zeros(3))
    with pytest.raises(InputError, match="expected a positive definite matrix"):
        convergence_rates(robot, robot.neutral, W=np.diag([1.0, -1.0, 1.0]))
