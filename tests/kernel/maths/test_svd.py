"""Singular values, eigenvalues and equations against numpy and scipy, and motions of limited jerk."""

from math import inf

import numpy as np
import pytest
import ruckig
from reduced_problems import decomposed
from scipy.linalg import solve_continuous_are

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.jerk_limited import PARTS, between, brake, duration_of, fastest, slower, state_after
from ftqp.kernel.maths.linear_systems import begin_doubling, double, lu_factor, lu_solve
from ftqp.kernel.maths.svd import singular_directions
from ftqp.kernel.maths.symmetric_eigen import eigensystem, extreme_eigenvalues, gram

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


def drawn(rng):
    """A way, a speed, an acceleration, and their limits."""
    v_max, a_max, jerk = rng.uniform(0.2, 3.0), rng.uniform(1.0, 15.0), rng.uniform(20.0, 500.0)
    v, a = rng.uniform(-1.0, 1.0, 2) * (v_max, a_max) * rng.integers(0, 2, 2)
    return rng.uniform(-3.0, 3.0) * rng.choice([0.01, 0.1, 1.0]), v, a, v_max, a_max, jerk


def parts():
    return np.zeros(PARTS), np.zeros(PARTS)


def by_ruckig(way, v, a, v_max, a_max, jerk):
    given, found = ruckig.InputParameter(1), ruckig.Trajectory(1)
    given.current_position, given.current_velocity, given.current_acceleration = [0.0], [v], [a]
    given.target_position, given.max_velocity = [way], [v_max]
    given.max_acceleration, given.max_jerk = [a_max], [jerk]
    ruckig.Ruckig(1).calculate(given, found)
    return found.duration


@pytest.mark.parametrize("seed", range(100))
def test_the_fastest_motion_ends_at_rest_at_its_place_and_keeps_every_limit(seed):
    way, v, a, v_max, a_max, jerk = drawn(np.random.default_rng(seed))
    times, jerks = parts()
    fastest(times, jerks, way, v, a, v_max, a_max, jerk)
    T = duration_of(times)
    np.testing.assert_allclose(state_after(times, jerks, T, v, a), (way, 0.0, 0.0), atol=1e-9)
    stays = abs(v + 0.5 * a * abs(a) / jerk) <= v_max  # else it is too fast before it can be slower
    for t in np.linspace(0.0, T, 50):
        _, now, pull = state_after(times, jerks, t, v, a)
        assert abs(pull) <= a_max * (1.0 + 1e-9)
        assert not stays or abs(now) <= v_max * (1.0 + 1e-9)


def test_of_a_hundred_motions_ninety_eight_are_as_fast_as_those_of_ruckig_and_none_much_slower():
    later = []
    for seed in range(500):
        way, v, a, v_max, a_max, jerk = drawn(np.random.default_rng(seed))
        times, jerks = parts()
        fastest(times, jerks, way, v, a, v_max, a_max, jerk)
        if abs(v + 0.5 * a * abs(a) / jerk) <= v_max:
            later.append(duration_of(times) - by_ruckig(way, v, a, v_max, a_max, jerk))
    assert min(later) > -1e-6 and np.quantile(later, 0.98) < 1e-6 and max(later) < 0.1


@pytest.mark.parametrize("seed", range(100))
def test_a_motion_that_takes_longer_arrives_at_the_time_that_is_asked_for(seed):
    rng = np.random.default_rng(seed)
    way, v, a, *limits = drawn(rng)
    times, jerks = parts()
    w = fastest(times, jerks, way, v, a, *limits)
    T = duration_of(times) * rng.uniform(1.0, 3.0)
    slower(times, jerks, way, v, a, w, *limits[1:], T)
    assert duration_of(times) == pytest.approx(T, abs=1e-9)
    np.testing.assert_allclose(state_after(times, jerks, T, v, a), (way, 0.0, 0.0), atol=1e-8)


def test_a_motion_between_two_states_takes_the_time_that_is_asked_for_and_keeps_every_limit():
    done = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        way, v, a, v_max, a_max, jerk = drawn(rng)
        v_end, a_end, T = (
            0.9 * v_max * rng.uniform(-1.0, 1.0),
            a_max * rng.uniform(-1.0, 1.0),
            rng.uniform(0.1, 4.0),
        )
        times, jerks = parts()
        if not between(times, jerks, way, v, a, v_end, a_end, v_max, a_max, jerk, T):
            continue
        done += 1
        assert duration_of(times) == pytest.approx(T, abs=1e-9) and times.min() >= 0.0
        np.testing.assert_allclose(state_after(times, jerks, T, v, a), (way, v_end, a_end), atol=1e-8)
        pulls = [state_after(times, jerks, t, v, a)[2] for t in np.linspace(0.0, T, 50)]
        assert np.abs(pulls).max() <= a_max * (1.0 + 1e-9) and np.abs(jerks).max() <= jerk
    assert done > 80


def test_a_state_beyond_the_limits_is_brought_within_them_first():
    times, jerks = parts()
    way = brake(times, jerks, 2.0, 12.0, 5.0, 100.0)
    pulls = [state_after(times, jerks, t, 2.0, 12.0)[2] for t in np.linspace(0.0, duration_of(times), 200)]
    assert pulls[0] == 12.0 and min(pulls) >= -5.0 * (1.0 + 1e-9) and np.diff(pulls).max() <= 1.0
    assert state_after(times, jerks, 9.0, 2.0, 12.0) == pytest.approx((way, 0.0, 0.0), abs=1e-12)
