"""The parts of the least excess: room in the rows, the proof that it was needed, and what swings free."""

from math import inf

import numpy as np
import pytest
from records import empty_record
from scipy.optimize import linprog

from ftqp.kernel.judge import least_excess, stage_problems
from ftqp.kernel.layout.enums import ACCELERATION, VELOCITY

N = 4


def record(level=ACCELERATION):
    """An arm of four joints that work, at rest in the middle of its range."""
    K = empty_record()
    K.chain.n, K.state.dt, K.state.level = N, 0.01, level
    K.faults.order[:N], K.faults.working, K.faults.movable = range(N), N, N
    K.limits.q_min[:], K.limits.q_max[:], K.limits.v_max[:], K.limits.a_max[:] = -1.0, 1.0, 2.0, 5.0
    K.qp.nx, K.qp.nc, K.qp.meq = N, 0, 0
    return K


@pytest.mark.parametrize(
    ("level", "v", "forced", "rest", "drawn", "opened"),
    [
        (ACCELERATION, 0.1, (-3.0, -1.0), 0.0, -1.0, (-5.0, 5.0)),
        (ACCELERATION, 0.1, (-3.0, -1.0), -4.0, -3.0, (-5.0, 5.0)),
        (ACCELERATION, 0.1, (-7.0, -6.0), -6.5, -6.5, (-7.0, 5.0)),
        (ACCELERATION, 1.98, (-3.0, -1.0), 0.0, -1.0, (-5.0, 2.0)),
        (ACCELERATION, 2.5, (-3.0, -1.0), 0.0, -1.0, (-5.0, 0.0)),
        (ACCELERATION, -2.5, (1.0, 3.0), 0.0, 1.0, (0.0, 5.0)),
        (VELOCITY, 0.1, (0.06, 0.07), 0.0, 0.06, (0.05, 0.15)),
        (VELOCITY, 1.98, (1.95, 1.96), 0.0, 1.95, (1.93, 2.0)),
        (VELOCITY, 2.5, (2.45, 2.46), 0.0, 2.45, (2.45, 2.5)),
        (VELOCITY, -2.5, (-2.46, -2.45), 0.0, -2.45, (-2.5, -2.45)),
    ],
)
def test_a_joint_beyond_its_limits_is_drawn_back_and_not_forced(level, v, forced, rest, drawn, opened):
    K = record(level)
    K.state.v[1], K.qp.g[1] = v, -rest
    K.qp.lb[1], K.qp.ub[1] = forced
    least_excess._open_forced_return(K.state, K.limits, K.qp, 1)
    assert -K.qp.g[1] == pytest.approx(drawn)
    assert (K.qp.lb[1], K.qp.ub[1]) == pytest.approx(opened)


@pytest.mark.parametrize("how", ["beyond", "too fast", "failed"])
def test_the_least_excess_keeps_the_task_aside_and_opens_only_joints_that_are_forced(how):
    K, rng = record(), np.random.default_rng(1)
    K.qp.meq, K.qp.nx, K.qp.dense, K.qp.warm = 3, N + 1, 1, 2
    K.qp.g[:N], K.qp.H_diagonal[:N] = rng.normal(size=N), rng.uniform(1.0, 2.0, N)
    K.qp.lb[:N], K.qp.ub[:N] = -0.5, -0.25
    before = {name: K.qp[name][:N].copy() for name in ("g", "H_diagonal", "lb", "ub")}
    if how == "too fast":
        K.state.v[2] = 2.1
    else:
        K.state.q[2] = 1.1
    if how == "failed":
        K.faults.order[:N], K.faults.working, K.faults.movable = [0, 1, 3, 2], 3, 3
    least_excess.begin_least_excess(K)
    for name, values in before.items():
        assert np.array_equal(K.aside[name][:N], values)
    assert (K.aside.nx, K.aside.meq, K.aside.dense) == (N + 1, 3, 1)
    assert (K.qp.nx, K.qp.meq, K.qp.dense, K.qp.warm) == (N, 0, 0, 0)
    assert K.qp.soft_rows == least_excess.SOFTNESS
    wider = np.arange(N) == (2 if how != "failed" else -1)
    assert np.array_equal(K.qp.ub[:N] > before["ub"], wider)
    least_excess.make_room(K.chain, K.qp, K.aside)
    for name in ("g", "H_diagonal"):
        assert np.array_equal(K.qp[name][:N], before[name])
    assert (K.qp.nx, K.qp.meq, K.qp.dense, K.qp.warm, K.qp.soft_rows) == (N + 1, 3, 1, 0, 0.0)


