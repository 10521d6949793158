"""The extreme eigenvalues that the scaling rule needs."""

import numpy as np
import pytest

from ftqp.kernel.maths.eigenvalues import extreme_eigenvalues, gram


def extremes(S):
    n = len(S)
    return extreme_eigenvalues(S.copy(), n, np.zeros(n), np.zeros(n))


@pytest.mark.parametrize("n", [1, 2, 3, 7, 13, 33])
def test_extreme_eigenvalues_of_random_matrices(n):
    rng = np.random.default_rng(n)
    for _ in range(20):
        B = rng.normal(size=(n, n))
        S = B + B.T
        values = np.linalg.eigvalsh(S)
        np.testing.assert_allclose(extremes(S), values[[0, -1]], rtol=0, atol=1e-12 * np.abs(values).max())


@pytest.mark.parametrize("condition", [1e2, 1e6, 1e9])
def test_a_small_eigenvalue_is_found_beside_a_large_one(condition):
    rng = np.random.default_rng(1)
    for n in (2, 6, 9):
        Q, _ = np.linalg.qr(rng.normal(size=(n, n)))
        S = (Q * np.logspace(0.0, -np.log10(condition), n)) @ Q.T
        least, largest = extremes(0.5 * (S + S.T))
        assert largest == pytest.approx(1.0, abs=1e-12)
        assert least == pytest.approx(1.0 / condition, abs=1e-14)


def test_matrices_that_are_diagonal_already():
    np.testing.assert_allclose(extremes(np.eye(5)), [1.0, 1.0], atol=1e-14)
    np.testing.assert_allclose(extremes(np.diag([3.0, -2.0, 7.0, 0.0])), [-2.0, 7.0], atol=1e-13)
    np.testing.assert_array_equal(extremes(np.zeros((3, 3))), [0.0, 0.0])


def test_only_the_lower_part_is_read():
    S = np.random.default_rng(2).normal(size=(6, 6))
    S = S + S.T
    expected = extremes(S)
    S[np.triu_indices(6, 1)] = np.nan
    assert extremes(S) == expected


@pytest.mark.parametrize(("m", "n"), [(2, 6), (6, 2), (1, 1), (5, 5), (0, 4)])
def test_gram_matrix_of_the_smaller_side_has_the_squares_of_the_singular_values(m, n):
    A, S = np.random.default_rng(3).normal(size=(m, n)), np.zeros((max(m, n), max(m, n)))
    size = gram(A, m, n, S)
    assert size == min(m, n)
    if size:
        expected = np.linalg.svd(A, compute_uv=False)[[0, -1]] ** 2
        least, largest = extreme_eigenvalues(S, size, np.zeros(size), np.zeros(size))
        np.testing.assert_allclose([largest, least], expected, rtol=1e-10, atol=1e-13)
