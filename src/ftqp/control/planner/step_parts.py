"""The parts of a step: where they stand in the planner's record, what keeps them, what is read of them."""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from math import inf
from typing import Any, Final, NamedTuple, Protocol, final

import numpy as np

from ftqp.control.planner.free_joint import PLACES as PLACES_BESIDE_FREE
from ftqp.core.checks import FloatArray, IntArray
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.enums import JOINTS
from ftqp.kernel.layout.record import dtype
from ftqp.kernel.layout.rows import NOTHING_ASKED, Asked
from ftqp.qp.problem import SolveStatus

PLACES: Final = {
    "q": ("feedback", "q_sent"),
    "v": ("feedback", "v_sent"),
    "a": ("state", "a_command"),
    "q_reference": ("state", "q_command"),
    "v_reference": ("state", "v_command"),
    "kind": ("feedback", "kind"),
    "tau_sent": ("feedback", "tau_sent"),
    "lost": ("feedback", "lost"),
    "asks": ("feedback", "asks"),
    "brakes": ("feedback", "brakes"),
    "tau": ("state", "tau"),
    "tau_brake": ("state", "tau_brake"),
    "q_before": ("state", "q"),
    "v_before": ("state", "v"),
    "q_measured": ("feedback", "seen"),
    "sigma": ("feedback", "sigma"),
    "active": ("feedback", "active"),
    "bad": ("feedback", "bad"),
    "error": ("task", "seen"),
    "slack": ("task", "slack"),
    "row_scale": ("task", "row_scale"),
    "mode": ("task", "mode"),
    "position_error": ("task", "position_error"),
    "rotation_error": ("task", "rotation_error"),
    "scale": ("task", "scale"),
    "has_inertia": ("chain", "has_inertia"),
    "has_dynamics": ("kinematics", "has_dynamics"),
    "code": ("faults", "code"),
    "lower": ("qp", "lb"),
    "upper": ("qp", "ub"),
    "z_box": ("qp", "z_box"),
    "z": ("qp", "z"),
    "nc": ("qp", "nc"),
    "tolerance": ("qp", "tolerance"),
    "q_min": ("limits", "q_min"),
    "q_max": ("limits", "q_max"),
    "v_max": ("limits", "v_max"),
    "lower_by": ("limits", "lower_by"),
    "upper_by": ("limits", "upper_by"),
    "prismatic": ("chain", "prismatic"),
    "level": ("state", "level"),
    "ticks": ("state", "ticks"),
    "dt": ("state", "dt"),
    "stage": ("cascade", "stage"),
    "claim": ("cascade", "claim"),
    "iterations": ("cascade", "qp_iterations"),
    "residual_task": ("cascade", "residual_task"),
    "residual_bounds": ("cascade", "residual_bounds"),
    "residual_dual": ("cascade", "residual_dual"),
    "torque_excess": ("cascade", "torque_excess"),
    "kappa": ("cascade", "kappa"),
    "missed": ("cascade", "missed"),
    "given_up": ("task", "given_up"),
    "jump": ("cascade", "jump"),
    "holding": ("calm", "holding"),
    "m": ("task", "m"),
    "components": ("task", "rows"),
    "soft_error": ("terms", "error"),
    "soft_slack": ("terms", "slack"),
    "soft_asked": ("terms", "asked"),
    "asked": ("task", "asked"),
    "soft_missed": ("terms", "missed"),
    "pairs": ("scene", "pairs"),
    "distance": ("scene", "distance"),
    "nearest": ("scene", "nearest"),
    "keep": ("scene", "keep"),
    "slot": ("scene", "slot"),
    "crowded": ("scene", "crowded"),
    **PLACES_BESIDE_FREE,
}
"""Where each part of a step stands in the record: room and field."""
Off = tuple[FloatArray, str | None]
"""How far a task is from its target, and why nothing is known of that, in a sentence; None where it is."""
RESIDUALS = ("residual_task", "residual_bounds", "residual_dual")


@final
class Said:
    """What a planner writes of each step, beside the record.

    Args:
        code: The status as a number.
        duration: How long the step took [s]; None where that is not measured.
    """

    __slots__ = ("code", "duration")

    def __init__(self, code: int, duration: float | None = None) -> None:
        self.code, self.duration = code, duration


@cache
def _in_place(joints: int, rows: int) -> np.dtype[Any]:
    """The type of a step's parts where they stand in a record, of an arm of so many joints and rows of C."""
    record, formats, offsets = dtype("record"), [], []
    for name, (room, field) in PLACES.items():
        kind, at = record[room].fields[field][:2]  # type: ignore[index]
        count = int(np.prod(kind.shape, dtype=np.int64))
        if kind.shape in ((JOINTS,), (JOINTS + 1,)):
            count = joints
        formats.append((kind.base, (rows if name == "z" else count,)))
        offsets.append(record.fields[room][1] + at)  # type: ignore[index]
    layout: Any = {
        "names": list(PLACES), "formats": formats, "offsets": offsets, "itemsize": record.itemsize
    }  # fmt: skip
    return np.dtype(layout)


