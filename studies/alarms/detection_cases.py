"""Motions and faults of the study of detection, all from a seed."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from alarms.detection_world import DT, Array, Configuration, Record, World, world

import ftqp
from ftqp.sim.plants.hidden_faults import Jammed, Misread, Runaway, Weakened
from ftqp.sim.sensors.joint_sensors import Dropped, Frozen, Offset, SensorFault

MOTION = 4.0
"""How long a motion takes [s]."""
STAND = 0.5
"""How long the arm stands after it [s]."""
WATCHED, SENSOR_WATCHED = 300, 100
"""Ticks after the fault that are watched, the second where an encoder fails."""
CANDIDATES = range(700, 3651, 50)
"""Ticks at which something may fail."""
MOVING, MOVING_FOR = 0.1, 120
"""A joint that locks, runs away or is read wrongly moves so fast [rad/s], so long [ticks]."""
VISIBLE = 1.0
"""Acceleration [rad/s2] that a fault of the torque takes from its joint, at least."""
STRAINED = 0.9
"""Motors of a healthy arm are asked for less than this share of what they can."""
CHUNK = 500
"""After so many ticks it is looked whether the arm follows."""
BIAS = 0.02
"""Step of a biased encoder [rad]."""
REGULAR, MIDDLE, LOAD = 0.15, 0.7, 0.6
"""Starts: smallest singular value, share of the ranges, largest share of a torque limit that is weight."""
TOUR = 5
"""Motions in a row of a healthy tour."""
CARRIED = ((0.0, 0.5), (0.5, 0.5), (1.0, 0.5))
"""Loads [kg] and dry friction [N m] with which the real setting is calibrated ..."""
OTHER = ((0.0, 0.35), (0.25, 0.65), (0.4, 0.4), (0.75, 0.5), (1.0, 0.65))
"""... and those of its healthy tours, none of which was calibrated."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of case.

    Attributes:
        named: what a detector should call it.
        share: what is left of the motor's torque, for faults of the torque; None for all others.
        sensor: whether an encoder fails.
        servo: whether there is such a case only behind servos.
    """

    named: str
    share: float | None = None
    sensor: bool = False
    servo: bool = False


KINDS = {
    "locked, motor off": Kind("locked"),
    "locked, motor on": Kind("locked"),
    "free": Kind("free_swinging", share=0.0),
    "degraded": Kind("degraded", share=0.5),
    "runaway": Kind("runaway"),
    "frozen": Kind("sensor_frozen", sensor=True),
    "frozen, servo too": Kind("sensor_frozen", sensor=True, servo=True),
    "biased": Kind("sensor_biased", sensor=True),
    "biased, servo too": Kind("sensor_biased", sensor=True, servo=True),
    "dropped": Kind("sensor_dropped", sensor=True),
}
"""All kinds, by name."""


@dataclass(slots=True)
class Case:
    """One fault, and what was seen of it.

    Attributes:
        kind: its name in `KINDS`.
        joint: which, from 0.
        at: the tick of the motion at which it happens.
        record: the ticks from then on.
        speed: of the joint's reference at the fault [rad/s].
        loss: acceleration that a fault of the torque takes from the joint [rad/s2], else 0.
    """

    kind: str
    joint: int
    at: int
    record: Record
    speed: float
    loss: float


def start(robot: ftqp.Robot, generator: np.random.Generator, share: float = MIDDLE) -> Array:
    """A posture in the middle share of the ranges, far from singularities and from what gravity forbids."""
    low, high = (np.clip(limit, -3.0, 3.0) for limit in (robot.limits.q_min, robot.limits.q_max))
    middle, half = 0.5 * (low + high), 0.5 * share * (high - low)
    data, tip = robot.model.createData(), robot.model.getFrameId(robot.tip)
    while True:
        q: Array = middle + half * generator.uniform(-1.0, 1.0, robot.nv)
        J = pin.computeFrameJacobian(robot.model, data, q, tip, pin.LOCAL_WORLD_ALIGNED)
        J[:3] /= robot.length
        weight = np.abs(pin.rnea(robot.model, data, q, np.zeros(robot.nv), np.zeros(robot.nv)))
        if np.linalg.svd(J, compute_uv=False)[-1] > REGULAR and (weight < LOAD * robot.limits.tau_max).all():
            return q


def path(pose: Array, generator: np.random.Generator) -> Any:
    """A circle, a line there and back, or random via points, from a pose on."""
    axes = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    which = generator.integers(3)
    if which == 0:
        radius = generator.uniform(0.05, 0.15)
        return ftqp.paths.Circle(pose, radius, axes=(axes[0], axes[1]), duration=MOTION)
    if which == 1:
        far = generator.uniform(0.1, 0.25) * axes[0]
        return ftqp.paths.Waypoints(pose, np.array([far, 0.0 * far]), duration=MOTION, relative=True)
    via = generator.uniform(-0.1, 0.1, size=(4, 3))
    return ftqp.paths.Waypoints(pose, via, duration=MOTION, relative=True)


def targets(led: Sequence[Any]) -> ftqp.Targets:
    """The targets of paths at every tick, one after the other, and of standing at the end of each."""
    t = DT * np.arange(round((MOTION + STAND) / DT))
    poses, twists, accelerations = [], [], []
    for one in led:
        sample = one.sample(np.minimum(t, MOTION))
        moves = (t < MOTION)[:, None]
        poses.append(sample.pose)
        twists.append(np.where(moves, sample.twist, 0.0))
        accelerations.append(np.where(moves, sample.acceleration, 0.0))
    return ftqp.Targets(*(np.concatenate(each) for each in (poses, twists, accelerations)))


def healthy(there: World, generator: np.random.Generator, kept: dict[int, Any] | None = None) -> Any:
    """One healthy motion, and its targets; (None, None) if the arm could not follow it."""
    q = start(there.robot, generator)
    led = targets([path(there.robot.pose(q), generator)])
    record = there.begin(q, len(led), generator)
    whole = followed(there, record, led, kept) == len(led)
    return (record, led) if whole else (None, None)


def tour(configuration: Configuration, seed: list[int], worn: Sequence[tuple[float, float]]) -> Record:
    """Motions in a row, with standstill between them, as far as the arm can follow them.

    Args:
        configuration: which arm.
        seed: of everything.
        worn: loads [kg] and dry friction [N m], of which the arm has one if its setting is real.
    """
    generator = np.random.default_rng(seed)
    real = configuration.setting == "real"
    there = world(configuration, *(worn[generator.integers(len(worn))] if real else ()))
    while True:
        q = start(there.robot, generator)
        led, at = [], there.robot.pose(q)
        for _ in range(TOUR):
            led.append(path(at, generator))
            at = led[-1].sample(np.array([MOTION])).pose[0]
        wanted = targets(led)
        record = there.begin(q, len(wanted), generator)
        done = followed(there, record, wanted)
        if done >= CHUNK * 2:
            return record.part(0, done)


def followed(there: World, record: Record, led: ftqp.Targets, kept: dict[int, Any] | None = None) -> int:
    """Follow targets as long as every step is OK and no motor near its limit: how many ticks."""
    for first in range(0, len(led), CHUNK):
        end = min(first + CHUNK, len(led))
        there.run(record, led, first, end, kept=kept)
        strained = np.abs(record.truth[first:end, 2]) > STRAINED * there.robot.limits.tau_max
        if record.codes[first:end].any() or strained.any():
            return first
    return len(led)


@dataclass(slots=True)
class Motion:
    """A motion from rest, as the healthy arm makes it, and what becomes of it.

    Attributes:
        record: of the healthy arm.
        cases: the faults, each from its tick on in place of the healthy motion.
    """

    record: Record
    cases: list[Case]


def motion(configuration: Configuration, seed: list[int], kinds: Iterable[str], each: int = 2) -> Motion:
    """A random motion with ``each`` cases of every kind, fewer where there is no place for so many."""
    there, generator = world(configuration), np.random.default_rng(seed)
    while True:
        kept: dict[int, Any] = dict.fromkeys(CANDIDATES)
        trunk, led = healthy(there, generator, kept)
        if trunk is not None:
            break
    moving, lost = _eligible(there, trunk)
    found = Motion(trunk, [])
    for name in kinds:
        kind = KINDS[name]
        if kind.servo and not configuration.has_servo:
            continue
        loss = lost * (0.0 if kind.share is None else 1.0 - kind.share)
        places = np.argwhere(moving if kind.share is None else loss >= VISIBLE)
        for c, joint in generator.permutation(places)[:each]:
            at, direction = CANDIDATES[int(c)], int(generator.choice([-1, 1]))
            end = at + (SENSOR_WATCHED if kind.sensor else WATCHED)
            there.restore(kept[at])
            fault = befall(there, name, int(joint), direction)
            record = branch(there, trunk, led, at, end, fault, int(joint))
            speed = float(trunk.v_r[at, joint])
            found.cases.append(Case(name, int(joint), at, record, speed, float(loss[c, joint])))
    return found


def branch(
    there: World, trunk: Record, led: ftqp.Targets, at: int, end: int, fault: SensorFault | None, joint: int
) -> Record:
    """What happens from tick ``at`` on in place of what the trunk says, which is left as it was."""
    healthy_part, here = trunk.part(at, end).copy(), trunk.part(at, end)
    there.run(trunk, led, at, end, fault, joint, at)
    result = here.copy()
    here.seen[:], here.truth[:], here.codes[:] = healthy_part.seen, healthy_part.truth, healthy_part.codes
    return result


def _eligible(there: World, trunk: Record) -> tuple[Array, Array]:
    """By candidate and joint: whether it moves long enough, and |M a_r + h|_i/M_ii [rad/s2]."""
    speed = np.abs(trunk.v_r)
    moving = np.array([(speed[k : k + MOVING_FOR] >= MOVING).all(axis=0) for k in CANDIDATES])
    lost = np.zeros(moving.shape)
    for c, k in enumerate(CANDIDATES):
        M, h = there.arm.dynamics(trunk.q_r[k], trunk.v_r[k])
        lost[c] = np.abs(M @ trunk.a_r[k] + h) / np.diag(M)
    return moving, lost


def befall(there: World, name: str, joint: int, direction: int) -> SensorFault | None:
    """Let it happen to the arm; what the encoder does from now on is given back."""
    plant = there.plant
    match name:
        case "locked, motor off":
            plant.fail(ftqp.Locked(joint))
        case "locked, motor on":
            plant.suffer(Jammed(joint))
        case "free":
            plant.fail(ftqp.FreeSwinging(joint))
        case "degraded":
            plant.suffer(Weakened(joint, 0.5))
        case "runaway":
            plant.suffer(Runaway(joint, direction))
        case "frozen":
            return Frozen(joint=joint)
        case "frozen, servo too":
            plant.suffer(Misread(joint, frozen=True))
            return Frozen(joint=joint)
        case "biased":
            return Offset(joint=joint, size=direction * BIAS)
        case "biased, servo too":
            plant.suffer(Misread(joint, bias=direction * BIAS))
            return Offset(joint=joint, size=direction * BIAS)
        case "dropped":
            return Dropped(joint=joint)
    return None
