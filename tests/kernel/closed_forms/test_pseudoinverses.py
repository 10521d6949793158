"""Pseudoinverse and damped inverse of the reduced Jacobian agree with their definitions."""

import numpy as np
import pytest
from reduced_problems import problem, solved

from ftqp.kernel.layout import enums as codes

rng = np.random.default_rng(1)


def reduced(J, locked):
    return J[:, [i for i in range(J.shape[1]) if i not in locked]]


def full(x, n, locked, rates=None):
    result = np.zeros(n)
    result[[i for i in range(n) if i not in locked]] = x
    if rates is not None:
        result[list(locked)] = rates
    return result


@pytest.mark.parametrize("locked", [(), (2,), (0, 5, 6), (0, 1, 2, 3, 4, 5), tuple(range(10))])
def test_pseudoinverse_is_numpys_on_the_free_columns(locked):
    for _ in range(30):
        J, xdot = rng.normal(size=(6, 11)), rng.normal(size=6)
        x, kappa = solved(problem(J, xdot, locked))
        expected = full(np.linalg.pinv(reduced(J, locked)) @ xdot, 11, locked)
        assert np.abs(x - expected).max() < 1e-10 * (1.0 + np.abs(expected).max())
        assert kappa == 0.0 and not x[list(locked)].any()


def test_pseudoinverse_near_and_at_singularity_is_the_truncated_one():
    for smallest in (1e-2, 1e-4, 1e-6, 1e-9, 1e-11, 1e-14, 0.0):
        U = np.linalg.qr(rng.normal(size=(6, 6)))[0]
        V = np.linalg.qr(rng.normal(size=(8, 6)))[0]
        sigma = np.array([3.0, 2.0, 1.0, 0.5, 0.1, smallest])
        y = rng.normal(size=6)
        xdot = U @ (sigma * y)
        x, _ = solved(problem(U @ np.diag(sigma) @ V.T, xdot))
        kept = sigma > 1e-12 * sigma[0]
        assert np.abs(V[:, kept].T @ x - y[kept]).max() < 1e-15 / max(smallest, 3e-12) + 1e-10
        assert np.abs(x - V @ (V.T @ x)).max() < 1e-14 / max(smallest, 3e-12) + 1e-10


def test_failed_joints_that_move_are_taken_off_the_task_and_keep_their_rates():
    for _ in range(20):
        J, xdot, rates = rng.normal(size=(6, 11)), rng.normal(size=6), rng.normal(size=2)
        x, _ = solved(problem(J, xdot, (3, 8), rates))
        assert np.array_equal(x[[3, 8]], rates)
        assert np.abs(J @ x - xdot).max() < 1e-11
        expected = np.linalg.pinv(reduced(J, (3, 8))) @ (xdot - J[:, [3, 8]] @ rates)
        assert np.abs(reduced(x[None], (3, 8))[0] - expected).max() < 1e-11


def test_weights_make_the_weighted_norm_least():
    J, xdot = rng.normal(size=(6, 9)), rng.normal(size=6)
    weights = rng.uniform(0.1, 10.0, 9)
    P = problem(J, xdot)
    P.P.column[:9] = 1.0 / np.sqrt(weights)
    x, _ = solved(P)
    assert np.abs(J @ x - xdot).max() < 1e-12
    assert np.abs(np.linalg.svd(J)[2][6:] @ (weights * x)).max() < 1e-12  # W x has no part in the null space


def test_damped_inverse_solves_the_regularised_normal_equations():
    for _ in range(20):
        J, xdot = rng.normal(size=(6, 9)), rng.normal(size=6)
        x, kappa = solved(problem(J, xdot, (4,)), codes.DAMPED, "bound", 0.05)
        F = reduced(J, (4,))
        assert kappa > 0.0
        expected = np.linalg.solve(F.T @ F + kappa * np.eye(8), F.T @ xdot)
        assert np.abs(reduced(x[None], (4,))[0] - expected).max() < 1e-12


def test_no_joint_left_and_a_task_of_rank_zero_give_the_prescribed_rates_and_zeros():
    J, xdot = rng.normal(size=(6, 3)), rng.normal(size=6)
    for method in (codes.PSEUDOINVERSE, codes.DAMPED):
        x, kappa = solved(problem(J, xdot, (0, 1, 2), (0.1, 0.2, 0.3)), method, "row", 1.0)
        assert np.array_equal(x, [0.1, 0.2, 0.3]) and kappa == 0.0
        x, kappa = solved(problem(0.0 * J, xdot), method, "row", 1.0)
        assert not x.any() and kappa == 0.0
