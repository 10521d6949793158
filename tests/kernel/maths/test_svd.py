"""The Jacobi SVD agrees with LAPACK, keeps its vectors orthogonal and its small singular values accurate."""

import numpy as np
import pytest
from reduced_problems import decomposed

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.svd import singular_directions

rng = np.random.default_rng(0)


def triplets(J, xdot=None):
    """sigma (r,), V (f, r), c (r,) and the rank."""
    P = decomposed(J, xdot)
    r, f = int(P.r), J.shape[1]
    return P.sigma[:r].copy(), P.V[:r, :f].T.copy(), P.c[:r].copy(), int(P.rank)


@pytest.mark.parametrize(
    "shape", [(6, 7), (6, 6), (6, 4), (6, 1), (3, 8), (1, 5), (2, 6), (6, 32), (5, 5), (3, 1)]
)
def test_singular_values_vectors_and_right_side_agree_with_numpy(shape):
    for _ in range(30):
        J, xdot = rng.normal(size=shape), rng.normal(size=shape[0])
        s, V, c, rank = triplets(J, xdot)
        U, expected, _ = np.linalg.svd(J, full_matrices=False)
        assert rank == min(shape)
        assert np.abs(s - expected).max() < 1e-13 * expected[0]
        assert np.abs(V.T @ V - np.eye(len(s))).max() < 1e-13
        assert np.abs((J @ V) - (J @ V / s) * s).max() < 1e-13
        mine = J @ V / s  # U
        assert np.abs(mine.T @ mine - np.eye(len(s))).max() < 1e-12
        assert np.abs(np.abs(c) - np.abs(U.T @ xdot)).max() < 1e-11
        assert np.abs(mine.T @ xdot - c).max() < 1e-11


@pytest.mark.parametrize("smallest", [1e-3, 1e-7, 1e-11])
@pytest.mark.parametrize("shape", [(6, 9), (6, 5)])
def test_small_singular_values_are_accurate_to_rounding_of_the_largest(shape, smallest):
    r = min(shape)
    for _ in range(20):
        U = np.linalg.qr(rng.normal(size=(shape[0], r)))[0]
        V = np.linalg.qr(rng.normal(size=(shape[1], r)))[0]
        sigma = np.geomspace(1.0, smallest, r)
        s, *_ = triplets(U @ np.diag(sigma) @ V.T)
        assert np.abs(s - sigma).max() < 5e-15


def test_rows_of_very_different_size_keep_relative_accuracy():
    """Row scaling explains the condition, so the smallest value has all its digits; LAPACK's has not."""
    for _ in range(20):
        J = np.diag([1.0, 1e-3, 1e-6, 1e-9, 1e-12, 1e-15]) @ np.linalg.qr(rng.normal(size=(9, 6)))[0].T
        s, *_ = triplets(J)
        assert np.abs(s / [1.0, 1e-3, 1e-6, 1e-9, 1e-12, 1e-15] - 1.0).max() < 1e-10


def test_equal_and_zero_singular_values_are_found():
    s, V, _, rank = triplets(np.eye(6, 8))
    assert np.array_equal(s, np.ones(6)) and rank == 6
    s, V, _, rank = triplets(np.zeros((6, 7)), np.ones(6))
    assert rank == 0 and not s.any() and np.isfinite(V).all()
    J = rng.normal(size=(6, 2)) @ rng.normal(size=(2, 7))
    s, *_, rank = triplets(J)
    assert rank == 2 and s[2] < 1e-14 * s[0]


@jit
def run(W, m, n, U, sigma):
    singular_directions(W, m, n, U, sigma)


def directions(A):
    m, n = A.shape
    W, U, sigma = A.copy(), np.zeros((6, 6)), np.zeros(6)
    run(W, m, n, U, sigma)
    return W, U[:m, :m], sigma[:m]


@pytest.mark.parametrize("shape", [(6, 11), (6, 7), (6, 6), (6, 3), (3, 5), (1, 4), (2, 1)])
@pytest.mark.parametrize("seed", range(5))
def test_rows_are_turned_into_orthogonal_ones_and_values_are_numpys(shape, seed):
    A = np.random.default_rng(seed).normal(size=shape)
    W, U, sigma = directions(A)
    np.testing.assert_allclose(U @ U.T, np.eye(shape[0]), atol=1e-13)
    np.testing.assert_allclose(U @ W, A, atol=1e-13)
    np.testing.assert_allclose(W @ W.T, np.diag(sigma**2), atol=1e-12)
    expected = np.zeros(shape[0])
    expected[: min(shape)] = np.linalg.svd(A, compute_uv=False)
    np.testing.assert_allclose(sigma, expected, atol=1e-13)


@pytest.mark.parametrize(
    "A", [np.zeros((6, 7)), np.ones((6, 7)), 1e-200 * np.ones((3, 4)), 1e150 * np.eye(3)]
)
def test_matrices_without_full_rank_or_of_any_size_stay_finite(A):
    W, U, sigma = directions(A)
    assert np.isfinite(W).all() and np.isfinite(U).all() and np.isfinite(sigma).all()
    np.testing.assert_allclose(U @ U.T, np.eye(len(A)), atol=1e-13)
