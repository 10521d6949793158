"""Step: what one tick gives back, read from the planner's record when it is asked for."""

import re
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, Final, NoReturn, final

import numpy as np

from ftqp.control.planner.certificate import (
    HELD,
    Certificate,
    Obstacle,
    instead,
    missed_tasks,
    obstacles,
    outside,
    too_near,
    unreached,
    unused,
    without_bound,
)
from ftqp.control.planner.free_joint import ON_TASK, Impact, impact, notice
from ftqp.control.planner.status import STATUSES, StepStatus
from ftqp.control.planner.step_parts import (
    RESIDUALS,
    Measures,
    QPReport,
    Reference,
    StepHeader,
    StepLabels,
    TaskReport,
    TaskReports,
    measures_of,
    task_status,
)
from ftqp.core.checks import BoolArray, FloatArray
from ftqp.core.small_picture import html_table
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.enums import (
    ALL_BRAKES,
    EACH_BRAKE,
    FALLBACK,
    HARD,
    HEALTHY,
    INVALID_INPUT,
    JOINTS,
    RELAXED,
    TORQUE_DRIVE,
    VELOCITY,
    Claim,
    Kept,
)
from ftqp.kernel.layout.record import dtype
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.kernel.layout.thresholds import MISSED_FROM, RELAXED_FROM
from ftqp.qp.problem import SolveStatus

NO_LABELS = StepLabels()
_ON_TASK = (StepStatus.OK, StepStatus.RELAXED, StepStatus.SCALED)
_ROWS_OF = {Kept.NOTHING: 0, Kept.POSITION: 3, Kept.POSITION_AXIS: 5, Kept.POSE: 6}
"""How many rows of a pose each set has; a task of fewer rows has fewer."""
_SOLVE_STATUSES = tuple(SolveStatus[claim.name] for claim in Claim)
"""What the residuals made of an answer, in the order of the kernel's claims."""
ROUNDING = 10.0
"""A torque excess below so many tolerances of the solver is rounding."""


PARTS: Final = """
feedback: q=q_sent v=v_sent kind tau_sent lost asks brakes q_measured=seen sigma active bad
state: a=a_command q_reference=q_command v_reference=v_command tau tau_brake q_before=q v_before=v level
    ticks dt
task: error=seen slack row_scale mode position_error rotation_error scale given_up m components=rows asked
chain: has_inertia prismatic
kinematics: has_dynamics
faults: code viscous=friction coulomb
qp: lower=lb upper=ub z_box z nc tolerance
limits: q_min q_max v_max lower_by upper_by
cascade: stage claim iterations=qp_iterations residual_task residual_bounds residual_dual torque_excess
    kappa missed jump
settling: holding
terms: soft_error=error soft_slack=slack soft_asked=asked soft_missed=missed
scene: pairs distance nearest keep slot crowded
free: free_joint=joint free_mode=mode free_rows=rows impact_side impact_time impact_speed impact_energy
    swing reach drift drift_time contact tau_stop
"""
"""Each part of a step by the name of its field in a room of the record, or by its own name before that."""
PLACES: Final = {
    word.partition("=")[0]: (room, word.rpartition("=")[2])
    for room, words in re.findall(r"(\w+): ([^:]+)(?=\n\w+:|\n$)", PARTS)
    for word in words.split()
}
"""Where each part of a step stands in the record: room and field."""


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
    made: np.dtype[Any] = np.dtype(layout)
    return made


@cache
def _by_themselves(live: np.dtype[Any], jacobian: tuple[int, int]) -> tuple[np.dtype[Any], np.dtype[Any]]:
    """The type of a step's parts in memory of their own, with and without the Jacobian."""
    kept = np.dtype([*((name, live[name]) for name in PLACES), ("jacobian", np.float64, jacobian)])
    names = list(PLACES)
    formats, offsets = [kept[name] for name in names], [kept.fields[name][1] for name in names]  # type: ignore[index]
    beside: Any = {"names": names, "formats": formats, "offsets": offsets, "itemsize": kept.itemsize}
    return kept, np.dtype(beside)