def test_rows_get_the_room_that_they_need_and_no_more():
    K, rng = record(), np.random.default_rng(2)
    K.qp.nc = K.qp.rigid = 5
    K.qp.C[:5, :N], K.qp.x[:N] = rng.normal(size=(5, N)), [0.5, -2.0, 1.0, 3.0]
    s = K.qp.C[:5, :N] @ K.qp.x[:N]
    l, u = s + np.array([-1.0, 0.1, -0.3, 0.2, -inf]), s + np.array([1.0, 0.5, -0.1, 0.2, inf])
    K.qp.l[:5], K.qp.u[:5] = l, u  # kept, below, above, an equation that is missed, open
    K.aside.lb[:N], K.aside.ub[:N], K.aside.nx = -1.0, 1.0, N
    least_excess.make_room(K.chain, K.qp, K.aside)
    room = 1e-8 * (1.0 + np.abs(s))
    assert np.allclose(K.qp.l[:4], [l[0], (s - room)[1], l[2], l[3]], rtol=0.0, atol=1e-13)
    assert np.allclose(K.qp.u[:4], [u[0], u[1], (s + room)[2], u[3]], rtol=0.0, atol=1e-13)
    assert K.qp.l[4] == -inf and K.qp.u[4] == inf
    assert K.qp.lb[:N].tolist() == [-1.0, -2.0, -1.0, -1.0]
    assert K.qp.ub[:N].tolist() == [1.0, 1.0, 1.0, 3.0]


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
            assert not least_excess.box_excludes_rows(K.faults, K.chain, K.qp, K.scratch, K.aside) or none
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
            assert least_excess.box_excludes_rows(K.faults, K.chain, K.qp, K.scratch, K.aside)
        said[none] += 1
    assert min(said.values()) > 8


def test_a_proof_may_not_lean_on_a_bound_that_is_not_there():
    K = record()
    K.qp.nc, K.qp.C[0, :2], K.qp.C[1, :2] = 2, [1.0, 1.0], [1.0, -1.0 + 1e-12]
    K.qp.l[:2], K.qp.u[:2], K.qp.z[:2] = 3.0, 4.0, -1.0
    K.aside.lb[:N], K.aside.ub[:N] = -1.0, 1.0
    assert least_excess.box_excludes_rows(K.faults, K.chain, K.qp, K.scratch, K.aside), (
        "the first is 1 at most, and 3 of it are asked for"
    )
    K.aside.ub[1] = inf
    assert least_excess.box_excludes_rows(K.faults, K.chain, K.qp, K.scratch, K.aside), (
        "a ray of 1e-12 is rounding"
    )
    K.qp.C[1, 1] = -1.0 + 1e-6
    assert not least_excess.box_excludes_rows(K.faults, K.chain, K.qp, K.scratch, K.aside), (
        "one of 1e-6 is none"
    )
    K.qp.C[1, 1], K.aside.ub[0] = -1.0, inf
    assert not least_excess.box_excludes_rows(K.faults, K.chain, K.qp, K.scratch, K.aside)
    K.aside.ub[0], K.qp.z[:2], K.qp.u[:2] = 1.0, 1.0, inf
    assert not least_excess.box_excludes_rows(K.faults, K.chain, K.qp, K.scratch, K.aside), (
        "a multiplier of a side that is open proves nothing"
    )


@pytest.mark.parametrize("free", [[1], [0, 2]])
def test_what_swings_free_is_pushed_by_nobody(free):
    K, rng = record(), np.random.default_rng(5)
    working = [i for i in range(N) if i not in free]
    K.faults.order[:N], K.faults.working, K.faults.movable = [*working, *free], len(working), N
    M = rng.normal(size=(N, N))
    K.qp.nc, K.qp.C[:N, :N], K.qp.z[:N] = N, M @ M.T + np.eye(N), rng.normal(size=N)
    z = K.qp.z[:N].copy()
    least_excess._without_push_on_free(K.faults, K.qp, K.scratch)
    push = K.qp.C[:N, :N].T @ K.qp.z[:N]
    assert np.abs(push[free]).max() < 1e-12
    assert np.array_equal(K.qp.z[:N][working], z[working])


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
    least_excess.keep_free_rows(K.faults, K.chain, K.qp, K.scratch)
    left = K.qp.C[:N, :N] @ K.qp.x[:N] - wanted
    assert np.abs(left[free]).max() < 1e-12
    assert np.array_equal(K.qp.x[:N][working], x[working])
    K.qp.lb[free[0]] = K.qp.ub[free[0]] = 0.125
    least_excess.keep_free_rows(K.faults, K.chain, K.qp, K.scratch)
    assert K.qp.x[free[0]] == 0.125, "one that is held does what is prescribed"


@pytest.mark.parametrize("what", ["no free joint", "no rows"])
def test_without_free_joints_or_rows_there_is_nothing_to_keep(what):
    K = record()
    K.qp.x[:N], K.qp.C[:N, :N], K.qp.nc = 1.0, np.eye(N), N
    if what == "no rows":
        K.faults.working, K.qp.nc = N - 1, 0
    least_excess.keep_free_rows(K.faults, K.chain, K.qp, K.scratch)
    assert K.qp.x[:N].tolist() == [1.0] * N


@pytest.mark.parametrize("dense", [0, 1])
def test_the_plain_criterion_weighs_as_the_mean_of_that_of_the_scheme(dense):
    K, rng = record(), np.random.default_rng(8)
    K.qp.dense, K.qp.warm = dense, 3
    H = rng.normal(size=(N, N))
    K.qp.H[:N, :N], K.qp.H_diagonal[:N] = H @ H.T, rng.uniform(1.0, 3.0, N)
    K.state.v[:N] = [0.01, -0.02, 0.0, 1.0]
    mean = np.trace(H @ H.T) / N if dense else K.qp.H_diagonal[:N].mean()
    stage_problems.begin_plain(K)
    assert np.allclose(K.qp.H_diagonal[:N], mean) and K.qp.dense == 0 == K.qp.warm
    assert np.allclose(-K.qp.g[:N] / mean, [-1.0, 2.0, 0.0, -5.0])
