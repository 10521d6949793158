"""A recorded sequence of QPs, ready to be solved again and again."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from comparison.sequences import feasible

from ftqp.core.checks import BoolArray, FloatArray
from ftqp.qp import QP, QPBuffers
from ftqp.qp.recording.recorded_qps import Recording

ORIGIN = ("robot", "scheme", "level", "task_mode", "faults", "dt", "what")
"""What a result repeats of a recording's metadata."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recorded:
    """K QPs of one size in the order in which a planner met them.

    Attributes:
        name: The name of the sequence.
        problems: The QPs, K.
        packed: Each as ``QPBuffers.flat`` has it, (K, size).
        solutions: What the recorder has of (x, y, z, z_box) for each, K.
        origin: Robot, scheme, level and so on, as far as the recorder wrote them down (``ORIGIN``).
        feasible: What a linear program said of each, (K,), or None when nobody asked one.
    """

    name: str
    problems: list[QP]
    packed: FloatArray
    solutions: list[tuple[FloatArray, ...]]
    origin: dict[str, Any]
    feasible: BoolArray | None = None

    def __len__(self) -> int:
        return len(self.problems)

    @property
    def size(self) -> tuple[int, int, int]:
        """Variables, equality rows and two-sided rows."""
        first = self.problems[0]
        return first.n, first.m, first.p

    def buffers(self) -> QPBuffers:
        """Buffers of this size, holding the first QP."""
        made = QPBuffers.zeros(*self.size)
        made.flat[:] = self.packed[0]
        return made


def recorded(name: str, recording: Recording) -> Recorded:
    """A recording made ready."""
    problems = [recording.problem(k) for k in range(len(recording))]
    solutions = [
        (recording.x[k], recording.y[k], recording.z[k], recording.z_box[k]) for k in range(len(recording))
    ]
    return Recorded(
        name=name,
        problems=problems,
        packed=np.array([_flat(problem) for problem in problems]),
        solutions=solutions,
        origin={key: recording.metadata[key] for key in ORIGIN if key in recording.metadata},
        feasible=feasible(recording) if "infeasible_ticks" in recording.metadata else None,
    )


def _flat(problem: QP) -> FloatArray:
    made = QPBuffers.zeros(problem.n, problem.m, problem.p)
    for part in ("H", "g", "A", "b", "C", "l", "u", "lb", "ub"):
        getattr(made, part)[...] = getattr(problem, part)
    made.upper[problem.n : problem.n + problem.m] = problem.b
    return made.flat
