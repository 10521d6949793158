"""LU factorisation with partial pivoting."""

from math import inf

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from ftqp.kernel.maths.linear_systems import begin_doubling, double, lu_factor, lu_solve


@pytest.mark.parametrize("n", [1, 2, 5, 13, 30])
def test_factors_solve_a_system(n):
    rng = np.random.default_rng(n)
    for _ in range(20):
        S, x = rng.normal(size=(n + 2, n + 2)), rng.normal(size=n)
        b, pivots = S[:n, :n] @ x, np.zeros(n)
        margin = np.linalg.cond(S[:n, :n])
        assert lu_factor(S, n, pivots)
        lu_solve(S, n, pivots, b)
        np.testing.assert_allclose(b, x, rtol=0, atol=1e-13 * margin)


def test_a_consistent_singular_system_is_solved_by_leaving_an_equation_out():
    rng = np.random.default_rng(1)
    for _ in range(20):
        B = rng.normal(size=(6, 4))
        S, pivots = B @ B.T, np.zeros(6)
        b = S @ rng.normal(size=6)
        x, factors = b.copy(), S.copy()
        assert not lu_factor(factors, 6, pivots)
        lu_solve(factors, 6, pivots, x)
        np.testing.assert_allclose(S @ x, b, rtol=0, atol=1e-9)
        assert np.count_nonzero(x) == 4


def solved(A, G, H, rate):
    n = len(A)
    A, G, H = A.copy(), G.copy(), H.copy()
    W, S, T = (np.zeros((n, n)) for _ in range(3))
    pivots, column = np.zeros(n, np.int64), np.zeros(n)
    assert begin_doubling(A, G, H, W, S, T, n, rate, pivots, column)
    changes = [inf]
    while len(changes) < 30 and (len(changes) == 1 or 1e-10 <= changes[-1] < inf):
        changes.append(double(A, G, H, W, S, T, n, pivots, column))
    return H, len(changes) - 1, changes[-1]


@pytest.mark.parametrize("rate", [2.0, 6.0, 20.0])
@pytest.mark.parametrize("n", [2, 7, 14])
def test_solution_is_that_of_scipy(n, rate):
    rng = np.random.default_rng(n)
    for _ in range(3):
        A, B = rng.normal(size=(n, n)), rng.normal(size=(n, max(1, n // 2)))
        Q = np.diag(rng.uniform(0.1, 5.0, n))
        P, iterations, _ = solved(A, B @ B.T, Q, rate)
        expected = solve_continuous_are(A, B, Q, np.eye(B.shape[1]))
        assert np.abs(P - expected).max() < 1e-10 * np.abs(expected).max()
        assert iterations < 12


def test_an_arm_that_cannot_be_stabilised_gives_no_solution():
    A, G, H = np.diag([1.0, -1.0]), np.diag([0.0, 1.0]), np.eye(2)  # nothing acts on the unstable part
    P, _, change = solved(A, G, H, 6.0)
    assert change == inf or np.abs(P).max() > 1e6
