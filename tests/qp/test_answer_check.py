"""The judge: its four numbers by an independent formula, and what it lets pass."""

import numpy as np
import pytest
from planted import buffers, contradicting_qp, infeasible, planted

from ftqp.qp import QP
from ftqp.qp.solving import accepted, infeasibility, residuals


def answer(case):
    return [part.copy() for part in (case.x, case.y, case.z, case.z_box)]


def by_numpy(q, x, y, z, z_box):
    cx = q.C @ x
    values, lows, highs = np.concatenate([x, cx]), np.concatenate([q.lb, q.l]), np.concatenate([q.ub, q.u])
    mu = np.concatenate([z_box, z])
    primal = max(
        np.abs(q.A @ x - q.b).max(initial=0), np.maximum(lows - values, values - highs).max(initial=0)
    )
    dual = np.abs(q.H @ x + q.g + q.A.T @ y + q.C.T @ z + z_box).max()
    above, below = np.maximum(mu, 0), np.maximum(-mu, 0)
    comp = np.maximum(np.minimum(above, abs(highs - values)), np.minimum(below, abs(values - lows))).max()
    bound = np.where(mu > 0, highs, lows)
    used = np.isfinite(bound)
    gap = abs(x @ q.H @ x + q.g @ x + q.b @ y + mu[used] @ bound[used])
    return primal, dual, comp, gap


def test_residuals_are_zero_at_a_planted_solution():
    for seed in range(20):
        case = planted(np.random.default_rng(seed), 9, 3, 6, fixed=1, equal_rows=1)
        found = residuals(case.problem, *answer(case))
        assert found.largest <= 1e-12
        assert accepted(case.problem, found, case.x, case.y)


def test_residuals_equal_their_definition_away_from_the_solution():
    rng = np.random.default_rng(0)
    for _ in range(20):
        case = planted(rng, 6, 2, 4)
        point = [part + rng.normal(size=part.shape) for part in answer(case)]
        found = residuals(case.problem, *point)
        expected = by_numpy(case.problem, *point)
        np.testing.assert_allclose(
            (found.primal, found.dual, found.complementarity, found.gap), expected, rtol=1e-12, atol=1e-12
        )
        assert not accepted(case.problem, found, point[0], point[1])


@pytest.mark.parametrize("name", ["H", "g", "A", "b", "C", "l", "u", "lb", "ub"])
def test_nan_in_the_data_is_an_infinite_residual(name):
    case = planted(np.random.default_rng(1), 6, 2, 4, unbounded=0.0)
    qp = buffers(case.problem)
    getattr(qp, name).reshape(-1)[0] = np.nan
    assert residuals(qp, *answer(case)).largest == np.inf


def test_a_multiplier_of_the_wrong_sign_is_seen():
    qp = QP(np.eye(1), [-1.0], ub=[0.5], lb=[-5.0])
    good = residuals(qp, np.array([0.5]), np.zeros(0), np.zeros(0), np.array([0.5]))
    assert good.largest == 0.0
    wrong = residuals(qp, np.array([0.5]), np.zeros(0), np.zeros(0), np.array([-0.5]))
    assert wrong.dual == 1.0
    assert wrong.complementarity == 0.5
    assert not accepted(qp, wrong, np.array([0.5]), np.zeros(0))


def test_acceptance_is_relative_to_the_size_of_the_data():
    case = planted(np.random.default_rng(2), 6, 2, 4)
    p = case.problem
    point = answer(case)
    point[0] = point[0] + 1e-4
    assert not accepted(p, residuals(p, *point), point[0], point[1])
    big = QP(p.H, 1e3 * p.g, p.A, 1e3 * p.b, p.C, 1e3 * p.l, 1e3 * p.u, 1e3 * p.lb, 1e3 * p.ub)
    near = [1e3 * part for part in answer(case)]
    near[0] = near[0] + 1e-5
    found = residuals(big, *near)
    assert found.primal > 1e-6
    assert accepted(big, found, near[0], near[1], tolerance=1e-4)
    assert not accepted(big, found, near[0], near[1], tolerance=1e-9)


def proof_value(qp, proof):
    """b'y + sum of the supports; the certificate is one when A'y + C'z + z_box = 0 and this is negative."""
    mu = np.concatenate([proof.z_box, proof.z])
    bound = np.where(mu > 0, np.concatenate([qp.ub, qp.u]), np.concatenate([qp.lb, qp.l]))
    used = np.abs(mu) > 1e-9
    assert np.isfinite(bound[used]).all()
    return qp.b @ proof.y + mu[used] @ bound[used]


def test_a_proof_is_found_for_infeasible_and_never_for_feasible_qps():
    rng = np.random.default_rng(0)
    for k in range(40):
        n, m, p = int(rng.integers(1, 15)), int(rng.integers(1, 5)), int(rng.integers(0, 10))
        qp = infeasible(rng, n, m, p)
        proof = infeasibility(qp)
        assert proof is not None
        np.testing.assert_allclose(qp.A.T @ proof.y + qp.C.T @ proof.z + proof.z_box, 0.0, atol=1e-9)
        assert proof_value(qp, proof) < 0.0
        assert proof.violation > 0.0
        n = max(n, m)
        assert infeasibility(planted(rng, n, m, p, fixed=(n - m) // 3, kind="dense").problem) is None, k


@pytest.mark.parametrize(
    "qp",
    [
        QP(np.eye(2), [0, 0], A=[[1, 1], [1, 1]], b=[0, 1]),
        QP(np.eye(2), [0, 0], A=[[0, 0]], b=[1]),
        QP(np.eye(1), [0], C=[[1.0]], l=[2], ub=[1]),
        QP(np.eye(2), [0, 0], A=[[1, 0]], b=[1], lb=[0, 0], ub=[0, 0]),
        QP(np.eye(2), [0, 0], C=[[1, 0], [-1, 0]], l=[1, 1]),
        QP(np.eye(2), [0, 0], C=[[1, 1], [1, 1]], l=[1, -5], u=[1, 0.5]),
    ],
)
def test_contradictions_of_every_kind_are_proven(qp):
    proof = infeasibility(qp)
    assert proof is not None
    assert proof_value(qp, proof) < 0.0


@pytest.mark.parametrize(
    "qp",
    [
        QP(np.eye(2), [0, 0]),
        QP(np.eye(2), [0, 0], A=[[1, 1], [2, 2]], b=[1, 2]),
        QP(np.eye(2), [0, 0], A=[[0, 0]], b=[0]),
        QP(np.eye(2), [0, 0], A=[[1, 0]], b=[1], lb=[1, -np.inf], ub=[1, np.inf]),
        QP(np.eye(2), [0, 0], A=[[1, 1]], b=[2 + 1e-12], ub=[1, 1]),
    ],
)
def test_degenerate_but_feasible_qps_are_not_called_infeasible(qp):
    assert infeasibility(qp) is None


@pytest.mark.parametrize("size", [1.0, 1e3])
@pytest.mark.parametrize("margin", [1.0, 1e-3])
def test_a_margin_is_enough_for_a_proof(margin, size):
    for seed in range(40):
        qp = contradicting_qp(seed, margin, size)
        proof = infeasibility(qp)
        assert proof is not None, seed
        assert proof_value(qp, proof) < 0.0
