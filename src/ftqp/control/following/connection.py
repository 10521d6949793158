"""The first minute with an arm: a small motion that shows its servos, and mistakes of wires and units.

What is judged is the way of a joint's samples beside that of the planner's reference, while it moves alone:
no servo has to be known for that. What it looks for are the mistakes of ``Connection``'s docstring.
"""

from pathlib import Path
from typing import Any, Final, final

import numpy as np

from ftqp.control.drive.learned_servos import LearnedServos
from ftqp.control.following.connection_words import LEAST, missing_of, said_of_stated, strayed
from ftqp.control.following.first_motion import FirstMotion, first_motion
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.step import Step
from ftqp.control.planner.ways.joint_tracker import motion_of_joints
from ftqp.core.checks import FloatArray, instance, positive
from ftqp.core.errors import InputError
from ftqp.core.fixed import MADE, Fixed
from ftqp.kernel.layout.enums import HELD, INVALID_INPUT, STOPPED, STOPPING
from ftqp.model.robot import Robot

FOLLOWS: Final = 0.2
"""A joint that goes less than this share of its way does not follow: a servo of 1 Hz goes a third."""
OTHER: Final = 0.5
"""One that goes this share of another's way while that one moves alone is moved by its command."""
TOO_FAR: Final = 3.0
"""One that goes so many times as far is not measured in the unit in which it is sent."""
ROUGHLY: Final = 0.05
"""How far a joint may be shaken by the motion of others [rad or m], ..."""
SAGS: Final = 0.15
"""... and how far one may sag at first, when its servo is sent the place that it was measured at."""
OUTSIDE: Final = 0.2
"""How far outside its range an arm may begin [rad or m]: soft limits and zeros are so far off at most."""
STILL: Final = 0.2
"""No joint moves before an arm that sagged has stood for so long [s], ..."""
SAGGING: Final = 3.0
"""... unless that takes so long [s]."""
SETTLES: Final = 1.0
"""An arm that is stopped has so long to come to rest [s]."""
DEGREES: Final = 180.0 / np.pi
TURN: Final = 2.0 * np.pi
EARLY: Final = 0.1
"""From this share of its way on a joint may be seen to go wrong, where the planner has found something."""
DIVERGES: Final = 0.005
"""How far a joint that is not sent anywhere goes on and on [rad or m] where its samples are not its own."""
STANDS: Final = (
    "the arm stands: it is held (protective stop, enabling switch, brakes), or the joint that is to move is "
    "locked"
)
"""What is said of an arm that is held."""


