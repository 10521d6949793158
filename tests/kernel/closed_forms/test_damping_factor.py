"""The rules of kappa keep the limit, are ordered, and the exact ones are exact."""

import numpy as np
import pytest
from reduced_problems import RULES, kappa_of, problem, solved

from ftqp.kernel.layout import enums


def rates(J, xdot, kappa):
    """V diag(sigma/(sigma^2 + kappa)) c."""
    U, s, Vt = np.linalg.svd(J, full_matrices=False)
    return Vt.T @ (s / (s * s + kappa) * (U.T @ xdot))


def random_case(rng):
    """A Jacobian with singular values over four decades, a task and a limit that the undamped rates break."""
    n, m = int(rng.integers(1, 12)), int(rng.integers(1, 7))
    r = min(n, m)
    U = np.linalg.qr(rng.normal(size=(m, r)))[0]
    V = np.linalg.qr(rng.normal(size=(n, r)))[0]
    J = U @ np.diag(10.0 ** rng.uniform(-3.0, 1.0, r)) @ V.T
    xdot = rng.normal(size=m)
    return J, xdot, float(np.abs(np.linalg.pinv(J) @ xdot).max() * 10.0 ** rng.uniform(-3.0, -0.01))


def test_random_cases_keep_the_limit_and_the_order_of_the_rules():
    rng = np.random.default_rng(2)
    for _ in range(2_000):
        J, xdot, limit = random_case(rng)
        P = problem(J, xdot)
        kappa = {}
        for rule in RULES:
            x, kappa[rule] = solved(P, enums.DAMPED, rule, limit)
            assert np.abs(x).max() <= limit * (1.0 + 1e-9)
        near = 1.0 + 1e-9
        assert kappa["exact_inf"] <= kappa["row"] * near
        assert kappa["row"] <= kappa["tight"] * near and kappa["tight"] <= kappa["bound"] * near
        assert kappa["exact_inf"] <= kappa["exact_2"] * near and kappa["exact_2"] <= kappa["bound_2"] * near


def test_the_exact_roots_meet_their_limits_and_the_row_rule_its_equation():
    rng = np.random.default_rng(3)
    for _ in range(500):
        J, xdot, limit = random_case(rng)
        P = problem(J, xdot)
        assert np.abs(rates(J, xdot, kappa_of(P, "exact_inf", limit))).max() == pytest.approx(limit, rel=1e-9)
        assert np.linalg.norm(rates(J, xdot, kappa_of(P, "exact_2", limit))) == pytest.approx(
            limit, rel=1e-10
        )
        U, s, Vt = np.linalg.svd(J, full_matrices=False)
        kappa = kappa_of(P, "row", limit)
        sums = np.abs(Vt.T * (U.T @ xdot)) @ (s / (s * s + kappa))
        assert sums.max() == pytest.approx(limit, rel=1e-9)


def first_root(J, xdot, limit):
    """The smallest kappa with max |x| <= limit, from the roots of all polynomials V_i(...) = +-limit."""
    U, s, Vt = np.linalg.svd(J, full_matrices=False)
    a = Vt.T * (U.T @ xdot) * s
    poles = np.poly1d([1.0])
    for pole in s * s:
        poles *= np.poly1d([1.0, pole])
    candidates = []
    for row in a:
        numerator = np.poly1d([0.0])
        for k, part in enumerate(row):
            others = np.poly1d([part])
            for j, pole in enumerate(s * s):
                if j != k:
                    others *= np.poly1d([1.0, pole])
            numerator += others
        for sign in (-1.0, 1.0):
            roots = (numerator - sign * limit * poles).roots
            candidates += [z.real for z in roots if abs(z.imag) < 1e-7 * abs(z) and z.real > 0.0]
    inside = [k for k in sorted(candidates) if np.abs(rates(J, xdot, k)).max() <= limit * (1.0 + 1e-7)]
    return inside[0]


def test_exact_inf_is_the_smallest_root_of_all():
    """Including cases in which the largest rate rises with kappa after a first root."""
    rng = np.random.default_rng(4)
    several = 0
    for _ in range(200):
        n, m = int(rng.integers(2, 9)), int(rng.integers(2, 5))
        J = rng.normal(size=(m, n)) * 10.0 ** rng.uniform(-1.0, 1.0, (m, 1))
        xdot = rng.normal(size=m)
        grid = np.geomspace(1e-4, 1e2, 200)
        largest = np.array([np.abs(rates(J, xdot, k)).max() for k in grid])
        rising = np.flatnonzero(np.diff(largest) > 0.0)
        limit = 0.7 * np.abs(np.linalg.pinv(J) @ xdot).max()
        if len(rising):
            limit = float(largest[rising[0]] * 1.0001)  # just above a local minimum: two more roots follow
            several += 1
        if limit >= np.abs(np.linalg.pinv(J) @ xdot).max():
            continue
        found = kappa_of(problem(J, xdot), "exact_inf", limit)
        assert found == pytest.approx(first_root(J, xdot, limit), rel=1e-5)
    assert several >= 5


def test_undamped_rates_inside_the_limit_are_not_damped():
    rng = np.random.default_rng(6)
    J, xdot = rng.normal(size=(6, 8)), rng.normal(size=6)
    undamped = np.linalg.pinv(J) @ xdot
    for rule in RULES:
        x, kappa = solved(problem(J, xdot), enums.DAMPED, rule, 10.0 * np.linalg.norm(undamped))
        assert kappa == 0.0 and np.abs(x - undamped).max() < 1e-12


def test_bound_uses_the_thin_v_of_the_reduced_jacobian():
    J = np.sqrt(0.125) * np.array([[1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 1.0]])
    P = problem(J, [1.0, 1.0], (1, 3))
    x, kappa = solved(P, enums.DAMPED, "bound", 1.0)
    assert kappa == pytest.approx(0.25, rel=1e-12)
    assert x == pytest.approx([0.942809, 0.0, 0.942809, 0.0], abs=1e-6)
    wrong = kappa_of(problem(J, [1.0, 1.0]), "bound", 1.0)  # of the full J: 41 % over the limit
    assert wrong == pytest.approx(0.125, rel=1e-12)
    assert rates(J[:, [0, 2]], np.ones(2), wrong) == pytest.approx([np.sqrt(2.0)] * 2, rel=1e-12)


rng = np.random.default_rng(1)


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


def test_no_joint_left_and_a_task_of_rank_zero_give_the_prescribed_rates_and_zeros():
    J, xdot = rng.normal(size=(6, 3)), rng.normal(size=6)
    for method in (enums.PSEUDOINVERSE, enums.DAMPED):
        x, kappa = solved(problem(J, xdot, (0, 1, 2), (0.1, 0.2, 0.3)), method, "row", 1.0)
        assert np.array_equal(x, [0.1, 0.2, 0.3]) and kappa == 0.0
        x, kappa = solved(problem(0.0 * J, xdot), method, "row", 1.0)
        assert not x.any() and kappa == 0.0
