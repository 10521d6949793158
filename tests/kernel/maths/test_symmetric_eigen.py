"""The extreme eigenvalues that the scaling rule needs."""

import numpy as np
import pytest

from ftqp.kernel.maths.symmetric_eigen import eigensystem, extreme_eigenvalues, gram


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


@pytest.mark.parametrize(("m", "n"), [(2, 6), (6, 2), (1, 1), (5, 5), (0, 4)])
def test_gram_matrix_of_the_smaller_side_has_the_squares_of_the_singular_values(m, n):
    A, S = np.random.default_rng(3).normal(size=(m, n)), np.zeros((max(m, n), max(m, n)))
    size = gram(A, m, n, S)
    assert size == min(m, n)
    if size:
        expected = np.linalg.svd(A, compute_uv=False)[[0, -1]] ** 2
        least, largest = extreme_eigenvalues(S, size, np.zeros(size), np.zeros(size))
        np.testing.assert_allclose([largest, least], expected, rtol=1e-10, atol=1e-13)


def system(S):
    n = len(S)
    d, e, Z = np.zeros(n), np.zeros(n), np.zeros((n, n))
    eigensystem(S.copy(), n, d, e, Z)
    return d, Z


@pytest.mark.parametrize("n", [1, 2, 3, 7, 13, 32])
def test_rows_are_orthonormal_eigenvectors(n):
    rng = np.random.default_rng(n)
    for _ in range(10):
        B = rng.normal(size=(n, n))
        S = B + B.T
        d, Z = system(S)
        np.testing.assert_allclose(Z @ Z.T, np.eye(n), atol=1e-13)
        np.testing.assert_allclose(Z.T @ (d[:, None] * Z), S, atol=1e-13 * n)
        np.testing.assert_allclose(np.sort(d), np.linalg.eigvalsh(S), atol=1e-13 * n)


@pytest.mark.parametrize("S", [np.eye(5), np.diag([3.0, -2.0, 7.0, 0.0]), np.zeros((3, 3)), np.ones((6, 6))])
def test_diagonal_and_repeated_eigenvalues(S):
    d, Z = system(S)
    np.testing.assert_allclose(Z @ Z.T, np.eye(len(S)), atol=1e-14)
    np.testing.assert_allclose(Z.T @ (d[:, None] * Z), S, atol=1e-13)
