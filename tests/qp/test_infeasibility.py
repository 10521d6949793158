import numpy as np
import pytest
from planted import contradicting_qp, infeasible, planted

from ftqp.qp import QP
from ftqp.qp.answer_check import infeasibility


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


def test_the_search_for_a_proof_ends_where_hundreds_of_rows_meet():
    rng = np.random.default_rng(5)
    rows, point = 1e3 * rng.normal(size=(500, 9)), rng.normal(size=9)
    beyond = np.where(rng.random(500) < 0.5, 0.0, rng.uniform(0.0, 1.0, 500))
    assert infeasibility(QP(np.eye(9), np.zeros(9), C=rows, u=rows @ point + beyond)) is None
