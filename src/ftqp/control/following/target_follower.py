"""Following targets that jump and twists of an operator, with limited jerk and a dead-man time."""

import logging
from enum import Enum
from math import inf
from typing import Any, final

import numpy as np

from ftqp.control.following.tip_tracker import TipTracker
from ftqp.control.planner.given_arrays import not_a_target
from ftqp.control.planner.mounted_robot import in_millimetres
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.start import in_milliseconds
from ftqp.control.planner.status import with_reason
from ftqp.control.planner.step import Step
from ftqp.control.planner.target import Target, Targets
from ftqp.control.references.jerk_limit import TipLimits
from ftqp.core.checks import FloatArray, instance, positive
from ftqp.core.errors import InputError
from ftqp.core.fixed import Fixed
from ftqp.core.pose import has_last_row, is_rotation_matrix
from ftqp.kernel.layout.enums import STOPPED, STOPPING, TARGET_HAS_ROTATION, TARGET_POSE, TARGET_TWIST

_LOG = logging.getLogger("ftqp")


class TargetStatus(Enum):
    """How the target is followed; the value is the sentence for the operator."""

    FOLLOWING = "the end effector follows its target as fast as its limits allow"
    WAITING = "the arm stays behind; the reference waits for it within a leash"
    STALE = "no fresh twist has come for the dead-man time; the end effector comes to rest, or rests"
    INVALID = "the target is no pose; the arm brakes"
    HALTED = "the planner brakes or has stopped the arm"


