"""The QP without limits, solved in one pass: the active set's answer, or none."""

import numpy as np
import pytest
from records import believe, empty_record

from ftqp.kernel.active_set.active_set import active_set
from ftqp.kernel.judge.solution_check import check_solution
from ftqp.kernel.judge.straight import straight
from ftqp.kernel.layout import enums as codes
from ftqp.kernel.layout.enums import JOINTS

SIZES = (
    *((2, 2, 8), (7, 6, 8), (8, 5, 8)),
    *(pytest.param(n, m, JOINTS, marks=pytest.mark.slow) for n, m in ((12, 6), (30, 6), (32, 3))),
)


def posed(seed=0, n=7, m=6, capacity=8, held=(), soft=1e-7, wide=1e3):
    """A record whose QP has a diagonal H and bounds far away; joints ``held`` are fixed at their x."""
    rng = np.random.default_rng(seed)
    K = empty_record(capacity)
    K.chain.n, K.cascade.accept, K.qp.tolerance, K.qp.max_iterations = n, 1e-6, 1e-9, 100
    K.qp.nx, K.qp.meq, K.task.m, K.cascade.stage = n, m, m, codes.MAIN_STAGE
    believe(K, dict.fromkeys(held, codes.LOCKED))
    qp = K.qp
    qp.H_diagonal[:n], qp.g[:n] = rng.uniform(0.1, 10.0, n), rng.normal(size=n)
    qp.A[:m, :n], qp.b[:m], qp.soft[:m] = rng.normal(size=(m, n)), rng.normal(size=m), soft
    qp.lb[:n], qp.ub[:n] = -wide, wide
    for i in held:
        qp.lb[i] = qp.ub[i] = rng.normal()
    K.task.asked[:m] = qp.b[:m] + 0.25
    # what an earlier tick of another task may have left behind the last joint
    if n < len(qp.g):
        qp.g[n], qp.H_diagonal[n], qp.lb[n], qp.ub[n], qp.A[:m, n] = -7.0, 5.0, 2.0, 3.0, 4.0
    return K


def answer(K):
    n, m = K.chain.n, K.task.m
    return {name: getattr(K.qp, name)[:size].copy() for name, size in (("x", n), ("y", m), ("z_box", n))}


def coupled(K, seed):
    """The same record with the H of a soft task beside, and something behind its last column."""
    n, qp = K.chain.n, K.qp
    J = np.random.default_rng(seed).normal(size=(3, n))
    qp.H[:n, :n], qp.dense = np.diag(qp.H_diagonal[:n]) + J.T @ J, 1
    if n < len(qp.g):
        qp.H[:n, n] = -3.0
    K.terms.count = 1
    return K


@pytest.mark.parametrize(("n", "m", "capacity"), SIZES)
@pytest.mark.parametrize("soft", [0.0, 1e-8, 1e-2])
@pytest.mark.parametrize("failed", [0, 1])
@pytest.mark.parametrize("beside", [False, True], ids=["alone", "beside soft tasks"])
def test_it_is_the_active_sets_answer(n, m, capacity, soft, failed, beside):
    held = (n // 2,) if failed and n > m else ()
    ours, theirs = (posed(n, n, m, capacity, held, soft) for _ in range(2))
    if beside:
        ours, theirs = coupled(ours, n), coupled(theirs, n)
    assert straight(ours)
    assert active_set(theirs.qp) == codes.SOLVED and check_solution(
        theirs.task, theirs.cascade, theirs.qp, theirs.scratch
    )
    for name, value in answer(ours).items():
        expected = answer(theirs)[name]
        assert value == pytest.approx(expected, rel=1e-9, abs=1e-9 * (1.0 + np.abs(expected).max())), name
    assert ours.task.slack[:m] == pytest.approx(theirs.task.slack[:m], abs=1e-10)
    assert ours.cascade.residual_task < 1e-10 and ours.cascade.residual_dual < 1e-10
    assert beside or (ours.qp.iterations == 1 and ours.qp.warm == 0)


@pytest.mark.parametrize("side", ["lb", "ub"])
@pytest.mark.parametrize("joint", [0, 6])
def test_a_bound_that_would_hold_is_left_to_the_active_set(side, joint):
    K = posed(1)
    assert straight(K)
    x = K.qp.x[joint]
    getattr(K.qp, side)[joint] = x + (1e-3 if side == "lb" else -1e-3)
    untouched = posed(1)
    getattr(untouched.qp, side)[joint] = getattr(K.qp, side)[joint]
    assert not straight(K)
    assert active_set(K.qp) == codes.SOLVED and active_set(untouched.qp) == codes.SOLVED
    for name, value in answer(K).items():
        assert np.array_equal(value, answer(untouched)[name]), name
    assert K.qp.warm > 0 and not straight(K), "a limit that held is looked at first"


@pytest.mark.parametrize(
    ("field", "index", "value"),
    [
        ("b", 2, np.nan),
        ("b", 2, np.inf),
        ("A", (1, 3), np.nan),
        ("g", 4, np.nan),
        ("g", 4, -np.inf),
        ("H_diagonal", 1, 0.0),
        ("H_diagonal", 1, -1.0),
        ("H_diagonal", 1, np.nan),
        ("lb", 5, np.nan),
        ("ub", 5, np.nan),
        ("ub", 0, -2e3),
        ("soft", 0, np.nan),
    ],
)
def test_what_has_no_answer_gets_none(field, index, value):
    K = posed(2)
    getattr(K.qp, field)[index] = value
    assert not straight(K)


def test_hard_rows_that_depend_on_each_other_are_left_to_the_active_set():
    K = posed(3, m=3, soft=0.0)
    K.qp.A[2] = K.qp.A[0] + K.qp.A[1]
    assert not straight(K)
