"""A planner led by a reference of the tip, or of another task's frame, that waits for the arm."""

from collections.abc import Mapping
from typing import Any, final

import numpy as np

from ftqp.control.planner.planner import Planner
from ftqp.control.planner.planner_view import JointState, PlannerView, TipState
from ftqp.control.planner.step import Step
from ftqp.control.planner.step_parts import TIP
from ftqp.control.planner.target import Target, target_on
from ftqp.control.references.jerk_limit import TipLimits, TipReference
from ftqp.control.task.soft_tasks import PoseTask, PositionTask
from ftqp.core.checks import FloatArray, seen
from ftqp.core.errors import InputError
from ftqp.core.pose import rotation_vector, transform
from ftqp.kernel.entry.session import ArmSession
from ftqp.kernel.layout.enums import HELD, INVALID_INPUT, STOPPED, STOPPING

LEASH = 0.02
"""How far the reference may be ahead of the tip [m]; less than half the emergency stop's default, so that the
stop is never reached ..."""
TURN_LEASH = 0.1
"""... and its rotation [rad] (docs/theory/ways-to-a-goal.md, "To a pose, or along a twist")."""
HELD_BACK = 0.5
"""An arm that is more than this share of the leash behind its reference holds it back. A guess that
`python benchmarks/peers_in_physics.py` has not contradicted: there creeping arms are 0.9 to 1.1 leashes
behind, and those that follow less than 0.2."""
STANDING = 1e-3
"""A tip slower than this on its leash stands, and its target with it [m/s, rad/s]."""
OFF_TASK = (STOPPING, STOPPED, INVALID_INPUT, HELD)
"""Codes of steps that do not attempt the task: who leads begins anew at the arm after them."""


@final
class FrameOfTip:
    """The tip, which every planner leads.

    Attributes:
        label: What it is called in sentences.
    """

    def __init__(self, planner: Planner, view: PlannerView) -> None:
        self._planner, self._view = planner, view

    label = "the end effector"

    def begin(self) -> None:
        """Nothing is remembered."""

    def state_at(self, joints: JointState) -> TipState:
        """The tip's motion with a motion of the joints."""
        return self._view.tip_at(joints)

    def step(self, q: Any, v: Any, target: Target, beside: Any, tau: Any, tip: Any) -> Step:
        """A step of the planner; the targets of other tasks are in ``beside``, a table, or stay."""
        if beside is None:
            return self._planner.step(q, v, target, tau=tau, tip=tip)
        if not isinstance(beside, Mapping):
            raise InputError(
                f"target is {type(beside).__name__}, but the end effector is led; expected a table of "
                "targets of other tasks, or None"
            )
        return self._planner.step(q, v, {**beside, TIP: target}, tau=tau, tip=tip)

    def error(self, step: Step) -> FloatArray:
        """From the measured tip to its target."""
        return step.task_error

    def distances(self, step: Step) -> tuple[float, float]:
        """Those of the step."""
        return step.position_error, step.rotation_error

    def holds(self, step: Step) -> bool:
        """Whether the step says so."""
        return step.holding


@final
class FrameOfTask:
    """The frame of a further task of a planner, ``PoseTask`` or ``PositionTask``; ``label`` is its name."""

    def __init__(self, planner: Planner, view: PlannerView, name: str) -> None:
        self._planner, self._view, self.label = planner, view, name
        given = planner.tasks[name].given
        if not isinstance(given, PoseTask | PositionTask):
            raise InputError(
                f"task {name!r} is a {type(given).__name__}, which follows no pose of its own; expected a "
                "PoseTask or a PositionTask"
            )
        robot = planner.robot.with_first_tip(given.frame)
        if isinstance(given, PositionTask) and given.point.any():
            robot = robot.with_tip(transform(np.eye(3), given.point), f"{name} point")
        self._n = robot.nv
        bits = given.bits if isinstance(given, PoseTask) else sum(1 << "xyz".index(row) for row in given.rows)
        rows = np.array([bool(bits & (1 << k)) for k in range(6)])
        self._counts = rows[:3], rows[3:]
        self._arm = ArmSession(robot.chain.constants())
        self._hold: Target | None = None

    def begin(self) -> None:
        """Let the tip stay where it is, unless another target comes."""
        self._hold = None

    def state_at(self, joints: JointState) -> TipState:
        """The frame's motion with a motion of the joints."""
        arm = self._arm
        arm.kinematics(joints.q, joints.v)
        found = arm.K.kinematics
        J = np.array(found.J[:, : self._n])
        pose = transform(np.array(found.R_tip).reshape(3, 3), np.array(found.o_tip))
        return TipState(pose, J @ joints.v, J @ joints.a + found.drift)

    def step(self, q: Any, v: Any, target: Target, beside: Any, tau: Any, tip: Any) -> Step:
        """A step of the planner; without a target of its own the tip stays where it began."""
        if beside is None:
            if self._hold is None:
                self._hold = Target(pose=self._view.tip.pose)
            beside = {TIP: self._hold}
        elif not isinstance(beside, Mapping):
            beside = {TIP: beside}
        return self._planner.step(q, v, {**beside, self.label: target}, tau=tau, tip=tip)

    def error(self, step: Step) -> FloatArray:
        """From the frame to its target."""
        found = np.zeros(6)
        error = step.tasks[self.label].error
        found[: len(error)] = error
        return found

    def distances(self, step: Step) -> tuple[float, float]:
        """Over the rows of the task."""
        error = self.error(step)
        linear, angular = self._counts
        return float(np.linalg.norm(error[:3][linear])), float(np.linalg.norm(error[3:][angular]))

    def holds(self, step: Step) -> bool:
        """Never: what rests is the tip."""
        return False


