"""How long solvers take for recorded QPs: the measuring half of compare_speed."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from time import perf_counter_ns
from typing import Any

import numpy as np
from bench.contenders import Contender
from bench.isolation import Apart
from comparison.accuracy import STARTS
from comparison.recorded import Recorded
from comparison.truth import relative_residuals

from ftqp.qp import Backend, Claim, QPBuffers
from ftqp.qp.answer_check import ACCEPTANCE

EMPTY = "empty"
"""A backend that solves nothing: what the interface itself costs."""
DISCARD = 3
"""Solves at the head of each turn that bring the solver back into the caches, not counted."""
FEWEST = 100
"""Fewest times that a 99 % quantile is made of."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """How much is measured.

    Attributes:
        samples: Timed solves of each contender, start and sequence.
        seconds: Time after which a contender has no further turn with a sequence and start [s].
        turn: Timed solves before the next contender has its turn.
        turn_seconds: Time after which a turn ends early [s].
        setups: Timed set-ups of each contender and sequence.
    """

    samples: int
    seconds: float
    turn: int
    turn_seconds: float
    setups: int


FULL = Settings(samples=2000, seconds=0.3, turn=50, turn_seconds=0.05, setups=9)
QUICK = Settings(samples=12, seconds=0.005, turn=6, turn_seconds=0.005, setups=2)


class Empty(Backend):
    """Solves nothing."""

    package = "ftqp"

    def __init__(self) -> None:
        super().__init__(EMPTY)

    def _prepare(self, qp: QPBuffers) -> None:
        """Nothing to prepare."""

    def _run(self, qp: QPBuffers, cold: bool) -> Claim:
        return Claim.SOLVED


@dataclass(slots=True, eq=False)
class Runner:
    """One contender on one sequence from one kind of start, and how far along the sequence it is.

    Attributes:
        name: The contender's name.
        start: ``cold`` or ``warm``.
        solver: The backend, set up.
        qp: The buffers that it reads.
        sequence: What it solves.
        right: Answers of the first pass that were claimed solved and have small residuals.
        ns: Times of single solves [ns].
        spent: All of its time so far [ns].
    """

    name: str
    start: str
    solver: Backend
    qp: QPBuffers
    sequence: Recorded
    right: int = 0
    ns: list[int] = field(default_factory=list)
    spent: int = 0
    _k: int = 0
    _claim: Claim = Claim.FAILED

    def first_pass(self) -> None:
        """The whole sequence untimed; counts the right answers."""
        for problem in self.sequence.problems:
            self._next()
            if self._claim is Claim.SOLVED:
                found = relative_residuals(problem, self.qp.x, self.qp.y, self.qp.z, self.qp.z_box)
                self.right += int(found.max() <= ACCEPTANCE)

    def turn(self, settings: Settings) -> None:
        """Timed solves; those that bring it back into the caches and cold ones of a warm run do not count."""
        end = self.spent + round(1e9 * settings.turn_seconds)
        for i in range(DISCARD + settings.turn):
            first = self._k == 0
            taken = self._next()
            self.spent += taken
            if i >= DISCARD and not (first and self.start == "warm"):
                self.ns.append(taken)
            if self.ns and self.spent > end:
                break

    def done(self, settings: Settings) -> bool:
        """Whether it has had its samples or its time."""
        return len(self.ns) >= settings.samples or (bool(self.ns) and self.spent >= 1e9 * settings.seconds)

    def _next(self) -> int:
        """Solve the next QP; the time of the solve alone [ns]."""
        k, solve = self._k, self.solver.solve
        self.qp.flat[:] = self.sequence.packed[k]
        cold = self.start == "cold" or k == 0
        before = perf_counter_ns()
        claim = solve(cold=cold)
        after = perf_counter_ns()
        self._claim = claim
        self._k = (k + 1) % len(self.sequence)
        return after - before

    def row(self, solvable: int) -> dict[str, Any]:
        """Times [us], p99 None for too few of them; how many of the solvable QPs are solved [%]."""
        us = np.array(self.ns) / 1e3
        return {
            "p50": round(float(np.median(us)), 3),
            "p99": round(float(np.percentile(us, 99.0)), 3) if len(us) >= FEWEST else None,
            "worst": round(float(us.max()), 3),
            "samples": len(us),
            "solved": round(100.0 * self.right / solvable, 2) if solvable else None,
        }


_HELD: dict[str, Runner] = {}
"""The runners of this process, by start; a process apart has those of one contender."""


def prepared(name: str, who: Contender | None, sequence: Recorded, settings: Settings) -> list[float]:
    """Set a contender up in this process, from either start, solve everything once: times of set-ups [us].

    Args:
        name: Its name.
        who: It; None is the empty backend.
        sequence: What it solves.
        settings: How much is measured.

    Raises:
        FtqpError: It cannot take part.
    """
    make = Empty if who is None else who.made
    _set_up(make(), sequence)  # the first one in a process loads code
    setups = [_set_up(make(), sequence)[2] for _ in range(settings.setups)]
    for start in STARTS:
        solver, qp, _ = _set_up(make(), sequence)
        _HELD[start] = Runner(name=name, start=start, solver=solver, qp=qp, sequence=sequence)
        _HELD[start].first_pass()
    return setups


def turn(start: str, settings: Settings) -> bool:
    """One turn of the contender of this process; whether it has had all of them."""
    runner = _HELD[start]
    runner.turn(settings)
    return runner.done(settings)


def row(start: str, solvable: int) -> dict[str, Any]:
    """What was measured of the contender of this process."""
    return _HELD[start].row(solvable)


def measured(
    contenders: Sequence[Contender],
    processes: Mapping[str, Apart],
    sequence: Recorded,
    settings: Settings,
    solvable: int,
) -> tuple[list[dict[str, Any]], dict[str, str]]:
    """One sequence over all contenders, their turns interleaved.

    Returns:
        one cell a contender and start, and why others could not take part, by name.
    """
    left_out: dict[str, str] = {}
    setups: dict[str, list[float]] = {}

    def asked(name: str, work: Callable[..., Any], *arguments: Any) -> Any:
        ended = processes[name].ask(work, *arguments)
        if ended.reason:
            left_out[name] = ended.reason
        return ended.answer

    for name, who in {EMPTY: None, **{who.name: who for who in contenders}}.items():
        setups[name] = asked(name, prepared, name, who, sequence, settings)
    going = [(name, start) for name in setups for start in STARTS]
    round_number = 0
    while going := [one for one in going if one[0] not in left_out]:
        first, ended = round_number % len(going), set()
        for name, start in going[first:] + going[:first]:
            if name not in left_out and asked(name, turn, start, settings):
                ended.add((name, start))
        going = [one for one in going if one not in ended]
        round_number += 1
    cells = []
    for name, times in setups.items():
        for start in STARTS:
            found = None if name in left_out else asked(name, row, start, solvable)
            if found is not None:
                about = {"contender": name, "sequence": sequence.name, "start": start}
                cells.append({**about, **found, "setup": round(float(np.median(times)), 3)})
    return cells, left_out


def _set_up(solver: Backend, sequence: Recorded) -> tuple[Backend, QPBuffers, float]:
    """The backend set up on fresh buffers, and how long that took [us]."""
    qp = sequence.buffers()
    before = perf_counter_ns()
    solver.setup(qp)
    return solver, qp, (perf_counter_ns() - before) / 1e3


def on_one_core() -> str:
    """Bind this process to one core, the last one it may use; says which, or why not."""
    try:
        core = max(os.sched_getaffinity(0))
        os.sched_setaffinity(0, {core})
    except (AttributeError, OSError) as error:
        return f"any ({error})"
    return str(core)
