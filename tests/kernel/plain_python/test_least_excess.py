"""The parts of the least excess: room in the rows, the proof that it was needed, and what swings free."""

from math import inf

import numpy as np
import pytest
from records import empty_record
from scipy.optimize import linprog

from ftqp.kernel.judge import stage_problems
from ftqp.kernel.layout.enums import ACCELERATION

N = 4


def record(level=ACCELERATION):
    """An arm of four joints that work, at rest in the middle of its range."""
    K = empty_record()
    K.chain.n, K.state.dt, K.state.level = N, 0.01, level
    K.faults.order[:N], K.faults.working, K.faults.movable = range(N), N, N
    K.limits.q_min[:], K.limits.q_max[:], K.limits.v_max[:], K.limits.a_max[:] = -1.0, 1.0, 2.0, 5.0
    K.qp.nx, K.qp.nc, K.qp.meq = N, 0, 0
    return K


def infeasible(C, l, u, lb, ub):
    """Whether no x in the box keeps the rows, by linear programming."""
    A, b = np.vstack([C, -C]), np.concatenate([u, -l])
    box = list(zip(lb, ub, strict=True))
    return linprog(np.zeros(C.shape[1]), A[np.isfinite(b)], b[np.isfinite(b)], bounds=box).status == 2


def test_the_proof_is_believed_exactly_where_it_proves_something():
    """Against linear programming: never where some x keeps all rows, always with multipliers of Farkas."""
    rng, said = np.random.default_rng(3), {True: 0, False: 0}
    for _ in range(50):
        K, p = record(), 3
        K.qp.nc = p
        C, lb = rng.normal(size=(p, N)), -rng.uniform(0.1, 1.0, N)
        ub, l = rng.uniform(0.1, 1.0, N), rng.uniform(-3.0, 2.0, p)
        u = l + rng.uniform(0.1, 1.0, p)
        l[0], u[1] = (-inf, inf) if rng.random() < 0.5 else (l[0], u[1])
        K.qp.C[:p, :N], K.qp.l[:p], K.qp.u[:p] = C, l, u
        K.aside.lb[:N], K.aside.ub[:N] = lb, ub
        none = infeasible(C, l, u, lb, ub)
        for _ in range(4):
            K.qp.z[:p] = rng.normal(size=p) * (rng.random(p) < 0.7)
            assert not stage_problems.box_excludes_rows(K.faults, K.chain, K.qp, K.scratch, K.aside) or none
        if none:  # least excess of the rows: its gradient is a proof
            weights = linprog(
                np.r_[np.where(np.isfinite(u), u, 0.0), np.where(np.isfinite(l), -l, 0.0), ub, -lb],
                A_eq=np.hstack([C.T, -C.T, np.eye(N), -np.eye(N)]),
                b_eq=np.zeros(N),
                bounds=[
                    *((0.0, 1.0 if finite else 0.0) for finite in np.isfinite(np.r_[u, l])),
                    *[(0.0, None)] * (2 * N),
                ],
            ).x
            K.qp.z[:p] = weights[:p] - weights[p : 2 * p]
            assert stage_problems.box_excludes_rows(K.faults, K.chain, K.qp, K.scratch, K.aside)
        said[none] += 1
    assert min(said.values()) > 8


@pytest.mark.parametrize("free", [[1], [0, 2]])
@pytest.mark.parametrize("open_side", ["neither", "lower", "upper"])
def test_rows_of_what_swings_free_are_kept_whatever_the_others_do(free, open_side):
    K, rng = record(), np.random.default_rng(6)
    working = [i for i in range(N) if i not in free]
    K.faults.order[:N], K.faults.working, K.faults.movable = [*working, *free], len(working), N
    M = rng.normal(size=(N, N))
    K.qp.nc, K.qp.C[:N, :N], K.qp.x[:N] = N, M @ M.T + np.eye(N), rng.normal(size=N)
    K.qp.lb[:N], K.qp.ub[:N] = -10.0, 10.0
    wanted = rng.normal(size=N)
    K.qp.l[:N] = -inf if open_side == "lower" else wanted
    K.qp.u[:N] = inf if open_side == "upper" else wanted
    x = K.qp.x[:N].copy()
    stage_problems.keep_free_rows(K.faults, K.chain, K.qp, K.scratch)
    left = K.qp.C[:N, :N] @ K.qp.x[:N] - wanted
    assert np.abs(left[free]).max() < 1e-12
    assert np.array_equal(K.qp.x[:N][working], x[working])
    K.qp.lb[free[0]] = K.qp.ub[free[0]] = 0.125
    stage_problems.keep_free_rows(K.faults, K.chain, K.qp, K.scratch)
    assert K.qp.x[free[0]] == 0.125, "one that is held does what is prescribed"
