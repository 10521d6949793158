"""Solvers that come near an answer: posed so that they can get there, and polished where they do not."""

from abc import abstractmethod
from typing import final

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from ftqp.core.checks import BoolArray, FloatArray
from ftqp.core.clock import now
from ftqp.qp.adapters.backend import Backend, Claim, QPBuffers

STEPS = 2
"""The most systems that are solved: one for the active bounds of the answer, one for those that its own
solution asks for."""
EXACT = 1e-9
"""What an optimality condition may be off, as a share of the size of its terms; where a bound is, plus one.

Multipliers have no size of their own: in the units in which a QP is posed for a second attempt they may all
be smaller than this.
"""
REGULAR = 1e-12
"""Subtracted from the diagonal of the rows, so that rows that depend on each other can be solved for, too."""
REFINEMENTS = 2
"""Corrections of a solution, which take the regularisation out again."""


LARGE = 1e5
"""Compliant rows whose multipliers are above this are better posed in other units."""


class EasedQP:
    """The same QP with the objective times s and slacks counted in units of their rows.

        min s (1/2 x'Hx + g'x) + 1/2 sum (s / soft_k) r_k^2,   A x + r = b,   s = min soft_k

    with r = c t. Where a task cannot be followed, multipliers of the QP as a planner poses it reach 1e8, and
    a method that approaches them step by step, and ends at an absolute tolerance, gets there late or never;
    here they are as large as what is left of the rows. Where a task is followed it is the other way round:
    all but the rows hardly counts. So this is for QPs whose rows give way.
    """

    def __init__(self, n: int, m: int, p: int) -> None:
        self.buffers = QPBuffers.zeros(n, m, p)
        self.soft: FloatArray = np.ones(m)
        self._units = np.ones(n)
        self._box_units = np.ones(n + m + p)
        self._objective = 1.0

    def pose(self, qp: QPBuffers, soft: FloatArray) -> None:
        """Write a QP into the buffers, in these units."""
        posed, units, inner = self.buffers, self._units, qp.n - qp.m
        self._objective = float(soft.min())
        np.divide(soft, self._objective, out=self.soft)
        np.divide(1.0, qp.A[:, inner:].diagonal(), out=units[inner:])
        np.divide(1.0, units, out=self._box_units[: qp.n])
        np.multiply(qp.H, units * (self._objective * units)[:, None], out=posed.H)
        np.multiply(qp.g, self._objective * units, out=posed.g)
        np.multiply(qp.rows, units, out=posed.rows)
        posed.lower[:], posed.upper[:] = qp.lower, qp.upper  # only slacks change their units: they have none

    def answer(self, qp: QPBuffers) -> None:
        """Write the solution that the buffers hold into those of the QP, in its units."""
        posed = self.buffers
        np.multiply(posed.x, self._units, out=qp.x)
        np.multiply(posed.multipliers, self._box_units / self._objective, out=qp.multipliers)


def compliance(qp: QPBuffers) -> FloatArray | None:
    """How soft each equality row is, soft_k = c_k^2 / h_k, (m,); None where rows have no slacks.

    The last m variables t are slacks where each is in one row alone, A x + c t = b, costs h t^2 / 2 and
    nothing else, and has no bounds. Minimised over t, this is |A x - b|^2 / (2 soft): the multiplier of a row
    is what is left of it over soft, and grows without measure where no x within the bounds comes near b.
    """
    n, m = qp.n, qp.m
    inner = n - m
    if m == 0 or inner <= 0:
        return None
    columns, costs = qp.A[:, inner:], qp.H[inner:]
    c, h = columns.diagonal(), costs[:, inner:].diagonal()
    if (
        np.count_nonzero(columns) != m
        or np.count_nonzero(costs) != m
        or not (c != 0.0).all()
        or not (h > 0.0).all()
        or qp.g[inner:].any()
        or qp.C[:, inner:].any()
        or np.isfinite(qp.lb[inner:]).any()
        or np.isfinite(qp.ub[inner:]).any()
    ):
        return None
    return np.asarray(c * c / h)


