"""Recorder: any backend, with a copy kept of every QP and its answer."""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, final

import numpy as np

from ftqp.core.checks import FloatArray, positive
from ftqp.core.errors import InputError
from ftqp.qp.adapters.backend import Backend, Claim
from ftqp.qp.adapters.buffers import QPBuffers
from ftqp.qp.adapters.registry import backend as backend_of
from ftqp.qp.problem import ANSWER, PARTS
from ftqp.qp.recording.recorded_qps import Recording

MEMORY = 256 * 2**20
"""Bytes that the copies take at most unless ``limit`` says otherwise: 75 000 QPs of a Panda's pose task."""


class Ticking(Protocol):
    """Whoever numbers the QPs: a planner."""

    @property
    def tick(self) -> int:
        """Number of the tick that is being computed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Kept:
    tick: int
    flat: FloatArray
    solution: FloatArray
    claim: Claim
    iterations: int
    cold: bool


@final
class Recorder(Backend):
    """Forwards to another backend and keeps copies of the QPs, their answers and the solver's claims.

    It changes no answer. When the memory is full the oldest QPs go: the last ones tell why a run ended as it
    did. It keeps one run: a tick number that does not rise begins anew. QPs that no solver is asked to solve
    (NaN, crossed bounds; ticks of a stop) are not kept.

    Args:
        inner: The backend that solves, or anything that ``ftqp.qp.backend`` takes.
        every: One of so many ticks is kept, >= 1. A larger number covers a longer run in the same memory.
        limit: The most QPs that are kept, >= 1; None is as many as fit into 256 MiB.
        first: The first tick to keep, >= 0.
        last: The last tick to keep, >= first; None has no end.

    Raises:
        InputError: The backend is unknown, or a number is out of its range.
        MissingPackage: The solver's package is not installed.
    """

    package = "ftqp"

    def __init__(
        self,
        inner: str | Path | Mapping[str, Any] | Backend,
        every: int = 1,
        limit: int | None = None,
        *,
        first: int = 0,
        last: int | None = None,
    ) -> None:
        self.inner = backend_of(inner)
        if isinstance(self.inner, Recorder):
            raise InputError(f"{self.inner.name} records already; give the backend inside it")
        super().__init__(f"recorder:{self.inner.name}")
        for name, value, least in (("every", every, 1), ("limit", limit, 1), ("first", first, 0)):
            if value is not None and (isinstance(value, bool) or not isinstance(value, int) or value < least):
                raise InputError(f"{name} is {value!r}, expected a whole number >= {least}")
        if last is not None and (isinstance(last, bool) or not isinstance(last, int) or last < first):
            raise InputError(f"last is {last!r}, expected a whole number >= first, {first}")
        self._every, self._limit = every, limit
        self._first, self._last = first, last
        self._kept: deque[_Kept] = deque()
        self._leader: Ticking | None = None
        self._dropped, self._solves, self._again = 0, 0, False

    def follow(self, leader: Ticking) -> None:
        """Number the QPs by the ticks of a planner; without one, solves are counted.

        Args:
            leader: The planner, or anything else with a ``tick``.
        """
        self._leader = leader

    def __len__(self) -> int:
        return len(self._kept)

    @property
    def dropped(self) -> int:
        """How many of the oldest QPs have gone for want of memory."""
        return self._dropped

    def _prepare(self, qp: QPBuffers) -> None:
        self.inner._prepare(qp)
        self._sizes = (qp.n, qp.m, qp.p)
        most = self._limit or max(1, MEMORY // (qp.flat.nbytes + qp.solution.nbytes))
        self._kept = deque(maxlen=most)
        self._dropped, self._solves, self._again = 0, 0, False

    def _run(self, qp: QPBuffers, cold: bool) -> Claim:
        self.inner.iterations = 0
        self.inner._spent = self._spent
        try:
            claim = self.inner._run(qp, cold)
        except Exception:  # a failure of the solver, which the caller counts as one; Ctrl-C is none
            self._keep(qp, Claim.FAILED, cold)
            raise
        self._keep(qp, claim, cold)
        return claim

    def _keep(self, qp: QPBuffers, claim: Claim, cold: bool) -> None:
        self.iterations = self.inner.iterations
        answered = claim <= Claim.MAX_ITERATIONS and bool(np.isfinite(qp.solution).all())
        claim = claim if answered or claim > Claim.MAX_ITERATIONS else Claim.FAILED
        # A warm start that fails is repeated cold at once: the same QP, whose last answer counts.
        again, self._again = self._again, not cold and claim is not Claim.SOLVED
        self._solves += not again
        tick = self._solves - 1 if self._leader is None else self._leader.tick
        if tick < self._first or (self._last is not None and tick > self._last):
            return
        if (tick - self._first) % self._every:
            return
        kept = _Kept(
            tick=tick,
            flat=qp.flat.copy(),
            solution=qp.solution.copy() if answered else np.full(len(qp.solution), np.nan),
            claim=claim,
            iterations=self.iterations,
            cold=cold and not again,
        )
        if self._kept and tick == self._kept[-1].tick:
            self._kept[-1] = kept
            return
        if self._kept and tick < self._kept[-1].tick:
            self._kept.clear()
            self._dropped = 0
        self._dropped += len(self._kept) == self._kept.maxlen
        self._kept.append(kept)

    def recording(
        self,
        *,
        dt: float,
        variables: Sequence[str] | None = None,
        rows: Sequence[str] | None = None,
        metadata: Mapping[str, Any] | None = None,
    ) -> Recording:
        """What was kept, as a recording.

        Args:
            dt: Time between ticks, > 0 [s].
            variables: Names of x, (n,); None is x0, x1, ...
            rows: Names of [A; C], (m + p,); None is row0, row1, ...
            metadata: What JSON can hold; the backend's name is added.

        Raises:
            InputError: Nothing was kept, or the names do not fit.
        """
        if not self._kept:
            raise InputError("no QP was recorded; let the planner step, or widen first and last")
        n, m, p = self._sizes
        problems = QPBuffers.zeros(n, m, p)
        stacks: dict[str, list[FloatArray]] = {name: [] for name in (*PARTS, *ANSWER)}
        for kept in self._kept:
            problems.flat[:], problems.solution[:] = kept.flat, kept.solution
            for name, stack in stacks.items():
                stack.append(getattr(problems, name).copy())
        tick = np.array([kept.tick for kept in self._kept])
        arrays: dict[str, Any] = {name: np.stack(stack) for name, stack in stacks.items()}
        return Recording(
            **arrays,
            claim=np.array([int(kept.claim) for kept in self._kept]),
            iterations=np.array([kept.iterations for kept in self._kept]),
            cold=np.array([kept.cold for kept in self._kept]),
            tick=tick,
            time=tick * positive("dt", dt, "s"),
            variables=tuple(variables) if variables is not None else tuple(f"x{i}" for i in range(n)),
            rows=tuple(rows) if rows is not None else tuple(f"row{i}" for i in range(m + p)),
            metadata={**(metadata or {}), "backend": self.inner.name},
        )
