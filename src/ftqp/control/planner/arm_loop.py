"""The loop between a planner and its arm, as its user sees it: stops, their reasons, and the disturbance."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, final

import numpy as np

from ftqp.control.drive.joint_drive import Drive, Noise, by_name
from ftqp.control.drive.learned_servos import LearnedServos
from ftqp.control.planner.collision_model import CollisionModel
from ftqp.control.planner.status import REPEATS, STOP_REASONS
from ftqp.core.checks import FloatArray, frozen
from ftqp.core.errors import InputError
from ftqp.kernel.entry.planner_commands import PlannerCommands
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.enums import FROZEN, DriveKind, StopReason
from ftqp.kernel.layout.other_records import DOUBTED
from ftqp.model.payload import Payload
from ftqp.model.robot import Robot

WAY: Final = 0.05
"""What the monitor counts the way of a joint in [rad or m]."""
LEAST_LOAD = 0.05
"""A load lighter than this [kg] is not named, because friction that is not learned yet looks like so much."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class Learned:
    """What the arm has that its model lacks, as estimated since ``reset``.

    Attributes:
        rotors: Inertia of each joint's rotor on top of the model's, (nv,) [kg m2 or kg]; negative where
            the model has too much.
        rotors_error: Their standard deviations, (nv,); large for joints that were hardly accelerated.
        friction: Dry friction of each joint, (nv,) [N m or N], that of the model included, as it is not fed
            forward.
        delay: How much later samples come than the drive's ``latency`` says [s], as far as the arm has
            shaken, which alone tells.
        stiffness: Bandwidth of the loop [1/s], below that of the drive where the arm has rung.
        payload: The load at the end effector on top of what the planner carries, as a point mass; None is
            none.
    """

    rotors: FloatArray
    rotors_error: FloatArray
    friction: FloatArray
    delay: float
    stiffness: float
    payload: Payload | None

    def facts(self) -> dict[str, Any]:
        """The same as anything JSON can hold, for logs: ``payload`` has its mass and its centre."""
        load = self.payload
        return {
            "rotors": self.rotors.tolist(),
            "rotors_error": self.rotors_error.tolist(),
            "friction": self.friction.tolist(),
            "delay": self.delay,
            "stiffness": self.stiffness,
            "payload": None if load is None else {"mass": load.mass, "com": load.com.tolist()},
        }


def learned(session: Session, robot: Robot) -> Learned | LearnedServos | None:
    """What the planner of this session has learned; None where it does not learn, or has not begun."""
    K, joints = session.K, robot.nv
    if K.monitor.on:
        return learned_servos(K, robot) if K.monitor.sees else None
    room, chain = K.learned, K.chain
    if not room.on or not room.based:
        return None
    mass, payload = float(room.load[0]), None
    if mass > LEAST_LOAD:
        away = np.array(room.load[1:4]) / mass - chain.tip_translation
        payload = Payload(mass, np.reshape(chain.tip_rotation, (3, 3)).T @ away)
    return Learned(
        rotors=frozen(room.rotor[:joints]),
        rotors_error=frozen(room.sigma[:joints]),
        friction=frozen(room.friction[:joints]),
        delay=float(room.later) * float(K.state.dt),
        stiffness=float(K.feedback.stiffness),
        payload=payload,
    )


def learned_servos(K: Any, robot: Robot) -> LearnedServos:
    """What a record knows of the servos of its arm."""
    M, n = K.monitor, robot.nv
    values, P = np.array(M.theta[:n]), np.array(M.P[:n])
    droops = np.zeros((n, values.shape[1]))
    droops[:, 3], droops[:, 4] = 1.0, M.weight[:n]
    spread = np.einsum("ir,irc,ic->i", droops, P, droops)
    return LearnedServos(
        robot=robot.name,
        joints=tuple(robot.joints),
        units=tuple("m" if slides else "rad" for slides in robot.chain.prismatic),
        values=values,
        deviations=np.sqrt(np.maximum(np.diagonal(P, axis1=1, axis2=2), 0.0)),
        droop=(droops * values).sum(axis=1),
        droop_error=np.sqrt(np.maximum(spread, 0.0)),
        noise=np.array(K.held.sigma[:n]),
        way=WAY * np.array(M.way[:n]),
    )


