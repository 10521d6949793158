"""One-sided Jacobi against numpy, also where singular values vanish."""

import numpy as np
import pytest

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.singular_directions import singular_directions


@jit
def run(W, m, n, U, sigma):
    singular_directions(W, m, n, U, sigma)


def decomposed(A):
    m, n = A.shape
    W, U, sigma = A.copy(), np.zeros((6, 6)), np.zeros(6)
    run(W, m, n, U, sigma)
    return W, U[:m, :m], sigma[:m]


@pytest.mark.parametrize("shape", [(6, 11), (6, 7), (6, 6), (6, 3), (3, 5), (1, 4), (2, 1)])
@pytest.mark.parametrize("seed", range(5))
def test_rows_are_turned_into_orthogonal_ones_and_values_are_numpys(shape, seed):
    A = np.random.default_rng(seed).normal(size=shape)
    W, U, sigma = decomposed(A)
    np.testing.assert_allclose(U @ U.T, np.eye(shape[0]), atol=1e-13)
    np.testing.assert_allclose(U @ W, A, atol=1e-13)
    np.testing.assert_allclose(W @ W.T, np.diag(sigma**2), atol=1e-12)
    expected = np.zeros(shape[0])
    expected[: min(shape)] = np.linalg.svd(A, compute_uv=False)
    np.testing.assert_allclose(sigma, expected, atol=1e-13)


def test_small_singular_values_keep_their_relative_accuracy():
    A = np.diag([1.0, 1e-5, 1e-10, 1e-15]) @ np.random.default_rng(0).normal(size=(4, 9))
    exact = np.linalg.qr(np.random.default_rng(1).normal(size=(9, 4)))[0].T
    _, _, sigma = decomposed(np.diag([1.0, 1e-5, 1e-10, 1e-15]) @ exact)
    np.testing.assert_allclose(sigma, [1.0, 1e-5, 1e-10, 1e-15], rtol=1e-12)
    assert decomposed(A)[2][-1] < 1e-13


@pytest.mark.parametrize(
    "A", [np.zeros((6, 7)), np.ones((6, 7)), 1e-200 * np.ones((3, 4)), 1e150 * np.eye(3)]
)
def test_matrices_without_full_rank_or_of_any_size_stay_finite(A):
    W, U, sigma = decomposed(A)
    assert np.isfinite(W).all() and np.isfinite(U).all() and np.isfinite(sigma).all()
    np.testing.assert_allclose(U @ U.T, np.eye(len(A)), atol=1e-13)