def frame_of(planner: Planner, name: str) -> FrameOfTip | FrameOfTask:
    """The frame of a task, or the tip by the name of its frame."""
    is_tip = name in (TIP, planner.robot.tip)
    return FrameOfTip(planner, planner.view()) if is_tip else FrameOfTask(planner, planner.view(), name)


@final
class TipTracker:
    """The planner's steps along a reference of the tip, or of the frame of another task.

    The reference begins where the command is and as fast. Where the tip stays behind by more than a leash,
    it is drawn back to the leash and is no faster than the tip, so that nothing winds up.

    Attributes:
        behind: How far the tip stays behind the reference [leashes].
        waits: Whether the reference waits: since it was on its leash the tip has held it back.
    """

    def __init__(
        self, planner: Planner, limits: TipLimits, task: str | None = None, *, whole: bool = False
    ) -> None:
        self.planner, self._whole = planner, whole
        self.view: PlannerView = planner.view()
        self.frame = frame_of(planner, TIP if task is None else str(task))
        self.reference = TipReference(limits, planner.dt)
        self.on_leash = False
        self.behind = 0.0
        self.waits = False
        self.target = Target(pose=np.eye(4))
        self.shown = target_on(seen(self.target.packed))
        self._begun = -1

    def begin(self) -> None:
        """Let the next step begin at the arm."""
        self._begun = -1
        self.waits = False
        self.frame.begin()

    def step(
        self,
        q: Any,
        v: Any,
        *,
        pose: FloatArray | None,
        twist: FloatArray,
        tau: Any,
        tip: Any,
        waits: bool = True,
        beside: Any = None,
    ) -> Step:
        """A step with the reference on its way."""
        planner, view, reference = self.planner, self.view, self.reference
        if self._begun != view.ticks and view.is_reset:
            now = self.frame.state_at(view.command)
            reference.begin(now.pose, now.twist, now.acceleration)
            self.on_leash = False
            self.behind = 0.0
        reference.pace(planner.pace)
        p, R, rate = reference.p, reference.R, reference.twist
        if pose is not None:
            reference.towards(pose, twist)
        else:
            reference.along(twist)
        self._aim(p, R, rate)
        if not waits:
            view.expect_error()
        if self._whole:
            view.keep_rows()
        step = self.frame.step(q, v, self.target, beside, tau, tip)
        self._begun = -1 if step.code in OFF_TASK else view.ticks
        if waits or step.code in OFF_TASK:
            view.forget_lateness()
        self.on_leash = False
        self.behind = 0.0
        if waits and (pose is not None or twist.any() or reference.twist.any()):
            self._draw_back(step)
        return step

    def _aim(self, p: FloatArray, R: FloatArray, rate: FloatArray) -> None:
        """The target: the reference at this tick, with its mean acceleration, or twist, until the next."""
        target, reference, dt = self.target, self.reference, self.planner.dt
        target.pose[:3, :3], target.pose[:3, 3] = R, p
        stands = not (rate.any() or reference.twist.any())
        if stands or (self.on_leash and float(np.abs(rate).max()) < STANDING):
            target.twist[:] = target.acceleration[:] = 0.0
        elif self.planner.level == "velocity":
            target.twist[:3] = (reference.p - p) / dt
            target.twist[3:] = rotation_vector(reference.R @ R.T) / dt
        else:
            target.twist[:] = rate
            target.acceleration[:] = (reference.twist - rate) / dt

    def _draw_back(self, step: Step) -> None:
        position, rotation = self.frame.distances(step)
        self.behind = max(position / LEASH, rotation / TURN_LEASH)
        self.on_leash = self.behind > 1.0
        self.waits = self.on_leash or (self.waits and self.behind > HELD_BACK)
        if self.on_leash:
            error = self.frame.error(step)
            now, twist = self.frame.state_at(self.view.command).twist, self.reference.twist.copy()
            for part in (slice(0, 3), slice(3, 6)):
                own, arm = float(np.linalg.norm(twist[part])), float(np.linalg.norm(now[part]))
                twist[part] *= 0.0 if arm < STANDING else min(1.0, arm / max(own, STANDING))
            self.reference.displace(
                -max(0.0, 1.0 - LEASH / max(position, LEASH)) * error[:3],
                -max(0.0, 1.0 - TURN_LEASH / max(rotation, TURN_LEASH)) * error[3:],
                twist,
            )
