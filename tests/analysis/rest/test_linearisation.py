"""The linearisation against central differences, and its eigenvalues at the goal."""

import numpy as np
import pytest
from planar_arms import links

from ftqp.analysis.goals import goal_study
from ftqp.analysis.rest.linearisation import convergence_rates, reduced_jacobians, rest_test, weighted_inverse
from ftqp.analysis.rest.rest_curves import rest_configurations
from ftqp.analysis.rest.rest_tracing import RestEquations
from ftqp.core.checks import FloatArray
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


@pytest.mark.parametrize("name", ["planar", "panda"])
def test_derivative_is_that_of_central_differences(name: str) -> None:
    robot = links(1, 1, 1, 1) if name == "planar" else catalog.load("panda")
    rng = np.random.default_rng(1)
    study = goal_study(robot, robot.pose(robot.neutral), "pose")
    B = rng.normal(size=(robot.nv, robot.nv))
    equations = RestEquations(study, B @ B.T + np.eye(robot.nv), 2)
    z = equations.started(robot.neutral + rng.uniform(-0.3, 0.3, (1, robot.nv)))
    z = z + rng.normal(scale=0.1, size=z.shape)
    d = equations.values(z)[1][0]
    step = 1e-6
    pairs = [
        (equations.values(z + step * h)[0], equations.values(z - step * h)[0]) for h in np.eye(equations.size)
    ]
    rates = np.column_stack([(up - down)[0] / (2.0 * step) for up, down in pairs])
    assert d == pytest.approx(rates, abs=1e-8)


def test_one_lock_rests_just_where_error_and_rank_say_so() -> None:
    robot = links(1, 0.8, 0.6)
    rng = np.random.default_rng(4)
    for _ in range(20):
        B = rng.normal(size=(3, 3))
        W = B @ B.T + 0.3 * np.eye(3)
        goal = rng.uniform(-1.5, 1.5, 2)
        joint = int(rng.integers(3))
        for rest in rest_configurations(robot, goal, joint, float(rng.uniform(-3.0, 3.0)), W):
            found = rest_test(robot, rest.q, [joint], goal, W)
            assert found.passes()
            assert max(found.collinear, found.rank) < 1e-8
        found = rest_test(robot, rng.uniform(-3.0, 3.0, 3), [joint], goal, W)
        assert not found.passes()
        assert max(found.collinear, found.rank) > 1e-6


def test_several_locks_need_more_than_a_loss_of_rank() -> None:
    robot = links(1, 1, 1, 1)
    q = np.array([0.3, 0.5, 0.7, 0.0])
    x = robot.pose(q)[:2, 3]
    J = robot.jacobian(q)[:2]
    healthy = J[:, 2:]
    assert np.linalg.matrix_rank(healthy, tol=1e-9) == 1  # joints 3 and 4 in line with the tip
    left = np.linalg.svd(healthy)[0][:, 1]  # no healthy joint moves the tip along it
    resting = rest_test(robot, q, ["j1", "j2"], x + J[:, :2] @ (J[:, :2].T @ left))
    assert resting.rest < 1e-12
    other = rest_test(robot, q, ["j1", "j2"], x + 0.3 * J[:, 0])
    assert other.rank < 1e-12
    assert other.collinear < 1e-12
    assert other.rest > 1e-2
