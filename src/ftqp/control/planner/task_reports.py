"""What a step says of each of its tasks."""

from collections.abc import Callable, Collection, Iterator, Mapping
from typing import NamedTuple, final

import numpy as np

from ftqp.control.planner.status import StepStatus
from ftqp.core.checks import FloatArray, frozen
from ftqp.core.errors import InputError, nearest
from ftqp.kernel.layout.thresholds import TASK_FLOOR

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

    Args:
        names: Of the tasks.
        tip: What the task of the tip is called; None leaves it out.
        report: What makes one.
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
    named = ", ".join(known) or "none beside that of the tip"
    return InputError(f"there is no task {name!r:.60}{nearest(str(name), known)}; the planner's: {named}")


def task_status(kept: bool | None, slack: FloatArray, asked: FloatArray, share: float) -> StepStatus | None:
    """The status of one task."""
    if kept is None:
        return None
    left, most = np.abs(slack).max(initial=0.0), np.abs(asked).max(initial=0.0)
    if left > share * most + TASK_FLOOR:
        return StepStatus.RELAXED
    return StepStatus.OK if kept else StepStatus.LAGGING