def polished(qp: QPBuffers, soft: FloatArray | None) -> bool:
    """Polish the solution in the buffers; False, and they are as before, where that does not succeed.

    The answer in the buffers is a guess of which bounds are active: a lower one where x - lb < -z, an upper
    one where ub - x < z. With the active variables at their bounds, F the others, W the equality rows and the
    active ones of C, and w their right sides,

        [ H_FF   W_F'  ] [ x_F ]   [ -(g + H x_B)_F ]
        [ W_F   -soft  ] [  y  ] = [    w - W x_B   ]

    Slacks of compliant rows are eliminated. The solution counts only if it fulfils every optimality condition
    of the QP; else it is the next guess, once.
    Source: Stellato et al. 2020, section 4, which solves once; to go on with the bounds that the solution
    asks for is the primal-dual active set method of Hintermueller, Ito and Kunisch 2003.

    Rows of compliance ``soft``, (m,), give way; None: they are hard.
    """
    if not np.isfinite(qp.solution).all():
        return False
    m, p = qp.m, qp.p
    inner = qp.n if soft is None else qp.n - m
    give = np.zeros(m + p)
    give[:m] = 0.0 if soft is None else soft
    H, g, rows = qp.H[:inner, :inner], qp.g[:inner], qp.rows[:, :inner]
    lb, ub, low, high = qp.lb[:inner], qp.ub[:inner], qp.lower[qp.n :], qp.upper[qp.n :]
    x, z_box, z = qp.x[:inner], qp.z_box[:inner], qp.multipliers[qp.n :]
    fixed, equal = lb == ub, low == high
    equal[:m] = True
    before = b""
    for _ in range(STEPS):
        value = rows @ x
        down, up = _active(x, lb, ub, z_box, fixed)
        below, above = _active(value, low, high, z, equal)
        now = down.tobytes() + up.tobytes() + below.tobytes() + above.tobytes()
        if now == before:
            return False
        before = now
        held, kept = down | up, np.flatnonzero(below | above)
        free = np.flatnonzero(~held)
        at = np.where(down, lb, np.where(up, ub, 0.0))
        W = rows[kept]
        right = np.concatenate([-(g + H @ at)[free], np.where(below, low, high)[kept] - W @ at])
        solution = _solved(H[np.ix_(free, free)], W[:, free], give[kept], right)
        if solution is None:
            return False
        x, z = at, np.zeros(m + p)
        x[free], z[kept] = solution[: len(free)], solution[len(free) :]
        force, pull = H @ x, rows.T @ z
        z_box = -(force + g + pull)
        size = max(np.abs(force).max(), np.abs(g).max(), np.abs(pull).max())
        if (np.abs(z_box[free]) > EXACT * size).any():
            return False
        z_box[free] = 0.0
        value = rows @ x - give * z
        reach = 1.0 + np.abs(x).max()
        if (
            _kept(x, lb, ub, EXACT * reach)
            and _kept(value, low, high, EXACT * (reach + np.abs(value)))
            and _signed(z_box, down & ~fixed, up, EXACT * size)
            and _signed(z, below & ~equal, above, EXACT * np.abs(z).max(initial=0.0))
        ):
            break
    else:
        return False
    np.clip(x, lb, ub, out=qp.x[:inner])
    qp.multipliers[qp.n :] = z
    qp.z_box[:] = 0.0
    qp.z_box[:inner] = z_box
    if soft is not None:
        qp.x[inner:] = -qp.A[:, inner:].diagonal() * qp.y / qp.H[inner:, inner:].diagonal()
    return True


def _active(
    value: FloatArray, low: FloatArray, high: FloatArray, z: FloatArray, equal: BoolArray
) -> tuple[BoolArray, BoolArray]:
    """Which values are at their lower bound, equalities among them, and which at their upper one."""
    down: BoolArray = equal | (value - low < -z)
    up: BoolArray = ~down & (high - value < z)
    return down, up


def _solved(H: FloatArray, W: FloatArray, give: FloatArray, right: FloatArray) -> FloatArray | None:
    """The solution of the system of ``polished``; None where it has none."""
    f, N = len(H), len(right)
    system = np.zeros((N, N))
    system[:f, :f], system[f:, :f], system[:f, f:] = H, W, W.T
    rows = np.arange(f, N)
    system[rows, rows] = -give
    regular = system.copy()
    regular[rows, rows] -= REGULAR
    factors, pivots, failed = dgetrf(regular)
    if failed:
        return None
    solution: FloatArray
    solution, _ = dgetrs(factors, pivots, right)
    for _ in range(REFINEMENTS):
        correction, _ = dgetrs(factors, pivots, right - system @ solution)
        solution = solution + correction
    return solution if bool(np.isfinite(solution).all()) else None


def _kept(value: FloatArray, low: FloatArray, high: FloatArray, margin: FloatArray | float) -> bool:
    return not ((value < low - margin) | (value > high + margin)).any()


def _signed(z: FloatArray, down: BoolArray, up: BoolArray, margin: float) -> bool:
    return not (z[down] > margin).any() and not (z[up] < -margin).any()


