"""LU factorisation with partial pivoting."""

import numpy as np
import pytest

from ftqp.kernel.maths.lu import lu_factor, lu_solve


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


def test_a_zero_on_the_diagonal_needs_a_pivot():
    S, b, pivots = np.array([[0.0, 1.0], [1.0, 0.0]]), np.array([2.0, 3.0]), np.zeros(2)
    assert lu_factor(S, 2, pivots)
    lu_solve(S, 2, pivots, b)
    assert b.tolist() == [3.0, 2.0]


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