@final
class ArmLoop:
    """Stops and what is observed of the arm."""

    def __init__(
        self, session: Session, commands: PlannerCommands, robot: Robot, around: CollisionModel | None
    ) -> None:
        self._session, self._commands, self._robot = session, commands, robot
        self._joints, self._around = tuple(robot.joints), around
        self._named, self._why = 0, ""

    def stop(self, why: str = "") -> None:
        """Latch a stop; the reason of one that is latched stays."""
        if not self._session.K.watch.latched:
            self._why = why
        self._commands.stop(StopReason.ASKED)

    def resume(self) -> bool:
        """Release a stop; False while a lost sensor, or the brake of the whole arm, forbids it."""
        return self._commands.resume()

    def find_overload(self, i: int, K: Any, commands: PlannerCommands) -> None:
        """Ask for the brake of joint i where it cannot hold the arm any more, and stop; in a draft, ``K``."""
        if commands.hold_up(i) and K.watch.reason == StopReason.OVERLOAD:
            self._named = i

    def respond(self, i: int) -> int:
        """What becomes of joint i by what the monitor says of it now; the arm may be stopped for it."""
        was = self._session.K.watch.latched
        does = self._commands.respond(i)
        if does == DOUBTED and not was:
            self._named = i
        return does

    def forget_finding(self, i: int) -> None:
        """Forget what was found of joint i."""
        self._commands.forget_finding(i)

    @property
    def stopped_because(self) -> str | None:
        """Why a stop is latched; None while none is."""
        K = self._session.K
        reason = StopReason(int(K.watch.reason)) if K.watch.latched else StopReason.NONE
        sentence = STOP_REASONS[reason]
        if sentence is None:
            return None
        named = self._joints[max(int(K.feedback.isolated_joint), 0)]
        if reason is StopReason.SENSOR:
            lost = np.flatnonzero(K.feedback.lost[: len(self._joints)])
            if len(lost) and all(K.feedback.held[i] == FROZEN and K.feedback.sigma == 0.0 for i in lost):
                sentence = REPEATS
            named = ", ".join(self._joints[i] for i in lost) or "v, tau or the end effector"
        if reason in (StopReason.OVERLOAD, StopReason.SECOND_FREE):
            named = self._joints[self._named]
        names = () if self._around is None else self._around.names
        at = int(K.scene.nearest)
        pair = " and ".join(names[at]) if 0 <= at < len(names) else "two bodies"
        said = (reason is StopReason.ASKED and self._why) or sentence.format(joint=named, pair=pair)
        moving = int(K.feedback.moving)
        return f"{said}; {self._joints[moving - 1]} is not seen to rest" if moving > 0 else said

    @property
    def learned(self) -> Learned | LearnedServos | None:
        """What was learned of the arm; None where nothing is learned, or before the first step."""
        return learned(self._session, self._robot)

    @property
    def touch(self) -> FloatArray | None:
        """The force that seems to push the tip, (3,) [N]; None where nothing does."""
        feedback = self._session.K.feedback
        return np.array(feedback.push_at_tip) if feedback.touched else None

    @property
    def disturbance(self) -> FloatArray:
        """Torque beside the model, (nv,) [N m or N]; NaN where it is not observed."""
        feedback, n = self._session.K.feedback, len(self._joints)
        if feedback.kind != DriveKind.TORQUE:
            return np.full(n, np.nan)
        result: FloatArray = np.array(feedback.tau_slow[:n])
        return result


def accepted_drive(
    robot: Robot, drive: Drive | str | Mapping[str, Any], noise: Noise | None
) -> tuple[Drive, Noise]:
    """What the arm takes and how noisy it is, if that can be driven."""
    if noise is not None and not isinstance(noise, Noise):
        raise InputError(f"noise is {noise!r:.60}, expected an ftqp.Noise or None")
    found = by_name(drive)
    found.refuse_others(robot.joints)
    if found.kind == "torque" and not robot.has_inertia:
        raise InputError(
            f"drive 'torque' needs inertia, which {robot.name} has not; give the model its masses, or "
            "take drive 'position' or 'velocity'"
        )
    if found.kind == "torque":
        robot.refuse_unknown_torques("drive 'torque' sends torques")
    return found, Noise() if noise is None else noise
