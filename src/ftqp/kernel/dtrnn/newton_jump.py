"""The Newton jump: the exact solution for the bounds that the network holds active now."""

from typing import Any

from ftqp.kernel.dtrnn.projection import Network, residual
from ftqp.kernel.dtrnn.stopping import Options, is_solved
from ftqp.kernel.jit import jit
from ftqp.kernel.maths.lu import lu_factor, lu_solve

ACCEPTED = 0.5
"""Paper mode: a jump counts when it shrinks |e| at least by this factor. A convention
(docs/theory/recurrent-network.md, "Newton jumps"): a halved residual is progress that steps of the network
take long for."""
STEPS = 6
"""Newton steps of one jump outside paper mode."""
LONG_STEPS = 4
"""Most Newton steps of a long jump, in bounds of the network."""
TRIES = 3
"""Newton steps of a long jump without fewer wrong sides, before only one side is changed at a time."""
YIELDING = 1e-8
"""Compliance of hard rows in a long jump, relative to the QP's own magnitude."""


@jit
def _side(net: Network, v: Any, i: int) -> float:
    """-1 or 1 when w_i = v_i - F_i is at or beyond the lower or upper end of Omega, 0 inside."""
    w = v[i] - net.F[i]
    if not w > net.low[i]:
        return -1.0
    return 0.0 if w < net.high[i] else 1.0


@jit
def _change_sides(net: Network, v: Any, first: bool, single: bool) -> int:
    """Give components of x and s the side that v asks for, all or the last wrong one; how many were wrong.

    Except at first, a component leaves its bound for the inside, never at once for the other bound.
    """
    wrong = 0
    for i in range(net.variables + net.slacks - 1, -1, -1):
        side = _side(net, v, i)
        if side != net.side[i]:
            if not single or wrong == 0:
                net.side[i] = side if first or net.side[i] == 0.0 else 0.0
            wrong += 1
    return wrong


@jit
def _unknowns(net: Network) -> int:
    """Put what the sides leave open into ``order`` and the rest into ``trial``; how many are open.

    A component of x or s with a side sits at that bound. A slack inside has the multiplier 0, which drops
    both; any other row keeps its multiplier open.
    """
    first = net.variables + net.slacks
    equalities = net.rows - net.slacks
    count = 0
    for i in range(first):
        net.trial[i] = 0.0
        if net.side[i] != 0.0:
            net.trial[i] = net.low[i] if net.side[i] < 0.0 else net.high[i]
        elif i < net.variables:
            net.order[count] = i
            count += 1
    for k in range(net.rows):
        net.trial[first + k] = 0.0
        if k < equalities or net.side[net.variables + k - equalities] != 0.0:
            net.order[count] = first + k
            count += 1
    return count


@jit
def _solve_unknowns(net: Network, count: int) -> None:
    """(Gamma trial + z)_i = 0 for the open components i; s = C x for the slacks inside."""
    N, first = len(net.z), net.variables + net.slacks
    S, right, trial = net.jump, net.direction, net.trial
    for a in range(count):
        i = int(net.order[a])
        row = net.Gamma[i]
        s = -net.z[i]
        for j in range(N):
            s -= row[j] * trial[j]
        right[a] = s
        for c in range(count):
            S[a, c] = row[int(net.order[c])]
    lu_factor(S, count, net.jump_pivots)
    lu_solve(S, count, net.jump_pivots, right)
    for a in range(count):
        trial[int(net.order[a])] = right[a]
    for k in range(net.slacks):
        if net.side[net.variables + k] == 0.0:
            row = net.Gamma[first + net.rows - net.slacks + k]
            s = 0.0
            for a in range(net.variables):
                s += row[a] * trial[a]
            trial[net.variables + k] = s / net.scales[1]


@jit
def soften(net: Network) -> None:
    """Let hard rows yield a little: YIELDING |A|_F^2/(rows tr W) on their diagonal, until ``harden``."""
    primal = net.variables + net.slacks
    trace, norm = 0.0, 0.0
    for i in range(net.variables):
        trace += net.Gamma[i, i]
        for k in range(net.rows):
            norm += net.Gamma[primal + k, i] * net.Gamma[primal + k, i]
    soft = YIELDING * norm / (max(net.rows, 1) * (trace if trace > 0.0 else 1.0)) + 1e-300
    for k in range(primal, primal + net.rows):
        net.side[k] = 0.0 if net.Gamma[k, k] > 0.0 else 1.0  # nobody else's: rows have no sides
        if net.side[k] != 0.0:
            net.Gamma[k, k] = soft


@jit
def harden(net: Network) -> None:
    """Undo ``soften``."""
    for k in range(net.variables + net.slacks, len(net.u)):
        if net.side[k] != 0.0:
            net.Gamma[k, k] = 0.0


@jit
def right_sides(net: Network, v: Any) -> None:
    """The Newton point whose sides are its own, into ``trial``, for rows that are all compliant.

    Newton steps from v; while the number of wrong sides does not fall, only the last of them is changed.

    Args:
        net: its F is that of v.
        v: where to start, (N,).

    Source: Júdice and Pires 1994, block principal pivoting.
    """
    bounds = net.variables + net.slacks
    for i in range(bounds):
        net.side[i] = 2.0
    fewest, tries = bounds + 1, TRIES
    for k in range(STEPS + LONG_STEPS * bounds):
        wrong = _change_sides(net, v if k == 0 else net.trial, k == 0, tries == 0)
        if wrong == 0:
            break
        if k > 0 and wrong < fewest:
            fewest, tries = wrong, TRIES
        elif tries > 0:
            tries -= 1
        _solve_unknowns(net, _unknowns(net))
        residual(net, net.trial)


@jit
def _newton_steps(net: Network, o: Options, v: Any, size: float) -> bool:
    """Newton steps from v, its F in the network, until ``trial`` is worth a jump; False when none is."""
    for i in range(net.variables + net.slacks):
        net.side[i] = 2.0
    for k in range(1 if o.paper else STEPS):
        if _change_sides(net, v if k == 0 else net.trial, k == 0, False) == 0:
            return False
        _solve_unknowns(net, _unknowns(net))
        found = residual(net, net.trial)
        if found < ACCEPTED * size if o.paper else is_solved(net, o, net.trial, found):
            return True
    return False


@jit
def jump(net: Network, o: Options, size: float, long: bool) -> bool:
    """Replace u by a Newton point u^, or leave it alone: whether it was replaced.

    With w = u - (Gamma u + z):  u^_i = the bound beyond which w_i lies,  (Gamma u^ + z)_i = 0 for the others.

    Paper mode: one step, taken when |e(u^)| < |e(u)|/2. Else up to ``STEPS`` in a row, each from the last u^,
    taken when u^ solves the QP: a point with a smaller |e| but huge multipliers can cost the base method
    thousands of iterations. Either way the base method converges as without jumps. F and e are those of the
    last u^, taken or not.

    A long jump finds the sides of the QP whose hard rows yield a little, which always ends, and steps on from
    there.

    Source: docs/theory/recurrent-network.md, "Newton jumps".
    """
    if long:
        soften(net)
        residual(net, net.u)
        right_sides(net, net.u)
        harden(net)
        residual(net, net.trial)
        found = _newton_steps(net, o, net.trial, size)
    else:
        found = _newton_steps(net, o, net.u, size)
    if found:
        for i in range(len(net.u)):
            net.u[i] = net.trial[i]
    return found
