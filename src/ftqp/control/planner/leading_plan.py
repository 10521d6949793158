"""A plan that leads a planner's null space, what a planner asks of it, and what is left after a failure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Protocol, final, runtime_checkable

import numpy as np

from ftqp.control.planner.stages import CLOCK, LED, Stage
from ftqp.core.checks import FloatArray, array, instance
from ftqp.core.errors import InputError
from ftqp.faults.belief import Belief
from ftqp.faults.kinds import Fault, Locked
from ftqp.kernel.entry.session import Memory, Session
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.model.frames import faults_on_way, off_way, on_way
from ftqp.model.robot import Robot


@dataclass(frozen=True, slots=True, kw_only=True)
class Remaining:
    """One thing that can still be done of a path after a failure.

    Attributes:
        kind: ``task`` (the rest of the path with all rows), ``rows`` (with fewer), ``until`` (a part of it),
            ``retreat`` (the way that has been done, back, or home), ``halt`` (to a posture near by where the
            arm can stand for long) or ``stop``.
        rows: The rows of the pose that are kept, by name.
        until: The time of the plan up to which it can be done [s]; of a retreat the one that it leads back
            to; 0 without a plan.
        q: The joints on the way, (k, nv) [rad or m]; the first row is where the arm is.
        sentence: The same in words.
    """

    kind: str
    rows: str
    until: float
    q: FloatArray
    sentence: str

    def __repr__(self) -> str:
        return f"Remaining({self.kind}: {self.sentence})"


@runtime_checkable
class LeadingPlan(Protocol):
    """What a planner needs of a plan; those of ``ftqp.analysis.plan`` and ``load_plan`` have it."""

    @property
    def q(self) -> FloatArray:
        """Joint positions at the times ``t``, (N + 1, nv) [rad or m]."""

    @property
    def t(self) -> FloatArray:
        """Times from 0 at equal distances, (N + 1,) [s]."""

    def of(self, robot: Robot) -> "LeadingPlan":
        """The plan with its arm; InputError where it was made for another one."""

    def remaining(self, q: FloatArray, at: float, faults: Sequence[Fault]) -> tuple[Remaining, ...]:
        """What can be done after faults at time ``at`` [s] and joints q, (nv,), least lost first."""

    def continuation(
        self, q: FloatArray, at: float, faults: Sequence[Fault]
    ) -> tuple[int, FloatArray] | None:
        """The postures that are verified after faults, from a row on; None keeps those of the plan."""


def plan_for(plan: LeadingPlan, robot: Robot) -> LeadingPlan:
    """A plan with its arm."""
    what = "one of ftqp.analysis.plan or ftqp.analysis.load_plan"
    instance("plan", plan, LeadingPlan, what)
    if robot.is_serial or isinstance(plan, PlanOnWay):
        return plan.of(robot)
    return PlanOnWay(plan.of(robot.arm_to(robot.tip)), robot)


@final
class PlanOnWay:
    """A plan of the arm to the first tip of a robot with branches, for all of its joints."""

    __slots__ = ("_plan", "_robot", "q", "t")

    def __init__(self, plan: Any, robot: Robot) -> None:
        self._plan, self._robot = plan, robot
        self.q: FloatArray = off_way(robot, robot.tip, plan.q, robot.neutral)
        self.t: FloatArray = plan.t

    def of(self, robot: Robot, *path: Any, **around: Any) -> "PlanOnWay":
        """The plan with its robot, as ``Plan.of`` has it; InputError where it was made for another one."""
        return PlanOnWay(self._plan.of(robot.arm_to(robot.tip), *path, **around), robot)

    def _own(self, q: FloatArray, faults: Sequence[Fault]) -> tuple[FloatArray, tuple[Fault, ...]]:
        tip = self._robot.tip
        return on_way(self._robot, tip, q), faults_on_way(self._robot, tip, faults)

    def remaining(self, q: FloatArray, at: float, faults: Sequence[Fault]) -> tuple[Remaining, ...]:
        """What can be done after faults at time ``at`` [s] and joints q, (nv,); the others stay there."""
        own, failed = self._own(q, faults)
        found = self._plan.remaining(own, at, failed)
        return tuple(replace(one, q=off_way(self._robot, self._robot.tip, one.q, q)) for one in found)

    def continuation(
        self, q: FloatArray, at: float, faults: Sequence[Fault]
    ) -> tuple[int, FloatArray] | None:
        """The postures that are verified after faults on the way; None keeps those of the plan."""
        own, failed = self._own(q, faults)
        found = self._plan.continuation(own, at, failed) if failed else None
        if found is None:
            return None
        first, rows = found
        return first, off_way(self._robot, self._robot.tip, rows, self._robot.neutral)


EVEN: Final = 1e-6
"""Times of a plan are at equal distances within this share of a distance. A convention, so that numbers which
a file gives to six digits pass."""


@final
class PlanLeading:
    """Draws the null space to a plan: at every tick to the posture that it has where the tip is now.

    The tip says how far the plan has come, not the clock, so a path that waits or is stopped takes the plan
    with it. Where rows of the plan have the same tip, because the arm moves on the spot, the clock goes on.
    Rotations count where the task has all of them; else the plan's may be others than the arm's.

    Source: docs/theory/following-a-plan.md.
    """

    def __init__(self, plan: LeadingPlan, session: Session, robot: Robot) -> None:
        self.plan = plan
        self._rows = array("plan.q", plan.q, (len(plan.t), robot.nv), "(N + 1, nv)")
        self._q = np.array(self._rows, order="C")  # what leads: the plan, or what goes on after a failure
        steps = np.diff(plan.t)
        if not len(steps) or not steps[0] > 0.0 or not np.allclose(steps, steps[0], rtol=EVEN, atol=0.0):
            raise InputError("plan.t is at uneven times, expected two or more times at equal distances")
        poses = np.stack([robot.pose(row) for row in self._q])
        tips = np.concatenate([poses[:, :3, 3], poses[:, :3, :3].reshape(-1, 9)], axis=1)
        task = session.K.task
        turns = {COMPONENTS.index(name) for name in robot.default_rows if name.startswith("r")}
        length = float(task.length) if turns and turns <= set(task.rows[: task.m].tolist()) else 0.0
        self._K = session.K
        self._tips, self._memory = tips, Memory("plan")
        self._led = P = self._memory.fields
        P.q_at, P.tip_at, P.rows = self._q.ctypes.data, tips.ctypes.data, len(tips)
        P.spacing, P.length = steps[0], length
        self.follow = session.bind("follow_plan", self._memory.memory)
        """Sets the posture of the next tick."""
        plan.continuation(
            self._q[0], 0.0, (Locked(robot.joints[0]),)
        )  # so that the first failure finds it ready

    @property
    def stage(self) -> Stage:
        """Its part in a planner's life."""
        return Stage(
            ticks=(CLOCK, *LED),
            before=self.follow,
            believe=self._apply_belief,
            begin=lambda q, _, belief: self.begin(q, belief.faults),
        )

    def _apply_belief(self, belief: Belief) -> None:
        """Lead on after a failure from where the arm is sent, once it has begun."""
        if self._K.state.is_reset:
            self.believe(self._K.gate.q[: self._q.shape[1]].copy(), belief.faults)

    def begin(self, q: FloatArray, faults: Mapping[str, Fault]) -> None:
        """Begin at the row of the plan that is nearest to q, (nv,) [rad or m], its first one if several."""
        away = np.abs(self._rows - q).max(axis=1)
        self._led.at, self._led.pace, self._led.begun = np.argmin(away), 0.0, 0
        self.believe(q, faults)
        self.follow()

    @property
    def at(self) -> float:
        """The time of the plan at which the tip is [s]."""
        return float(self._led.at * self._led.spacing)

    def believe(self, q: FloatArray, faults: Mapping[str, Fault]) -> None:
        """Lead to the postures verified for these faults, from joints q, (nv,) [rad or m], else to the plan.

        With two or more joints to spare the null space has something left after a lock. This takes less than
        a millisecond for some hundred rows; without, nothing is looked at.
        """
        self._q[:] = self._rows
        found = self.plan.continuation(q, self.at, tuple(faults.values())) if faults else None
        if found is not None:
            first, rows = found
            self._q[first : first + len(rows)] = rows

    def options(self, q: FloatArray, faults: Mapping[str, Fault]) -> tuple[Remaining, ...]:
        """What can still be done from joints q, (nv,) [rad or m], with these faults, least lost first."""
        return self.plan.remaining(q, self.at, tuple(faults.values()))