@final
class Connection:
    """Moves an arm for the first time, and says what that showed.

    Every joint moves by some degrees, alone and then all together, at no more than 0.3 of its
    limits, and comes back. The planner estimates the servos meanwhile, and keeps the estimates. It stops
    the arm at once, and ``fault`` says why, where a joint does not follow, moves the other way, goes much too
    far (degrees, millimetres), where the samples of another one follow (columns are swapped), where the arm
    moves though it is sent to stay, and where the planner finds a failure or is stopped. The true lag,
    friction and sag lie within three of the standard deviations that it says.

    Args:
        planner: The planner that it commands, on drive ``position``; it is reset.
        q: What is measured now of the arm at rest, (nv,) or (nq,) [rad or m].
        seconds: About how long it takes, 10 s if left out, and more for more than seven joints; longer
            motions are larger where joints are slow, and tell more [s].

    Raises:
        InputError: Another drive, too short a time, or an arm that is far outside its ranges, as one that is
            measured in degrees.
    """

    __slots__ = (
        "_begun", "_fault", "_joints", "_lead", "_least", "_most", "_motion", "_moved", "_part", "_planner",
        "_reference", "_robot", "_still", "_stood", "_stopped", "_t", "_view", "_waited",
    )  # fmt: skip

    planner: Fixed[Planner] = Fixed("_planner")
    fault: Fixed[str | None] = Fixed(
        "_fault", "What ended it early, in a sentence; None where nothing has.", MADE
    )

    def __init__(self, planner: Planner, q: Any, *, seconds: float | None = None) -> None:
        instance("planner", planner, Planner, "an ftqp.Planner, ftqp.Planner(robot)")
        if planner.drive.kind != "position":
            raise InputError(
                f"the planner's drive is {planner.drive.kind!r}, expected 'position': connect estimates "
                "position servos; a torque arm is identified while it moves (planner.learned) or by `ftqp "
                "identify`"
            )
        robot = planner.robot
        start = robot.angles(q)
        _refuse_outside(robot, start)
        self._planner, self._robot, self._view = planner, robot, planner.view()
        planner.reset(start)
        given = None if seconds is None else positive("seconds", seconds, "s")
        self._motion: FirstMotion = first_motion(robot, start, self._view.working, given)
        self._view.forget_servos()
        memory = motion_of_joints(planner)
        self._joints: Any = memory.fields
        self._lead = planner.lead(memory)
        self._t, self._part, self._stopped = 0.0, -1, 0.0
        self._fault: str | None = None
        self._begun, self._reference = start.copy(), start.copy()
        self._most, self._least = np.zeros(robot.nv), np.zeros(robot.nv)
        self._moved = self._waited = self._still = 0.0
        self._stood = start.copy()

    def step(self, q: Any, v: Any = None) -> Step:
        """The command for the next ``dt``, to be sent as any; see ``Planner.step``.

        Args:
            q: The measured configuration, (nv,) joint values or (nq,) [rad or m].
            v: The measured velocity, (nv,) [rad/s or m/s], or None: the planner observes it from q.
        """
        self._write()
        step = self._lead.step(q, v, (), None, None)
        if self._fault is None and not self.done:
            self._watch(np.array(self._robot.angles(q), dtype=float), step)
        if self._fault is not None:
            self._stopped += self._planner.dt
        elif step.code != INVALID_INPUT and self._t <= self._motion.duration and not self._sags():
            self._t += self._planner.dt
            if self._t > self._motion.duration and (learned := self.learned) is not None:
                self._view.tell_servos(learned)
        return step

    def _sags(self) -> bool:
        """Whether the arm, which was sent where it was measured, still sags and is led back from there."""
        if self._part >= 0 or self._waited > SAGGING or self._still > STILL:
            return False
        self._waited += self._planner.dt
        return bool((np.maximum(self._most, -self._least) > 2.0 * LEAST).any())

    def _write(self) -> None:
        """Let the kernel read where the motion is."""
        n, dt, joints, motion = self._robot.nv, self._planner.dt, self._joints, self._motion
        t = min(self._t, motion.duration)
        q, v, _ = motion.at(t)
        then_q, then_v, _ = motion.at(min(t + dt, motion.duration))
        joints.q[:n], joints.v[:n] = q, v
        joints.x[:n] = (then_v - v) / dt if joints.kv > 0.0 else (then_q - q) / dt

    @property
    def done(self) -> bool:
        """Whether nothing more will happen: the arm is back where it began, or it was stopped and rests."""
        if self._fault is not None:
            return self._stopped > SETTLES
        return self._t > self._motion.duration

    def __repr__(self) -> str:
        state = f"{self.progress:.0%} of the motion" if self._fault is None else self._fault
        return f"Connection({self._robot.name}, {state})"

    @property
    def progress(self) -> float:
        """Share of the motion that was made, in [0, 1]."""
        return min(self._t / self._motion.duration, 1.0)

    def _watch(self, sample: FloatArray, step: Step) -> None:
        """Look at a sample, and stop the arm where something is wrong."""
        if not np.isfinite(sample).all():
            return
        part, reference = self._motion.part(self._t), np.array(step.reference.q)
        wrong = None
        if part != self._part:
            wrong = self._judged()
            self._part, self._begun, self._reference = part, sample, reference
            self._most, self._least, self._moved = np.zeros(len(sample)), np.zeros(len(sample)), 0.0
        if self._part < 0:
            moves = bool((np.abs(sample - self._stood) > 2.0 * LEAST).any())
            self._stood = sample if moves else self._stood
            self._still = 0.0 if moves else self._still + self._planner.dt
        way = sample - self._begun
        self._most, self._least = np.maximum(self._most, way), np.minimum(self._least, way)
        if self._alone is not None:
            self._moved = max(self._moved, float(np.abs(reference - self._reference)[self._alone]))
        wrong = wrong or self._at_once(way)
        found = self._planner.findings
        if wrong is None and (found or step.code in (STOPPING, STOPPED, HELD)):
            wrong = self._guessed(way) or (found[0].sentence.rstrip(".") if found else None)
            wrong = wrong or self._planner.stopped_because or f"{self._moving}{STANDS}"
        if wrong is not None:
            self._fault = wrong
            self._stopped = SETTLES if self._part < 0 else 0.0  # the reference has not moved yet
            self._planner.stop()

    @property
    def _alone(self) -> int | None:
        """The joint that moves alone now."""
        order = self._motion.order
        return order[self._part] if 0 <= self._part < len(order) else None

    @property
    def _moving(self) -> str:
        """The joint that is to move, as the beginning of a sentence."""
        i = self._alone
        return "" if i is None else f"{self._robot.joints[i]} is to move, and "

    def _at_once(self, way: FloatArray) -> str | None:
        """What is wrong with the way of the samples so far, where that cannot wait; None where nothing is."""
        names, i = self._robot.joints, self._alone
        if self._part < 0:
            return strayed(names, self._begun, way) if np.abs(way).max() > SAGS else None
        if i is None:
            return None
        size = abs(self._motion.alone[i])
        if abs(way[i]) > TOO_FAR * size + ROUGHLY:
            return self._too_far(i, float(way[i]))
        others = np.where(self._robot.chain.lead == i, 0.0, way)
        k = int(np.argmax(np.abs(others)))
        if abs(others[k]) > OTHER * size + ROUGHLY:
            moved = f"{names[k]} has moved by {way[k]:.3g} while only {names[i]} was sent to move"
            return self._guessed(way) or moved
        turned = way[i] * np.sign(self._motion.alone[i]) < -OTHER * size
        return self._judged(EARLY if turned else OTHER, over=False)

    def _guessed(self, way: FloatArray) -> str | None:
        """What mistake the planner has found by its consequences; None where it looks like none."""
        judged, i, start = self._judged(EARLY, over=False), self._alone, self._motion.start
        if judged is not None or (i is None and self._part >= 0):
            return judged
        away, least = self._begun + way - start, LEAST
        if i is not None and self._moved > EARLY * abs(self._motion.alone[i]):
            away[i], least = 0.0, DIVERGES
        away = np.where(away * way > 0.0, away, 0.0)  # what sagged at first comes back
        return strayed(self._robot.joints, start, away) if np.abs(away).max() > least else None

    def _judged(self, share: float = OTHER, *, over: bool = True) -> str | None:
        """What is wrong with the joint that has moved alone, at least by a share of its way; None if nothing.

        Before its motion is over, one that has not followed may do so yet.
        """
        i, names = self._alone, self._robot.joints
        if i is None or self._moved < share * abs(self._motion.alone[i]):
            return None
        way = np.where(self._most > -self._least, self._most, self._least)
        follows = float(way[i] * np.sign(self._motion.alone[i]) / self._moved)
        others = np.abs(way) > max(share * self._moved, TOO_FAR * abs(way[i]))
        others &= self._robot.chain.lead != i
        unit = "m" if self._robot.chain.prismatic[i] else "rad"
        sent = f"{names[i]} was sent by {self._moved:.2g} {unit}"
        if abs(follows) > TOO_FAR:
            return self._too_far(i, float(way[i]))
        if abs(follows) < FOLLOWS and others.any():
            k = int(np.argmax(np.where(others, np.abs(way), 0.0)))
            return (
                f"{sent} and has not moved, but {names[k]} has, by {way[k]:.2g}: columns of measured or of "
                f"sent positions are swapped; put them in the order of robot.joints, {', '.join(names)}"
            )
        if follows < -min(share, FOLLOWS):
            return (
                f"{sent} and has moved by {way[i]:.2g}, the other way: turn the sign of its measured or of "
                "its sent positions, or the axis of the model"
            )
        if abs(follows) < FOLLOWS and over:
            return (
                f"{sent} and has moved by {way[i]:.1g}: it is locked, its motor is off, the arm is held, or "
                "what is handed over is not measured of it; look at its drive and brake, or report it as "
                "ftqp.Locked"
            )
        return None

    def _too_far(self, i: int, way: float) -> str:
        """What is said of a joint that goes much too far."""
        slides, asked = bool(self._robot.chain.prismatic[i]), max(self._moved, 1e-9)
        guess = "in millimetres (1000 times)" if slides else "in degrees (57.3 times)"
        remedy = "metres" if slides else "radians, np.radians(q)"
        return (
            f"{self._robot.joints[i]} was sent by {asked:.2g} and its samples have moved by {way:.2g}, "
            f"{abs(way) / asked:.0f} times as far: they seem to be {guess}; hand over {remedy}"
        )

    @property
    def learned(self) -> LearnedServos | None:
        """The estimates of the servos; None of an arm whose samples are its commands."""
        found = self._planner.learned
        return found if isinstance(found, LearnedServos) else None

    @property
    def notices(self) -> tuple[str, ...]:
        """What can and cannot be noticed of each joint now, and how fast, a sentence each."""
        diagnosis = self._planner.diagnosis
        if diagnosis is None:
            return ("Nothing is looked for: the planner was made with detector=False.",)
        return diagnosis.sentences

    @property
    def missing(self) -> tuple[str, ...]:
        """What should be stated, or is stated wrongly, a sentence each with its remedy."""
        learned = self.learned
        if self._fault is not None:
            return ()
        if learned is None:
            return (
                "The samples were the commands to the last bit, so that nothing was estimated: hand over "
                "what the arm measures, and not what was sent.",
            )
        return (*said_of_stated(self._planner, learned), *missing_of(self._planner, learned))

    def __str__(self) -> str:
        """All of it, a line each, or why it ended early."""
        if self._fault is not None:
            return f"Ended early: {self._fault}."
        learned = () if self.learned is None else self.learned.sentences
        return "\n".join((*learned, *self.notices, *self.missing))

    def save(self, path: str | Path) -> None:
        """Write the estimates, for ``ftqp.Drive(known=path)``.

        Args:
            path: The file; one that exists is replaced.

        Raises:
            InputError: The motion is not over or was ended early, nothing was estimated, or the file cannot
                be written.
        """
        if self._fault is not None:
            raise InputError(
                f"{path} is not written, because the first motion was ended early: {self._fault}"
            )
        if not self.done:
            raise InputError(
                f"{path} is not written, because {1.0 - self.progress:.0%} of the motion is still to come; "
                "go on with connection.step until it is done"
            )
        learned = self.learned
        if learned is None:
            raise InputError(f"{path} is not written: {self.missing[0]}")
        if not learned.is_known.any():
            raise InputError(
                f"{path} is not written, because no joint moved enough for its servo to show; begin where "
                "joints have room, or give more seconds"
            )
        learned.save(path)


