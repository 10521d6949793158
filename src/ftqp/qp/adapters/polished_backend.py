"""Solvers that come near an answer: posed so that they can get there, and polished where they do not."""

from abc import abstractmethod
from typing import final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.clock import now
from ftqp.qp.adapters.backend import Backend, Claim
from ftqp.qp.adapters.buffers import QPBuffers
from ftqp.qp.adapters.polish import polished


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


LARGE = 1e5
"""Compliant rows whose multipliers are above this are better posed in other units."""


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
        """Solve what the buffers hold in at most ``cap`` iterations; write the outputs and ``iterations``.

        The buffers are those of ``_set_up``, or others of that size, to which a change is always cold.
        """

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
