"""Whose frame is led: the tip's, by the target of a step, or that of another task, by its own target."""

from collections.abc import Mapping
from typing import Any, final

import numpy as np

from ftqp.control.planner.planner import Planner
from ftqp.control.planner.planner_view import JointState, PlannerView, TipState
from ftqp.control.planner.step import Step
from ftqp.control.planner.step_parts import TIP
from ftqp.control.planner.target import Target
from ftqp.control.task.soft_tasks import PoseTask, PositionTask
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.core.pose import transform
from ftqp.kernel.entry.session import ArmSession


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