def connect(planner: Planner, q: Any, *, seconds: float | None = None) -> Connection:
    """A first motion with an arm, by which its servos are estimated and mistakes of wiring are found.

    ```
    first = ftqp.connect(planner, read())
    while not first.done:
        send(first.step(read()).q)
    print(first)
    first.save("arm.json")  # then ftqp.Planner(robot, drive=ftqp.Drive(known="arm.json"))
    ```

    Args:
        planner: The planner that it commands, on drive ``position``; it is reset.
        q: What is measured now of the arm at rest, (nv,) or (nq,) [rad or m].
        seconds: About how long it takes, 10 s if left out, and more for more than seven joints; longer
            motions are larger where joints are slow, and tell more [s].

    Raises:
        InputError: As ``Connection``.
    """
    return Connection(planner, q, seconds=seconds)


def _refuse_outside(robot: Robot, q: FloatArray) -> None:
    """Refuse a start that is far outside the ranges."""
    low, high = robot.limits.q_min, robot.limits.q_max
    beyond = np.where(robot.continuous, 0.0, np.maximum(low - q, q - high))
    if (beyond <= OUTSIDE).all():
        return
    i, turns = int(np.argmax(beyond)), ~robot.chain.prismatic
    scaled, degrees = q / DEGREES, abs(q[i]) > TURN

    def inside(angles: FloatArray) -> bool:
        return bool(((angles >= low - OUTSIDE) & (angles <= high + OUTSIDE))[turns].all())

    if degrees and inside(scaled):
        remedy = (
            "as degrees all joints are inside: hand over radians, np.radians(q), and if the arm takes "
            "degrees, too, send np.degrees(step.q)"
        )
    elif degrees and inside(_within_half_a_turn(scaled)):
        remedy = (
            "as degrees from 0 to 360 all joints are inside: hand over radians from -pi to pi, "
            "np.radians((q + 180) % 360 - 180), and send degrees if the arm takes them"
        )
    elif turns[i] and inside(_within_half_a_turn(q)):
        remedy = (
            "a turn less or more, all joints are inside: hand over angles from -pi to pi, "
            "(q + np.pi) % (2 * np.pi) - np.pi"
        )
    else:
        remedy = "look at units, zeros, signs and the order of the columns, robot.joints"
    raise InputError(
        f"q puts {robot.joints[i]} at {q[i]:.4g}, far outside its range {low[i]:.4g} to {high[i]:.4g}; "
        f"{remedy}"
    )


def _within_half_a_turn(angles: FloatArray) -> FloatArray:
    """The same angles from -pi to pi [rad]."""
    return (angles + np.pi) % TURN - np.pi
