"""All eigenvalues and eigenvectors against those of numpy."""

import numpy as np
import pytest

from ftqp.kernel.maths.symmetric_eigen import eigensystem


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


def test_opposite_eigenvalues_are_told_apart():
    Q, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(4, 4)))
    d, _ = system((Q * [2.0, -2.0, 1.0, -1.0]) @ Q.T)
    np.testing.assert_allclose(np.sort(d), [-2.0, -1.0, 1.0, 2.0], atol=1e-13)


def test_only_the_lower_part_is_read():
    S = np.random.default_rng(2).normal(size=(6, 6))
    S = S + S.T
    expected, _ = system(S)
    S[np.triu_indices(6, 1)] = np.nan
    np.testing.assert_array_equal(system(S)[0], expected)
