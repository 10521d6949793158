"""Rows of C: torque limits, tasks before the tip's, the user's own, and pairs that keep apart."""

from math import inf
from typing import Any

from ftqp.kernel.arm.kinematics import fold_row
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import FREE, HEALTHY, VELOCITY
from ftqp.kernel.layout.rows import CLEARANCES
from ftqp.kernel.rows.further_tasks import term_rows


@jit
def _write(qp: Any, at: int, n: int, row: Any, low: float, high: float) -> None:
    """low <= row x <= high, from row ``at`` of C on."""
    for j in range(n):
        qp.C[at, j] = row[j]
    qp.C[at, n] = 0.0
    qp.l[at], qp.u[at] = low, high


@jit
def fill_torques(K: Any, at: int) -> int:
    """l <= M x <= u, one row a joint from row ``at`` of C on; the next free row.

    tau_min - h <= M a <= tau_max - h, times dt at the velocity level. A free-swinging joint's row is the
    equality tau = -(friction + viscous) v, with the velocity after the step: taken before it, where h has the
    joint's own viscous friction, strong friction on a light joint would be unstable. The row of a joint that
    is held, or asks for its brake, is open: the brake carries whatever is needed. Those of a body that floats
    are M_b a + h_b = 0, at the velocity level M_b v = 0: momentum stays what it is, and 0.
    Source: docs/theory/joint-failures.md, "Free-swinging"; Umetani and Yoshida 1989.
    """
    chain, limits, faults, state, kinematics, qp = K.chain, K.limits, K.faults, K.state, K.kinematics, K.qp
    asks = K.feedback.asks
    n = chain.n
    scale = state.dt if state.level == VELOCITY else 1.0
    for i in range(n):
        shift = -scale * kinematics.h[i]
        row = qp.C[at + i]
        for j in range(n):
            row[j] = kinematics.M[i, j]
            if state.level == VELOCITY:
                shift += kinematics.M[i, j] * state.v[j]
        row[n] = 0.0
        fault = faults.code[i]
        if i < chain.floating:
            qp.l[at + i] = qp.u[at + i] = 0.0 if state.level == VELOCITY else shift
        elif fault == FREE:
            own = chain.viscous[i]
            friction = faults.friction[i] + own
            row[i] += friction * state.dt
            qp.l[at + i] = qp.u[at + i] = shift + (
                scale * own * state.v[i] if state.level == VELOCITY else -faults.friction[i] * state.v[i]
            )
        elif fault == HEALTHY and not asks[i]:
            qp.l[at + i], qp.u[at + i] = shift - scale * limits.tau_max[i], shift + scale * limits.tau_max[i]
        else:
            qp.l[at + i], qp.u[at + i] = -inf, inf
    return at + n


@jit
def fill_held(K: Any, at: int) -> int:
    """J x = b of every task that goes before the tip's, from row ``at`` of C on; the next free row.

    One whose weight is 0 keeps its rows, which ask for nothing. Where box and rows exclude each other the
    rows give way, as torque limits do.
    Source: docs/theory/further-tasks.md, "Before the task of the tip".
    """
    terms = K.terms
    for t in range(terms.count):
        if terms.hard[t] == 0:
            continue
        term_rows(K, t)
        for k in range(6):
            if terms.rows[t] & (1 << k) == 0:
                continue
            asked, counts = terms.asked[t, k], terms.weight[t] != 0.0
            low, high = (asked, asked) if counts else (-inf, inf)
            _write(K.qp, at, K.chain.n, terms.J[t, k], low, high)
            at += 1
    return at


@jit
def fill_own(K: Any, at: int) -> int:
    """l <= C x <= u of the user's own, from row ``at`` of C on; the next free row."""
    keeps = K.keeps
    for k in range(keeps.own):
        _write(K.qp, at + k, K.chain.n, keeps.own_C[k], keeps.own_l[k], keeps.own_u[k])
        if K.chain.mimics:
            fold_row(K.chain, K.qp.C[at + k])
    return at + keeps.own


@jit
def fill_clearances(K: Any, at: int) -> int:
    """G x >= least of the pairs that ``ftqp.kernel.scene.clearance`` has found, one row a slot; the next row.

    Empty slots have no ends. These rows give way where nothing else can: the first of them is
    ``qp.yields_from``.
    """
    qp, scene = K.qp, K.scene
    qp.yields_from = at
    if scene.pairs == 0:
        return at
    for k in range(CLEARANCES):
        if scene.slot[k] >= 0:
            _write(qp, at + k, K.chain.n, scene.G[k], scene.least[k], inf)
        else:
            for j in range(K.chain.n + 1):
                qp.C[at + k, j] = 0.0
            qp.l[at + k], qp.u[at + k] = -inf, inf
    return at + CLEARANCES
