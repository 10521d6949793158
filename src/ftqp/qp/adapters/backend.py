"""What a QP solver is to the rest of ftqp: set up once, then solved again and again on rewritten arrays."""

import logging
from abc import ABC, abstractmethod
from typing import ClassVar, final

import numpy as np

from ftqp.core.errors import InputError
from ftqp.kernel.layout.enums import Claim as Claim
from ftqp.qp.adapters.buffers import QPBuffers

UNSOLVED = (Claim.MAX_ITERATIONS, Claim.FAILED)
"""What a solver may say that was cut short by its time limit."""
MOST_ITERATIONS = 2**31 - 1
"""Iterations are reported up to this number."""

_LOG = logging.getLogger(__name__)


class _Flags:
    """Booleans that numpy writes and Python searches; ``0 in memory`` is much faster than ``array.all()``."""

    def __init__(self, count: int) -> None:
        self.memory = bytearray(count)
        self.array = np.frombuffer(self.memory, dtype=np.bool_)


class Backend(ABC):
    """A QP solver behind the one interface that planners drive.

    ``solve`` reads the buffers given to ``setup`` and writes ``x, y, z, z_box`` into them, with the
    multipliers of L = 1/2 x'Hx + g'x + y'(Ax - b) + z'Cx + z_box'x. Whatever the data are, it returns a
    claim and never raises:

    - data with NaN, or infinite where a number belongs, are FAILED, crossed bounds INFEASIBLE, without
      asking the solver;
    - an answer that is not finite is FAILED, whatever the solver calls it, and so is one with a claim or
      iterations of another kind, or an exception;
    - a warm start that does not end in SOLVED is repeated cold, once, unless it ran out of time; after a
      solve that did not end in SOLVED, and the first time, a solve is cold whatever is asked.

    The outputs are written for SOLVED and MAX_ITERATIONS and left alone otherwise. A solve that was cut short
    by a time limit is OUT_OF_TIME.

    Attributes:
        name: How users name the backend.
        iterations: Iterations of the last solve, in the solver's own counting.
        overran: Whether the last solve was cut short by a time limit.
    """

    package: ClassVar[str]
    """The distribution whose version is reported."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.iterations = 0
        self.overran = False
        self._spent = 0
        """Iterations that the warm attempt of this solve has taken; a repeat may count them to its cap."""
        self._raised = False
        """Whether the last attempt raised, which is told once, not every tick."""
        self._buffers: QPBuffers | None = None

    @final
    def setup(self, qp: QPBuffers) -> None:
        """Keep the buffers and prepare the solver for their size; their content does not matter yet.

        Args:
            qp: The buffers that every later ``solve`` reads and writes.

        Raises:
            InputError: The QP is larger than the solver can take.
        """
        n, m, k = qp.n, qp.m, len(qp.lower)
        self._buffers = qp
        self._stale = True
        self._b_above = qp.upper[n : n + m]
        self._numbers, self._solution, self._ordered = _Flags(len(qp.data)), _Flags(n + k), _Flags(k)
        self._sides = _Flags(m)
        self._prepare(qp)

    @final
    def solve(self, *, cold: bool) -> Claim:
        """Solve the QP that the buffers hold now.

        Args:
            cold: Whether to drop what is left of the last solve; False starts from it, which is faster where
                the QPs change little.

        Raises:
            InputError: ``setup`` has not been called.
        """
        qp = self._buffers
        if qp is None:
            raise InputError(
                f"backend {self.name!r} was asked to solve before setup(QPBuffers); call setup first"
            )
        self.iterations = self._spent = 0
        self.overran = False
        self._b_above[:] = qp.b
        cold = cold or self._stale
        self._stale = True
        refused = self._refusal(qp)
        if refused is not None:
            return refused
        claim = self._attempt(qp, cold)
        if claim is not Claim.SOLVED and not cold and not self.overran:
            self._spent = self.iterations
            claim = self._attempt(qp, True)
            self.iterations += self._spent
        self._stale = claim is not Claim.SOLVED
        return Claim.OUT_OF_TIME if self.overran and claim in UNSOLVED else claim

    def _refusal(self, qp: QPBuffers) -> Claim | None:
        """FAILED for NaN or infinite data, INFEASIBLE for crossed bounds, None for data fit for a solver."""
        np.isfinite(qp.data, self._numbers.array)
        np.isfinite(qp.b, self._sides.array)
        if 0 in self._numbers.memory or 0 in self._sides.memory:
            return Claim.FAILED
        np.less_equal(qp.lower, qp.upper, self._ordered.array)  # False for NaN, too
        if 0 in self._ordered.memory:
            return Claim.FAILED if np.isnan(qp.bounds).any() else Claim.INFEASIBLE
        return None

    def _attempt(self, qp: QPBuffers, cold: bool) -> Claim:
        try:
            claim = self._run(qp, cold)
            if claim.__class__ is not Claim:
                claim = Claim(claim)
            if self.iterations.__class__ is not int or not 0 <= self.iterations <= MOST_ITERATIONS:
                self.iterations = min(max(int(self.iterations), 0), MOST_ITERATIONS)
        except Exception:  # whatever a foreign solver throws is its failure; a control loop must go on
            if not self._raised:
                _LOG.warning("solver %r raised; its answer counts as failed", self.name, exc_info=True)
            self._raised, self.iterations = True, 0
            return Claim.FAILED
        self._raised = False
        if claim <= Claim.MAX_ITERATIONS:
            np.isfinite(qp.solution, self._solution.array)
            if 0 in self._solution.memory:
                return Claim.FAILED
        return claim

    @abstractmethod
    def _prepare(self, qp: QPBuffers) -> None:
        """Allocate the native solver for this size; do not rely on the content of the buffers."""

    @abstractmethod
    def _run(self, qp: QPBuffers, cold: bool) -> Claim:
        """Hand what the buffers hold to the native solver, solve, write the outputs and ``iterations``."""
