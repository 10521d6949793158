"""What is read of a step, and the names of what it is about."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from typing import NamedTuple, final

import numpy as np

from ftqp.control.planner.status import StepStatus
from ftqp.core.checks import FloatArray, IntArray, frozen
from ftqp.core.errors import InputError, nearest
from ftqp.kernel.layout.rows import NOTHING_ASKED, Asked
from ftqp.kernel.layout.thresholds import TASK_FLOOR
from ftqp.qp.problem import SolveStatus

Off = tuple[FloatArray, str | None]
"""How far a task is from its target, and why nothing is known of that, in a sentence; None where it is."""
Bodies = Sequence[tuple[str, str]]
RESIDUALS = ("residual_task", "residual_bounds", "residual_dual")


@final
@dataclass(slots=True)
class StepHeader:
    """What a planner writes of each step, beside the record."""

    code: int
    duration: float | None = None


class Reference(NamedTuple):
    """A state of the arm that the planner commands.

    Attributes:
        q: Joint positions, (nv,) [rad or m].
        v: Joint velocities, (nv,) [rad/s or m/s].
        a: Joint accelerations of the step, (nv,) [rad/s2 or m/s2].
    """

    q: FloatArray
    v: FloatArray
    a: FloatArray


class QPReport(NamedTuple):
    """How the QP of a step went.

    Attributes:
        status: What the residuals made of the solver's answer; None when the step needed no task QP.
        iterations: Of the solver, in its own counting.
        residual: The largest of the scaled residuals below, of the QP that gave the command.
        residual_task: The largest error of a task row, slack counted, over 1 + the largest right side.
        residual_bounds: The largest violation of a row of C, over 1 + the largest entry of x.
        residual_dual: The largest error of stationarity, over 1 + the norm of its terms.
        time: Duration of the whole step [s], or None unless the planner was made with ``timing=True``.
    """

    status: SolveStatus | None
    iterations: int
    residual: float
    residual_task: float
    residual_bounds: float
    residual_dual: float
    time: float | None


class StepLabels(NamedTuple):
    """Names beside those of joints."""

    # Of the further tasks, with how many numbers an error of each has
    tasks: tuple[tuple[str, int], ...] = ()
    asked: Asked = NOTHING_ASKED  # Of the rows that a planner asks for, by kind
    # Why tasks were left out of the tick, or targets of them, by name; None where none can be
    failed: Mapping[str, str] | None = None
    # Says the names of pairs of bodies that are kept apart, or those as they were
    pairs: Callable[[], Bodies] | Bodies = ()
    tip: str | None = None  # What the task of the tip is called; None leaves it out of the reports
    # Which numbers of a task's error are metres, and which are angles, by name; tasks of joints and of one's
    # own, whose error is not known, are left out
    judged: Mapping[str, tuple[tuple[int, ...], tuple[int, ...]]] = {}
    tolerance: tuple[float, float] = (inf, inf)  # The largest errors that count as keeping a task [m, rad]
    # Of the further tasks, where their rows stand among those of all, and which of them count radians in
    # metres
    rows: Mapping[str, tuple[tuple[int, ...], tuple[bool, ...]]] = {}
    length: float = 1.0  # What a radian counts there [m]
    required: tuple[str, ...] = ()  # Names of the further tasks that the status speaks of
    held: tuple[str, ...] = ()  # Names of those on level 0
    # Of tasks of joints and of one's own what measures their errors at joint positions, or their errors as
    # they were, each with why nothing is known of it, by name
    measured: Mapping[str, Callable[[FloatArray], Off] | Off] = {}

    @property
    def bodies(self) -> Bodies:
        """The names of each pair of bodies that are kept apart."""
        return self.pairs() if callable(self.pairs) else self.pairs

    def off(self, name: str, errors: FloatArray, q: FloatArray) -> Off:
        """How far a further task is from its target, read-only, and why nothing is known of that."""
        found = self.measured.get(name)
        if found is not None:
            return found(q) if callable(found) else found
        at, size = next((6 * k, size) for k, (other, size) in enumerate(self.tasks) if other == name)
        return errors[at : at + size], None

    def slack(self, name: str, slacks: FloatArray) -> FloatArray:
        """What the command leaves of each row of a further task, or what they ask for, (m,)."""
        rows, turns = self.rows[name]
        result: FloatArray = slacks[list(rows)]
        result[list(turns)] /= self.length
        return result

    def kept(self, name: str, error: FloatArray) -> bool | None:
        """Whether an error of a task is within the tolerances; None where nothing is known of it."""
        if name not in self.judged:
            return None
        places, angles = self.judged[name]
        position, rotation = np.linalg.norm(error[list(places)]), np.linalg.norm(error[list(angles)])
        return bool(position <= self.tolerance[0] and rotation <= self.tolerance[1])

    def copy(self, q: FloatArray) -> "StepLabels":
        """The same, which later ticks do not change."""
        kept = self if self.failed is None else self._replace(failed=dict(self.failed) or None)
        if kept.measured:
            kept = kept._replace(
                measured={name: one(q) if callable(one) else one for name, one in kept.measured.items()}
            )
        return kept._replace(pairs=kept.bodies)


class Measures(NamedTuple):
    """How near the arm is to losing a direction of its task.

    Attributes:
        sigma_min: Smallest singular value of the task's Jacobian over the working joints, metres by the
            length.
        manipulability: The product of all singular values.
        condition: The largest by the smallest; inf where a direction is lost.
    """

    sigma_min: float
    manipulability: float
    condition: float


def measures_of(jacobians: FloatArray, working: IntArray) -> FloatArray:
    """The numbers of ``Measures`` for many Jacobians, (K, 3)."""
    rows = jacobians.shape[-2]
    sigma = np.linalg.svd(jacobians, compute_uv=False)
    sigma[np.minimum(working, sigma.shape[1]) < rows] *= np.arange(sigma.shape[1]) < rows - 1
    least = sigma[:, rows - 1] if sigma.shape[1] >= rows else np.zeros(len(sigma))
    product = sigma[:, :rows].prod(axis=1) if sigma.shape[1] >= rows else np.zeros(len(sigma))
    with np.errstate(divide="ignore", invalid="ignore"):
        condition = np.where(least > 0.0, sigma[:, 0] / least, np.inf)
    return np.stack([least, product, condition], axis=1)


TIP = "tip"
"""What the task of the tip is called beside the name of its frame."""


class TaskReport(NamedTuple):
    """How far a task was from its target before a step.

    Attributes:
        error: Of a point from it to its target, along W, (3,) [m], rows that are not asked for included; of a
            frame that and the rotation vector that turns it onto its target, (6,) [m and rad]; of an axis the
            rotation that turns it onto its direction, (3,), its length the sine of the angle, 1 beyond a
            right angle; of joints from each of them to its place, (k,) [rad or m]; of a kind of one's own
            what its ``error`` says, (1,), NaN where it says nothing, as of ``LeastSquares``.
        failed: Why the task was left out of the step, or the last target that was given, in a sentence: its
            own function failed, or that target was not finite, so that the one before stays. None of others.
        kept: Whether the rows that it asks for are within the tolerances of the tip's ``Task``; None of
            tasks of joints and of one's own.
        slack: J x - b of its rows, (m,) [m/s2 and rad/s2; m/s and rad/s at the velocity level]: what the
            command leaves of what they ask for; 0 while the arm is brought to rest, and none of tasks of
            joints.
        status: RELAXED where the command leaves more of it than counts as none (of the tip and of level 0 a
            thousandth of what it asks for, of the others half), else LAGGING where it is not kept, else OK;
            None of tasks of joints and of one's own. That of the step is about those that are required.
    """

    error: FloatArray
    failed: str | None = None
    kept: bool | None = None
    slack: FloatArray = frozen(np.empty(0))
    status: StepStatus | None = None


@final
class TaskReports(Mapping[str, TaskReport]):
    """The reports of a step by the names of its tasks, each made when it is looked up.

    The task of the tip goes by the name of its frame, and by ``tip``.
    """

    __slots__ = ("_names", "_report", "_tip")

    def __init__(self, names: tuple[str, ...], tip: str | None, report: Callable[[str], TaskReport]) -> None:
        self._names, self._tip, self._report = names, tip, report

    def __getitem__(self, name: str) -> TaskReport:
        if name == TIP and self._tip is not None:
            name = self._tip
        if name not in self._names:
            raise no_task(name, self._names)
        return self._report(name)

    def __contains__(self, name: object) -> bool:
        return name in self._names or (name == TIP and self._tip is not None)

    def get(self, name: str, default: TaskReport | None = None) -> TaskReport | None:  # type: ignore[override]
        """The report of a task, or something else where there is no such task."""
        if name not in self:
            return default
        return self[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __repr__(self) -> str:
        return repr(dict(self))


def no_task(name: object, known: Collection[str]) -> InputError:
    """The error for the name of a task that there is not."""
    named = ", ".join(known) or "that of the end effector alone"
    return InputError(f"there is no task {name!r:.60}{nearest(str(name), known)}; the planner has {named}")


def task_status(kept: bool | None, slack: FloatArray, asked: FloatArray, share: float) -> StepStatus | None:
    """The status of one task."""
    if kept is None:
        return None
    left, most = np.abs(slack).max(initial=0.0), np.abs(asked).max(initial=0.0)
    if left > share * most + TASK_FLOOR:
        return StepStatus.RELAXED
    return StepStatus.OK if kept else StepStatus.LAGGING
