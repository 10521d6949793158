"""The two-sided rows of a tick, kind by kind in the order of ``ftqp.kernel.layout.rows.ROW_KINDS``."""

from functools import reduce
from importlib import import_module
from math import inf
from typing import Any

from ftqp.kernel.arm.dynamics import dynamics, torque_bound, torques_of
from ftqp.kernel.arm.kinematics import mimic, motion
from ftqp.kernel.jit import jit, part_jit, rare_jit
from ftqp.kernel.layout.enums import VELOCITY
from ftqp.kernel.layout.rows import HOLDING, ROW_KINDS, TORQUE, RowKind
from ftqp.kernel.maths.elementary import any_of, select
from ftqp.kernel.maths.side_by_side import WIDTH, all_of, is_set, lane_mask, load_lanes, store_lanes


@jit
def _nothing(K: Any, at: int) -> int:
    """No rows."""
    return at


def _then(first: Any, kind: RowKind) -> Any:
    """The rows of the first, then those of a kind, if the arm has what they need."""
    needs_inertia = kind.needs_inertia
    fill = getattr(import_module(f"ftqp.kernel.rows.{kind.module}"), kind.fill)

    @jit
    def both(K: Any, at: int) -> int:
        at = first(K, at)
        if needs_inertia and not K.chain.has_inertia:
            return at
        return fill(K, at)

    return both


fill_all: Any = reduce(_then, ROW_KINDS, _nothing)
"""All rows of C, kind by kind."""
_OTHERS = [kind for kind in ROW_KINDS if kind is not TORQUE and kind is not HOLDING]
fill_others: Any = reduce(_then, _OTHERS, _nothing)
"""All rows but those of torques, behind them."""
IN_EVERY_TICK = any(kind.most is None for kind in _OTHERS)
"""Whether there are rows, beside those of torques, that no planner has to ask for."""


@rare_jit
def add_constraints(K: Any) -> None:
    """All rows of C, and M and h of an arm that has them."""
    if K.state.level == VELOCITY:
        motion(K, K.state)
    if K.chain.has_inertia:
        dynamics(K, K.state)
        K.kinematics.has_dynamics = 1
    K.qp.rigid = K.chain.n if K.chain.has_inertia else 0
    K.qp.nc = fill_all(K, 0)


@part_jit
def add_other_rows(K: Any) -> None:
    """All rows of C but those of torques, in their places; those of torques, before them, are open."""
    qp = K.qp
    qp.rigid = K.chain.n if K.chain.has_inertia else 0
    for i in range(qp.rigid):
        qp.l[i], qp.u[i] = -inf, inf
    qp.nc = fill_others(K, qp.rigid)


@jit
def stood_at_torque_limit(Q: Any) -> bool:
    """Whether torque rows are in the working set from which the next solve starts, as the last left it."""
    first = Q.meq + Q.nx
    for k in range(Q.warm):
        if first <= Q.warm_code[k] < first + Q.rigid:
            return True
    return False


@jit
def _is_within_guard(limits: Any, chain: Any, a: Any) -> bool:
    """Whether max_i |a_i| / a_max_i <= guard: so little that torque limits hold, as samples have shown."""
    if limits.guard == 0.0:
        return False
    for at in range(0, chain.n, WIDTH):
        if not all_of(abs(load_lanes(a, at)) <= limits.guard * load_lanes(limits.a_max, at)):
            return False
    return True


@jit
def _is_within_torque(faults: Any, limits: Any, kinematics: Any, chain: Any) -> bool:
    """Whether ``kinematics.tau`` is within the limits of every joint that works."""
    tau = kinematics.tau
    for at in range(0, chain.n, WIDTH):
        works = lane_mask(chain.n, at) & ~is_set(faults.code, at)
        if any_of(works & ~(abs(load_lanes(tau, at)) <= load_lanes(limits.tau_max, at))):
            return False
    return True


@rare_jit
def _torques_hold(K: Any, a: Any) -> bool:
    """Whether the torques themselves are within their limits."""
    if K.state.level == VELOCITY:
        motion(K, K.state)
    torques_of(K.state, K.kinematics, K.chain, a)
    return _is_within_torque(K.faults, K.limits, K.kinematics, K.chain)


@jit
def keeps_torque(K: Any) -> bool:
    """Whether x, found without rows of C, keeps every torque limit: then it solves the QP with them, too.

    First a bound in any posture is looked at, at the velocity level behind that of the planner's samples; and
    only where it does not do, the torques M a + h of x.
    Source: docs/theory/joint-limits.md, "Torque rows on demand".
    """
    state, qp, a = K.state, K.qp, K.scratch.impulse
    for at in range(0, K.chain.n, WIDTH):
        x = select(lane_mask(K.chain.n, at), load_lanes(qp.x, at), 0.0)
        store_lanes(a, at, x if state.level != VELOCITY else (x - load_lanes(state.v, at)) / state.dt)
    if K.chain.mimics:
        mimic(K.chain, a)
    if _is_within_guard(K.limits, K.chain, a):
        return True
    if K.chain.is_tree or K.chain.mimics:  # the bound adds joint upon joint, as of a serial arm
        return _torques_hold(K, a)
    torque_bound(state, K.kinematics, K.chain, a)
    return _is_within_torque(K.faults, K.limits, K.kinematics, K.chain) or _torques_hold(K, a)