@final
class Parts(dict[str, FloatArray]):
    """The parts of a step by name, each one-dimensional and read-only, looked up when first read."""

    __slots__ = ("memory",)

    def __init__(self, memory: Any) -> None:
        super().__init__()
        self.memory = memory

    def __missing__(self, name: str) -> FloatArray:
        part: FloatArray = self.memory[name][0]
        part.flags.writeable = False
        self[name] = part
        return part

    def kept(self, jacobian: FloatArray) -> "Parts":
        """The same in memory of their own, with the task's Jacobian."""
        kept, beside = _by_themselves(self.memory.dtype, jacobian.shape)
        memory = np.zeros(1, kept)
        memory.view(beside)[:] = self.memory[list(PLACES)]
        memory["jacobian"] = jacobian
        return Parts(memory)


def parts_in(session: Session, joints: int) -> Parts:
    """The parts of a planner's step, which follow its record."""
    rows = int(session.K.cascade.p) + (
        joints if session.K.chain.has_inertia else 0
    )  # those there seldom, too
    return Parts(session.memory.view(_in_place(joints, rows)))


def parts_of_free(session: Session, joints: int) -> dict[str, Any]:
    """The parts that are about joints that swing freely, looked up once."""
    parts = parts_in(session, joints)
    return {name: parts[name] for name, (room, _) in PLACES.items() if room in ("free", "faults")}