class PolishedBackend(Backend):
    """A solver whose approximate answers are made exact where they have found which bounds are active.

    What the solver itself calls solved is taken as it is. What it has not solved within ``first_cap``
    iterations is polished. Where that is in vain, or the multipliers were large, a QP with compliant rows is
    posed as an ``EasedQP``, whose answers are always polished. A warm solve goes on in the units of the last
    one; a cold one tries both, and then gets what is left of ``cap``.
    """

    def __init__(
        self,
        name: str,
        *,
        first_cap: int,
        cap: int,
        polish: bool,
        unsolved: Claim = Claim.MAX_ITERATIONS,
        time_limit: float | None = None,
    ) -> None:
        """Prepare for a solver.

        An answer is polished after ``first_cap`` iterations; ``cap`` is the most of a solve, all attempts
        together, 0 for a solver that counts none, and so is ``time_limit`` [s], None without a look at a
        clock. Without ``polish`` the solver is asked once, for ``cap`` iterations. ``unsolved`` is what an
        answer is called that stayed unsolved.
        """
        super().__init__(name)
        self._cap, self._first_cap = cap, min(first_cap, cap)
        self._polishes, self._unsolved = polish, unsolved
        self._eased = self._held_eased = self._in_vain = False
        self._time_limit, self._began = time_limit, 0

    @abstractmethod
    def _set_up(self, qp: QPBuffers) -> None:
        """Allocate the native solver for this size; do not rely on the content of the buffers."""

    @abstractmethod
    def _answer(self, qp: QPBuffers, cold: bool, cap: int) -> Claim:
        """Solve what the buffers hold in at most ``cap`` iterations; write the outputs and ``iterations``."""

    @final
    def _prepare(self, qp: QPBuffers) -> None:
        self._before: FloatArray = np.zeros_like(qp.solution)
        self._other = EasedQP(qp.n, qp.m, qp.p)
        self._eased = self._held_eased = self._in_vain = False
        self._set_up(qp)

    @final
    def _run(self, qp: QPBuffers, cold: bool) -> Claim:
        self.iterations = 0
        if self._time_limit is not None and not self._in_vain:
            self._began = now()
        np.copyto(self._before, qp.solution)
        if not self._polishes:
            claim = self._answer(qp, cold, self._cap)
        elif cold:
            claim = self._from_nothing(qp)
        elif self._eased or self._held_eased:
            claim = self._attempted(qp, self._eased, False, self._first_cap)
        else:  # what nearly every tick of a loop is
            claim = self._answer(qp, False, self._first_cap)
            if claim is Claim.SOLVED:
                return claim
            if claim is Claim.MAX_ITERATIONS and not self.overran:
                claim = self._finished(qp)
        self._in_vain = claim is not Claim.SOLVED and not cold
        if claim is Claim.MAX_ITERATIONS:
            claim = self._unsolved
        if claim > Claim.MAX_ITERATIONS:
            np.copyto(qp.solution, self._before)
        return claim

    def _from_nothing(self, qp: QPBuffers) -> Claim:
        """A cold solve, first in the units in which a warm one has not just been in vain."""
        first = self._in_vain and not self._eased
        self._eased = False
        can_ease = compliance(qp) is not None
        claim = Claim.MAX_ITERATIONS
        for eased in (first, not first) if can_ease else (False,):
            cap = min(self._first_cap, self._left)
            if (self._cap and cap <= 0) or self.overran:
                return claim
            claim = self._attempted(qp, eased, True, cap)
            if claim is Claim.SOLVED:
                return claim
        if claim is not Claim.INFEASIBLE and self._left > 0 and not self.overran:
            claim = self._attempted(qp, can_ease, True, self._left)
        return claim

    @property
    def _left(self) -> int:
        """Iterations that this solve may still take."""
        return self._cap - self._spent - self.iterations

    def _seconds_left(self, limit: float) -> float:
        """What is left of the time limit; 0 when it is over, and then the solve has overrun."""
        left = limit - 1e-9 * (now() - self._began)
        if left <= 0.0:
            self.overran = True
        return max(left, 0.0)

    def _attempted(self, qp: QPBuffers, eased: bool, cold: bool, cap: int) -> Claim:
        """One attempt in the QP's own units or in others, and which suit the next solve."""
        cold = cold or eased is not self._held_eased
        self._held_eased = eased
        if not eased:
            claim = self._counted(qp, cold, cap)
            return self._finished(qp) if claim is Claim.MAX_ITERATIONS and not self.overran else claim
        soft = compliance(qp)
        if soft is None:
            return Claim.MAX_ITERATIONS
        other = self._other
        other.pose(qp, soft)
        claim = self._counted(other.buffers, cold, cap)
        if claim > Claim.MAX_ITERATIONS or self.overran:
            return claim
        solved = polished(other.buffers, other.soft)
        other.answer(qp)
        if not solved:
            return Claim.MAX_ITERATIONS
        self._eased = _has_large_multipliers(qp)
        return Claim.SOLVED

    def _finished(self, qp: QPBuffers) -> Claim:
        """What polishing makes of an answer in the QP's own units."""
        soft = compliance(qp)
        if not polished(qp, soft):
            return Claim.MAX_ITERATIONS
        self._eased = soft is not None and _has_large_multipliers(qp)
        return Claim.SOLVED

    def _counted(self, qp: QPBuffers, cold: bool, cap: int) -> Claim:
        """The solver's own answer; its iterations add up."""
        before = self.iterations
        claim = self._answer(qp, cold, cap)
        self.iterations += before
        return claim


def _has_large_multipliers(qp: QPBuffers) -> bool:
    return float(np.abs(qp.y).max()) > LARGE