@cache
def _by_themselves(live: np.dtype[Any], jacobian: tuple[int, int]) -> tuple[np.dtype[Any], np.dtype[Any]]:
    """The type of a step's parts in memory of their own, with and without the Jacobian."""
    kept = np.dtype([*((name, live[name]) for name in PLACES), ("jacobian", np.float64, jacobian)])
    names = list(PLACES)
    formats, offsets = [kept[name] for name in names], [kept.fields[name][1] for name in names]  # type: ignore[index]
    beside: Any = {"names": names, "formats": formats, "offsets": offsets, "itemsize": kept.itemsize}
    return kept, np.dtype(beside)


@final
class Parts:
    """The parts of a step by name, each one-dimensional and read-only.

    Args:
        memory: They, (1,).
    """

    __slots__ = ("memory",)

    def __init__(self, memory: Any) -> None:
        self.memory = memory

    def __getitem__(self, name: str) -> Any:
        part = self.memory[name][0]
        part.flags.writeable = False
        return part

    def kept(self, jacobian: FloatArray) -> "Parts":
        """The same in memory of their own, with the task's Jacobian."""
        kept, beside = _by_themselves(self.memory.dtype, jacobian.shape)
        memory = np.zeros(1, kept)
        memory.view(beside)[:] = self.memory[list(PLACES)]
        memory["jacobian"] = jacobian
        return Parts(memory)

    @property
    def is_kept(self) -> bool:
        """Whether later steps leave them as they are."""
        return "jacobian" in self.memory.dtype.names


def parts_in(session: Session, joints: int) -> Parts:
    """The parts of a planner's step, which follow its record."""
    return Parts(session.memory.view(_in_place(joints, int(session.K.cascade.p))))


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


class Pairs(Protocol):
    """Who knows what the bodies of pairs are called."""

    @property
    def names(self) -> Sequence[tuple[str, str]]:
        """The names of each pair."""


class KeptPairs(NamedTuple):
    """The names of pairs, as they were.

    Attributes:
        names: Those of each pair.
    """

    names: Sequence[tuple[str, str]]


class Named(NamedTuple):
    """Names beside those of joints.

    Attributes:
        tasks: Of the further tasks, with how many numbers an error of each has.
        asked: Of the rows that a planner asks for, by kind.
        failed: Why tasks were left out of the tick, or targets of them, by name; None where none can be.
        pairs: The names of pairs of bodies; None where none are kept apart.
        tip: What the task of the tip is called; None leaves it out of the reports.
        judged: Which numbers of a task's error are metres, and which are angles, by name; tasks of joints and
            of one's own, whose error is not known, are left out.
        tolerance: The largest errors that count as keeping a task [m, rad].
        rows: Of the further tasks, where their rows stand among those of all, and which of them count radians
            in metres.
        length: What a radian counts there [m].
        required: Names of the further tasks that the status speaks of.
        held: Names of those on level 0.
        measured: Of tasks of joints and of one's own what measures their errors at joint positions, or their
            errors as they were, each with why nothing is known of it, by name.
    """

    tasks: tuple[tuple[str, int], ...] = ()
    asked: Asked = NOTHING_ASKED
    failed: Mapping[str, str] | None = None
    pairs: Pairs | None = None
    tip: str | None = None
    judged: Mapping[str, tuple[tuple[int, ...], tuple[int, ...]]] = {}
    tolerance: tuple[float, float] = (inf, inf)
    rows: Mapping[str, tuple[tuple[int, ...], tuple[bool, ...]]] = {}
    length: float = 1.0
    required: tuple[str, ...] = ()
    held: tuple[str, ...] = ()
    measured: Mapping[str, Callable[[FloatArray], Off] | Off] = {}

    def off(self, name: str, errors: FloatArray, q: FloatArray) -> Off:
        """How far a further task is from its target, read-only, and why nothing is known of that.

        Args:
            name: Of the task.
            errors: Of all tasks, as they stand in the record.
            q: Joint positions at which they were, (nv,) [rad or m].
        """
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

    def copy(self, q: FloatArray) -> "Named":
        """The same, which later ticks do not change.

        Args:
            q: Joint positions at which the errors are measured, (nv,) [rad or m].
        """
        kept = self if self.failed is None else self._replace(failed=dict(self.failed) or None)
        if kept.measured:
            kept = kept._replace(
                measured={name: one(q) if callable(one) else one for name, one in kept.measured.items()}
            )
        return kept if kept.pairs is None else kept._replace(pairs=KeptPairs(kept.pairs.names))


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
    """The numbers of ``Measures`` for many Jacobians, (K, 3).

    Args:
        jacobians: (K, m, nv), the columns of joints that do not work zero.
        working: how many joints work in each, (K,); with fewer than rows a direction is lost.
    """
    rows = jacobians.shape[-2]
    sigma = np.linalg.svd(jacobians, compute_uv=False)
    sigma[np.minimum(working, sigma.shape[1]) < rows] *= np.arange(sigma.shape[1]) < rows - 1
    least = sigma[:, rows - 1] if sigma.shape[1] >= rows else np.zeros(len(sigma))
    product = sigma[:, :rows].prod(axis=1) if sigma.shape[1] >= rows else np.zeros(len(sigma))
    with np.errstate(divide="ignore", invalid="ignore"):
        condition = np.where(least > 0.0, sigma[:, 0] / least, np.inf)
    return np.stack([least, product, condition], axis=1)