class Step:
    """One command and what there is to know of it.

    It belongs to the planner and is valid until its next step; ``copy()`` keeps one, and a copy can be
    pickled. Its properties are looked up or computed when they are read.

    Args:
        session: The planner's, whose record the step reads; None of a copy.
        joints: Names of the joints, (nv,).
        parts: Where its numbers stand.
        said: What the planner writes of each step.
        named: Names of the further tasks, and of the rows that are asked for.

    Attributes:
        q: The joint positions to be sent, for the end of the step, (nv,) [rad or m].
        v: The joint velocities to be sent, (nv,) [rad/s or m/s]; exactly 0.0 for a locked joint.
        a: The joint accelerations of the command, (nv,) [rad/s2 or m/s2]; exactly 0.0 for a locked joint.
        task_error: From the measured end effector to the target, along W, (6,): position [m], rotation vector
            [rad].

    All arrays are views that cannot be written; ``step.q.copy()`` can.
    """

    __slots__ = ("_joints", "_named", "_parts", "_said", "_session", "a", "q", "task_error", "v")
    q: FloatArray
    v: FloatArray
    a: FloatArray
    task_error: FloatArray
    _session: Session | None
    _joints: tuple[str, ...]
    _parts: Parts
    _said: StepHeader
    _named: StepLabels

    def __init__(
        self, session: Session | None, joints: Sequence[str], parts: Parts, said: StepHeader,
        named: StepLabels = NO_LABELS,
    ) -> None:  # fmt: skip
        own: dict[str, Any] = {"_session": session, "_joints": tuple(joints), "_parts": parts}
        own |= {"_said": said, "_named": named}
        own |= {"q": parts["q"], "v": parts["v"], "a": parts["a"], "task_error": parts["error"]}
        for name, value in own.items():
            object.__setattr__(self, name, value)

    def __setattr__(self, name: str, value: Any) -> NoReturn:
        raise AttributeError(
            f"step.{name} cannot be set: a step is what the planner has said; change a copy, "
            "q = step.q.copy(), and give what you measure to planner.step"
        )

    @property
    def code(self) -> int:
        """The status as a number, the position of ``status`` in ``StepStatus``."""
        return self._said.code

    @property
    def duration(self) -> float | None:
        """How long the step took [s]; None unless the planner was made with ``timing=True``."""
        return self._said.duration

    def _number(self, name: str) -> float:
        return float(self._parts[name][0])

    @property
    def status(self) -> StepStatus:
        """What the step says to the operator."""
        return STATUSES[self._said.code]

    @property
    def tau(self) -> FloatArray:
        """Motor torque for the command, (nv,) [N m or N]; 0.0 for a failed joint, NaN without inertia."""
        return self._torques("tau")

    @property
    def tau_brake(self) -> FloatArray:
        """Torque that the brake of a locked joint carries, (nv,) [N m or N]; 0.0 for every other joint."""
        return self._torques("tau_brake")

    @property
    def reference(self) -> Reference:
        """The planner's own state at the end of the step, which the loops of the drive hold the arm to."""
        return Reference(self._parts["q_reference"], self._parts["v_reference"], self.a)

    @property
    def brakes(self) -> BoolArray:
        """Which joints ask for their brakes, (nv,).

        A joint that is out of hand asks for its brake, whatever the drive: one that a stop does not hold, or
        that is far faster than its limit and its command. A torque arm cannot hold a joint that it no longer
        sees, either; an arm that takes positions or velocities holds it by its own servo. Where the drive
        says ``brakes="all"`` all are asked for as soon as one is, and with ``"none"`` none ever is.
        """
        asks: BoolArray = self._parts["asks"] != 0
        if self._takes_torques():
            asks = asks | (self._parts["lost"] != 0)
        brakes = self._parts["brakes"][0]
        if brakes == EACH_BRAKE:
            return asks
        return np.full(len(asks), brakes == ALL_BRAKES and bool(asks.any()))

    @property
    def tau_stop(self) -> FloatArray:
        """Torque of the end stop that a free-swinging joint rests on, (nv,) [N m or N]; 0.0 elsewhere."""
        return self._parts["tau_stop"]

    @property
    def rows(self) -> tuple[str, ...]:
        """The rows of the task that are kept: less than all while a joint swings freely, none in a stop."""
        parts = self._parts
        if self.status not in _ON_TASK:
            return ()
        own = tuple(COMPONENTS[int(c)] for c in parts["components"][: int(parts["m"][0])])
        if parts["free_joint"][0] < 0 or parts["free_mode"][0] in ON_TASK:
            return own
        return own[: _ROWS_OF[Kept(int(parts["free_rows"][0]))]]

    @property
    def impact(self) -> Impact | None:
        """The impact of a free-swinging joint on its end stop that is ahead; None where none is seen."""
        return impact(self._parts)

    @property
    def notice(self) -> str | None:
        """What the operator should know now, in a sentence; None where there is nothing.

        It is of a joint that swings freely, or of the input that is not used (``INVALID_INPUT``).
        """
        if self.code == INVALID_INPUT:
            return unused(self._parts, self._joints)
        return notice(self._parts, self._joints)

    def _torques(self, name: str) -> FloatArray:
        parts = self._parts
        if name == "tau" and self._takes_torques():
            return parts["tau_sent"]
        if not parts["has_dynamics"][0]:
            if not parts["has_inertia"][0]:
                return np.full(len(self._joints), np.nan)
            if self._session is not None:
                self._session.torques()
        return parts[name]

    def _takes_torques(self) -> bool:
        """Whether torques are what is sent to the arm."""
        return bool(self._parts["kind"][0] == TORQUE_DRIVE)

    @property
    def position_error(self) -> float:
        """Norm of the position error over the task's rows [m]."""
        return self._number("position_error")

    @property
    def rotation_error(self) -> float:
        """Norm of the rotation error over the task's rows [rad]."""
        return self._number("rotation_error")

    @property
    def holding(self) -> bool:
        """Whether the arm rests although its error is left, because hardly anything of it can be removed.

        It goes on as soon as the target moves, or another set of joints works.
        """
        return bool(self._number("holding"))

    @property
    def tasks(self) -> TaskReports:
        """How far each task was from its target before it, by name; the end effector's by its frame's."""
        named = self._named
        names = tuple(name for name, _ in named.tasks)
        return TaskReports(names if named.tip is None else (named.tip, *names), named.tip, self._report)

    def _report(self, name: str) -> TaskReport:
        """What there is to say of one task."""
        named, parts = self._named, self._parts
        if name == named.tip:
            error, why, failed = self.task_error, None, None
            slack, asked, share = self.slack, self._per_row(parts["asked"]), RELAXED_FROM
        else:
            error, why = named.off(name, parts["soft_error"], parts["q_before"])
            failed = None if named.failed is None else named.failed.get(name)
            slack, asked = (named.slack(name, parts[part]) for part in ("soft_slack", "soft_asked"))
            share = RELAXED_FROM if name in named.held else MISSED_FROM
        kept = named.kept(name, error)
        return TaskReport(error, failed or why, kept, slack, task_status(kept, slack, asked, share))

    @property
    def slack(self) -> FloatArray:
        """A x - b of the task rows, (m,) [m/s2 and rad/s2; m/s and rad/s at the velocity level]."""
        return self._per_row(self._parts["slack"])

    def _per_row(self, values: FloatArray) -> FloatArray:
        """Values of the task rows with radians in place of metres, (m,)."""
        parts = self._parts
        m = int(parts["m"][0])
        return values[:m] / parts["row_scale"][parts["components"][:m].astype(np.intp)]

    @property
    def scale(self) -> float:
        """Path scale of the ``scaled`` mode, 1 at full speed; 0 while stopping."""
        return self._number("scale")

    @property
    def jacobian(self) -> FloatArray:
        """The task's rows over the joints, (m, nv), angular ones times and all divided by the length [-].

        Columns of joints that do not work are zero, so that its singular values are those of the reduced
        Jacobian.
        """
        parts, n = self._parts, len(self._joints)
        if self._session is None:
            return parts["jacobian"]
        field = self._session.field
        A: FloatArray = field("qp", "A")[: int(parts["m"][0]), :n] / field("task", "length")
        if field("turned", "on")[0]:
            A = field("turned", "U")[: len(A), : len(A)] @ A
        np.copyto(A, 0.0, where=parts["code"] != HEALTHY)
        return A

    @property
    def measures(self) -> Measures:
        """sigma_min, manipulability and condition at once; computed when read.

        Source: Yoshikawa 1985 for the product of the singular values.
        """
        working = np.array([np.count_nonzero(self._parts["code"] == HEALTHY)])
        return Measures(*measures_of(self.jacobian[None], working)[0].tolist())

    @property
    def sigma_min(self) -> float:
        """Smallest singular value of the task's Jacobian over the working joints, metres by the length.

        0 when fewer joints work than the task has rows.
        """
        return self.measures.sigma_min

    @property
    def manipulability(self) -> float:
        """sqrt(det J J') of the same Jacobian."""
        return self.measures.manipulability

    @property
    def condition(self) -> float:
        """Largest by smallest singular value of the same Jacobian; inf where a direction is lost."""
        return self.measures.condition

    @property
    def kappa(self) -> float:
        """Damping of a singularity-robust inverse, in squared singular values; 0 without damping."""
        return self._number("kappa")

    @property
    def lower(self) -> FloatArray:
        """Lower end of every joint's interval, (nv,), in units of the decision variable."""
        return self._parts["lower"]

    @property
    def upper(self) -> FloatArray:
        """Upper end of every joint's interval, (nv,), in units of the decision variable."""
        return self._parts["upper"]

    @property
    def torque_excess(self) -> float:
        """By how much the command breaks torque limits [N m or N]; 0 unless no motion could keep them.

        It is the largest over the motors that work and, as a whole, what a free-swinging joint would need.
        """
        excess, rounding = self._number("torque_excess"), ROUNDING * self._number("tolerance")
        if self._number("level") == VELOCITY:
            rounding /= self._number("dt")
        return excess if excess > rounding else 0.0

    @property
    def outside(self) -> tuple[str, ...]:
        """The joints that were beyond their limits before the step, in their order; then it is never OK.

        Beyond its range as measured, noise aside, or as sent, a failed joint beyond its healthy one; or
        working, and faster than its limit.
        """
        names = dict.fromkeys(found.joint for found in outside(self._parts, self._joints))
        return tuple(joint for joint in self._joints if joint in names)

    @property
    def limits_active(self) -> tuple[str, ...]:
        """The limits that hold the command back, such as ``panda_joint2 upper position``."""
        return tuple(
            f"{obstacle.joint} {obstacle.limit}"
            for obstacle in self._obstacles()
            if obstacle.limit not in ("locked", HELD)
        )

    def _obstacles(self) -> list[Obstacle]:
        named, has_inertia = self._named, bool(self._number("has_inertia"))
        return obstacles(self._parts, self._joints, has_inertia, named.asked, named.bodies)

    @property
    def clearance(self) -> float:
        """The least distance of two bodies that are kept apart [m], inf where none are.

        It is that of the posture to which the velocity before the step led.
        """
        return self._number("distance") if self._number("pairs") else np.inf

    @property
    def nearest(self) -> tuple[str, str] | None:
        """The two bodies that are nearest to each other, of those that are kept apart; None without."""
        pairs = self._named.bodies
        at = int(self._parts["nearest"][0])
        return pairs[at] if 0 <= at < len(pairs) else None

    @property
    def certificate(self) -> Certificate | None:
        """Why the task is not followed exactly, or None when it is (or when no task was attempted)."""
        if self.status not in (StepStatus.RELAXED, StepStatus.FALLBACK):
            return None
        slack, bounds = self.slack, tuple(self._obstacles())
        if not self._parts["missed"][0] and self.status is StepStatus.RELAXED:
            slack = np.zeros_like(slack)
        beyond = tuple(outside(self._parts, self._joints))
        beside = instead(self._parts, self.notice, self.torque_excess)
        beside += too_near(self._parts, self.nearest) + missed_tasks(self._parts, self._named)
        jump = self._number("jump")
        if not (slack.any() or beyond or beside or jump < 1.0):
            slack = self.slack  # less than counts as missed is what is left
        missing = tuple(unreached(self._parts, slack))
        free = missing and not bounds
        return Certificate(
            unreached=missing,
            obstacles=bounds,
            outside=beyond,
            jump=jump,
            without_bound=without_bound(self._parts, self.jacobian, self.code) if free else "",
            instead=beside,
        )

    @property
    def qp(self) -> QPReport:
        """How the QP went."""
        parts = self._parts
        claim = int(parts["claim"][0])
        status = None if claim < 0 else _SOLVE_STATUSES[claim]
        fell_back = self.code == FALLBACK
        missed = self.code == RELAXED and parts["mode"][0] == HARD and parts["missed"][0]
        if (status is SolveStatus.SOLVED and (fell_back or missed)) or (
            status is SolveStatus.INFEASIBLE and fell_back
        ):
            status = SolveStatus.FAILED
        task, bounds, dual = (float(parts[name][0]) for name in RESIDUALS)
        return QPReport(
            status, int(parts["iterations"][0]), max(task, bounds, dual), task, bounds, dual, self.duration
        )

    def keeper(self, rows: FloatArray, first: int, rest: int) -> Callable[[int, int], int]:
        """What writes the planner's last step into a row, called with the row's number and `code`, for logs.

        Args:
            rows: The numbers of many steps, (K, width); they live as long as what is returned does.
            first: The place in a row of ``a``, ``tau``, ``tau_brake``, ``lower`` and ``upper``, nv each.
            rest: The place of slack (6), Jacobian (6 nv) and single numbers, see
                `ftqp.kernel.ticks.kept_row.keep_step`.
        """
        assert self._session is not None
        return self._session.bind("keep_step", rows, *rows.shape, first, rest)

    def copy(self) -> "Step":
        """A step of its own, which later steps of the planner do not touch."""
        self.fill_in()
        named = self._named.copy(self._parts["q_before"])
        return _kept(self._joints, self._parts.kept(self.jacobian).memory, self.code, self.duration, named)

    def fill_in(self) -> None:
        """Work out now what would be worked out when it is read, as the planner's arm becomes another."""
        if self._parts["ticks"][0] > 0:
            self._torques("tau_brake")

    def __copy__(self) -> "Step":
        return self.copy()

    def __deepcopy__(self, memo: Any) -> "Step":
        return self.copy()

    def __reduce__(self) -> tuple[Any, ...]:
        kept = self.copy()
        return _kept, (self._joints, kept._parts.memory, self.code, self.duration, kept._named)

    def __repr__(self) -> str:
        errors = f"position_error={self.position_error:.2e}, rotation_error={self.rotation_error:.2e}"
        return f"Step({self.status.name}, {errors})"

    def _repr_html_(self) -> str:
        """Status, errors and commands, for notebooks."""
        names = self._joints
        rows = [
            (name, *(f"{float(part[i]):.5g}" for part in (self.q, self.v))) for i, name in enumerate(names)
        ]
        note = (
            f"{self.status.value}; {1e3 * self.position_error:.3g} mm and {self.rotation_error:.3g} rad off"
        )
        return html_table(f"Step: {self.status.name}", ("joint", "q", "v"), rows, note)


def _kept(joints: tuple[str, ...], memory: Any, code: int, duration: float | None, named: StepLabels) -> Step:
    """A step that owns its parts."""
    return Step(None, joints, Parts(memory), StepHeader(code, duration), named)
