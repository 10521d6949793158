"""The loop between a planner and its arm, as its user sees it: stops, their reasons, and the disturbance."""

from collections.abc import Mapping, Sequence
from math import ceil
from typing import Any, Final, final

import numpy as np

from ftqp.control.drive.joint_drive import Drive, by_name
from ftqp.control.drive.noise import Noise
from ftqp.control.planner.stages import Stage
from ftqp.control.planner.status import REPEATS, STOP_REASONS
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.kernel.entry.session import Session
from ftqp.kernel.latches.settling import forget_settling
from ftqp.kernel.layout.enums import AS_TOLD, FROZEN, Brakes, DriveKind, StopReason
from ftqp.model.robot import Robot

STEP: Final = 0.05
"""What is planned ahead is planned anew when a suspicion leaves it more or less by so much of its speed. A
guess that the campaigns have not contradicted."""


@final
class ArmLoop:
    """Stops and what is observed of the arm.

    Args:
        session: The planner's.
        joints: Names of the joints, (nv,).
    """

    def __init__(self, session: Session, joints: Sequence[str]) -> None:
        self._session = session
        self._joints = tuple(joints)
        self._speed = self._caution = 1.0
        self._named = 0

    @property
    def stage(self) -> Stage:
        """Its part in a planner's life."""
        return Stage(begin=lambda *_: self.forget())

    def forget(self) -> None:
        """After a reset no stop is latched and nothing is known of the arm but the given state."""
        self._release()
        K = self._session.K
        K.feedback.fresh = AS_TOLD
        forget_settling(K.calm)

    def _release(self) -> None:
        watch = self._session.K.watch
        watch.stopped = watch.rising = watch.fallbacks = 0
        self._session.K.feedback.moving = 0
        self._session.K.feedback.going[:] = 0.0
        watch.last_position_error = watch.last_rotation_error = np.inf
        watch.latched = watch.reason = 0  # the last thing, so that whoever is interrupted has still stopped

    def stop(self) -> None:
        """Latch a stop."""
        watch = self._session.K.watch
        if not watch.latched:
            watch.latched, watch.reason = 1, StopReason.ASKED

    def resume(self) -> bool:
        """Release a stop; False while a lost sensor, or the brake of the whole arm, forbids it."""
        feedback = self._session.K.feedback
        if feedback.lost.any() or (feedback.brakes == Brakes.ALL and feedback.asks.any()):
            return False
        feedback.waited = feedback.late = feedback.up = feedback.spent_elsewhere = 0.0
        feedback.far = feedback.stored = feedback.until_stored = 0
        feedback.spent[:] = 0.0
        self._release()
        return True

    @property
    def speed(self) -> float:
        """How fast the arm is led, in (0, 1] of full speed."""
        return self._speed

    @speed.setter
    def speed(self, share: float) -> None:
        self._speed = share
        self._session.K.feedback.speed = self._speed * self._caution

    @property
    def pace(self) -> float:
        """The share of full speed that the user and a suspicion leave, in steps of a suspicion's part."""
        return self._speed if self._caution == 1.0 else self._speed * STEP * ceil(self._caution / STEP)

    @property
    def caution(self) -> float:
        """The share of the user's speed that a suspicion leaves, in (0, 1]."""
        return self._caution

    @caution.setter
    def caution(self, share: float) -> None:
        self._caution = share
        self._session.K.feedback.speed = self._speed * share

    def lose_sensor(self, i: int) -> None:
        """Stop the arm, as the sensor of joint i tells nothing any more, until a reset."""
        K = self._session.K
        K.feedback.lost[i] = 1
        if not K.watch.latched:
            K.watch.latched, K.watch.reason = 1, StopReason.SENSOR

    def ask_for_brake(self, i: int) -> None:
        """Let the brake of joint i be asked for from now on, if the arm has any; that of all stops it."""
        feedback, watch = self._session.K.feedback, self._session.K.watch
        if feedback.brakes == Brakes.NONE:
            return
        feedback.asks[i] = 1
        if feedback.brakes == Brakes.ALL and not watch.latched:
            feedback.culprit = i
            watch.latched, watch.reason = 1, StopReason.LAG

    def find_overload(self, i: int) -> None:
        """Joint i cannot hold the arm with the torque that it has left: its brake is asked for, and a stop.

        A planner that never stops of its own accord only asks.
        """
        watch = self._session.K.watch
        if not watch.latched and watch.stop_samples > 0:
            self._named = i
            watch.latched, watch.reason = 1, StopReason.OVERLOAD
        self.ask_for_brake(i)

    def doubt_free(self, i: int) -> None:
        """Stop the arm: joint i seems to swing freely beside another that failed, which is not believed."""
        watch = self._session.K.watch
        if not watch.latched:
            self._named = i
            watch.latched, watch.reason = 1, StopReason.SECOND_FREE

    @property
    def stopped_because(self) -> str | None:
        """Why a stop is latched; None while none is."""
        K = self._session.K
        reason = StopReason(int(K.watch.reason)) if K.watch.latched else StopReason.NONE
        sentence = STOP_REASONS[reason]
        if sentence is None:
            return None
        named = self._joints[max(int(K.feedback.culprit), 0)]
        if reason is StopReason.SENSOR:
            lost = np.flatnonzero(K.feedback.lost[: len(self._joints)])
            if len(lost) and all(K.feedback.held[i] == FROZEN and K.feedback.sigma == 0.0 for i in lost):
                sentence = REPEATS
            named = ", ".join(self._joints[i] for i in lost) or "v, tau or the tip"
        if reason in (StopReason.OVERLOAD, StopReason.SECOND_FREE):
            named = self._joints[self._named]
        said = sentence.format(joint=named)
        moving = int(K.feedback.moving)
        return f"{said}; {self._joints[moving - 1]} is not seen to rest" if moving > 0 else said

    @property
    def disturbance(self) -> FloatArray:
        """Torque beside the model, (nv,) [N m or N]; NaN where it is not observed."""
        feedback, n = self._session.K.feedback, len(self._joints)
        if feedback.kind != DriveKind.TORQUE:
            return np.full(n, np.nan)
        result: FloatArray = feedback.M[:n, :n] @ feedback.d_slow[:n]
        return result


def accepted_drive(
    robot: Robot, drive: Drive | str | Mapping[str, Any], noise: Noise | None
) -> tuple[Drive, Noise]:
    """What the arm takes and how noisy it is, if that can be driven.

    Raises:
        InputError: A wrong drive or noise, or torques for a robot without inertia.
    """
    if noise is not None and not isinstance(noise, Noise):
        raise InputError(f"noise is {noise!r:.60}, expected an ftqp.Noise or None")
    found = by_name(drive)
    if found.kind == "torque" and not robot.has_inertia:
        raise InputError(
            f"drive 'torque' needs inertia, which {robot.name} has not; give the model its masses, or "
            "take drive 'position' or 'velocity'"
        )
    return found, Noise() if noise is None else noise