@final
class TargetFollower:
    """Leads a planner to targets that may jump, or along the twists of an operator.

    Between the target and the planner stands a reference of the end effector with limits of speed,
    acceleration and jerk. It begins at the arm, goes to a pose however far it jumps, or becomes as fast as a
    twist; and it stays within a leash of 20 mm and 0.1 rad of the end effector, so that nothing winds up
    where the arm cannot follow. Limits, failed joints and singularities are the planner's matter as always.

    A twist alone counts as fresh when its stamp is greater than every stamp before. After ``dead_man``
    without a fresh one the reference comes to rest with limited jerk, whatever the target says. Time is
    counted in steps: whoever calls ``step`` no more is beyond the reach of a dead-man time.

    Args:
        planner: The planner that it commands.
        limits: How fast the reference may move; None is ``TipLimits()``.
        dead_man: How long a twist counts without a fresh one, > 0 [s]. A longer one rides out longer gaps and
            goes on longer after a loss.

    Raises:
        InputError: ``dead_man`` is not positive, or limits are no ``TipLimits``.

    Source: docs/theory/ways-to-a-goal.md.
    """

    __slots__ = (
        "_age", "_dead_man", "_led", "_looked", "_nowhere", "_planner", "_stamp", "_status", "_turns",
        "_twist",
    )  # fmt: skip

    planner: Fixed[Planner] = Fixed("_planner")

    def __init__(self, planner: Planner, limits: TipLimits | None = None, *, dead_man: float = 0.2) -> None:
        instance("planner", planner, Planner, "an ftqp.Planner, ftqp.Planner(robot)")
        if not isinstance(limits, TipLimits | None):
            raise InputError(f"limits are {limits!r:.60}, expected ftqp.TipLimits(...) or None")
        self._planner = planner
        self._dead_man = positive("dead_man", dead_man, "s")
        limits = TipLimits() if limits is None else limits
        if said := in_milliseconds(planner.robot, limits.speed, self._dead_man):
            _LOG.warning("%s: %s", planner.robot.name, said)
        self._led = TipTracker(planner, limits)
        self._turns = any(row.startswith("r") for row in planner.task_rows)
        self._nowhere = Target(pose=np.eye(4))
        self._nowhere.pose[:] = np.nan
        self._begin()

    def _begin(self) -> None:
        self._led.begin()
        self._status = TargetStatus.FOLLOWING
        self._stamp, self._age = -inf, inf
        self._looked = False
        self._twist = np.zeros(6)

    def reset(self, q: Any, v: Any = None) -> None:
        """Begin anew at (q, v), see ``Planner.reset``; stamps of twists are forgotten.

        Args:
            q: The measured configuration, (nv,) joint values or (nq,) [rad or m].
            v: The measured velocity, (nv,) [rad/s or m/s]; None is rest.
        """
        self._planner.reset(q, v)
        self._begin()

    def step(
        self,
        q: Any,
        v: Any = None,
        target: Target | Targets | None = None,
        *,
        tau: Any = None,
        tip: Any = None,
    ) -> Step:
        """The command for the next ``dt``; see ``Planner.step``.

        Args:
            q: The measured configuration, (nv,) joint values or (nq,) [rad or m].
            v: The measured velocity, (nv,) [rad/s or m/s], or None: the planner observes it from q.
            target: Where the end effector should be, however far away, and how fast that moves; or a twist
                alone. The target's acceleration is not used.
            tau: The measured torque, (nv,) [N m or N], or None.
            tip: The measured pose of the end effector, (4, 4), or None to take that of the model.
        """
        if not isinstance(target, Target | Targets):
            raise not_a_target(target)
        wanted = target.packed.reshape(-1, target.packed.shape[-1])[target.row]
        kind = wanted[TARGET_HAS_ROTATION]
        if isinstance(target, Target) and kind < 0.0:
            self._status = TargetStatus.FOLLOWING if self._is_fresh(target) else TargetStatus.STALE
            step = self._led.step(q, v, pose=None, twist=self._twist, tau=tau, tip=tip)
        else:
            pose = self._pose(wanted[TARGET_POSE:TARGET_TWIST].reshape(4, 4), kind > 0.0)
            twist = wanted[TARGET_TWIST : TARGET_TWIST + 6]
            if kind == 0.0 and self._turns:
                return self._planner.step(q, v, target)  # which says what is wrong
            if pose is None or not np.isfinite(twist).all():
                self._status = TargetStatus.INVALID
                self._led.begin()
                return self._planner.step(q, v, self._nowhere, tau=tau, tip=tip)
            if not self._looked:
                self._look(pose)
            self._status = TargetStatus.FOLLOWING
            step = self._led.step(q, v, pose=pose, twist=twist, tau=tau, tip=tip)
        if step.code in (STOPPING, STOPPED):
            self._status = TargetStatus.HALTED
        elif self._led.waits and self._status is TargetStatus.FOLLOWING:
            self._status = TargetStatus.WAITING
        return step

    @property
    def status(self) -> TargetStatus:
        """How the target is followed."""
        return self._status

    @property
    def target(self) -> Target:
        """Pose, twist and acceleration of the reference that the last step aimed at."""
        return self._led.shown

    def _is_fresh(self, target: Target) -> bool:
        """Take the twist if its stamp is new, and count how long none has come."""
        if target.stamp > self._stamp and np.isfinite(target.twist).all():
            self._stamp, self._age = target.stamp, 0.0
            self._twist = target.twist.copy()
            if not self._turns:
                self._twist[3:] = 0.0
        else:
            self._age += self._planner.dt
        fresh = self._age < self._dead_man
        if not fresh:
            self._twist = np.zeros(6)
        return fresh

    def _look(self, pose: FloatArray) -> None:
        """Warn of the first target where it must be in millimetres."""
        self._looked = True
        if said := in_millimetres(self._planner.robot, pose[:3, 3]):
            _LOG.warning("%s: %s", self._planner.robot.name, said)

    def _pose(self, given: FloatArray, has_rotation: bool) -> FloatArray | None:
        """The goal, or None where it is no pose; a task without rotation keeps the reference's attitude."""
        pose = given.copy()
        if not (has_rotation and self._turns):
            pose[:3, :3] = self._led.reference.R
        if not (np.isfinite(pose).all() and has_last_row(pose)):
            return None
        return pose if is_rotation_matrix(pose[:3, :3]) else None

    @property
    def sentence(self) -> str:
        """How the target is followed, and why the planner has stopped the arm where it has."""
        halted = self._status is TargetStatus.HALTED
        return with_reason(self._status.value, self._planner.stopped_because if halted else None)

    def __repr__(self) -> str:
        return f"TargetFollower({self._planner.robot.name}, {self._status.name})"
