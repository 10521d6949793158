"""Frame: one picture of an arm, alike from a running session, the log of a run, and a loop of one's own."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple, final

import numpy as np

from ftqp.control.following.path_follower import PathStatus
from ftqp.control.planner.status import STATUSES
from ftqp.core.checks import BoolArray, FloatArray, IntArray, frozen
from ftqp.core.pose import quaternions, rotated, transform
from ftqp.faults.kinds import KINDS, Fault, Locked
from ftqp.kernel.entry.session import ArmSession
from ftqp.model.robot import Robot
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.signals import BODIES, FACTS, HEALTHY, PATH_CODES, PLANES, ROTATION, TASKS, names_in

BETWEEN = 0.1
"""Joints go so far between two points of the tip's way on a way out [rad or m], by convention."""
NEAR = 0.9
"""A joint beyond this share of its range is near its limit."""
AT_REST = 1e-4
"""A locked joint slower than this stands: simulated brakes give by 1e-6 rad/s for ever [rad/s or m/s]."""
_BROKEN = np.array([0, *(kind.number for kind in KINDS.values() if not kind.works)])[1:]
"""Codes of joints that do not follow their commands."""
_SENTENCES = {
    code: status.value
    for status, code in PATH_CODES.items()
    if status not in (None, PathStatus.FOLLOWING, PathStatus.SCALED)
}
"""What a path adds to the status of a step."""


class Twin(NamedTuple):
    """The rival: the same arm with the same failures, led by damped resolved rates."""

    joints: FloatArray  # As those of a frame, (nv + 1, 4, 4)
    q: FloatArray  # True joint positions, (nv,) [rad or m]
    error: float  # How far its tip is from the target [m]
    reported: bool  # Whether all that has failed was reported to it


class Solid(NamedTuple):
    """Something that stands around an arm."""

    kind: str  # ``sphere``, ``capsule``, ``box``, ``cylinder``, ``half_space`` or ``hull``
    # Half its edges; of what is round half its length along z, and its radius; of a hull how far it reaches,
    # (3,) [m]
    extent: tuple[float, ...]
    pose: tuple[float, ...]  # Where it stands, (16,) [m]
    corners: tuple[float, ...] = ()  # Of a hull, (3 V,) [m]


class FurtherFact(NamedTuple):
    """A soft task, a point or an axis that is kept somewhere, or something that the arm keeps clear of."""

    name: str  # What it is called
    value: float  # The task's error, or the distance from the plane, box or cone, positive inside [``unit``]
    unit: str  # ``m`` or ``rad``
    # Where the task's target is, or a place on the plane, (3,) [m]; None of one without a place
    place: tuple[float, ...] | None = None
    normal: tuple[float, ...] | None = None  # Of a plane, into the side that is free, (3,)
    shape: str = ""  # ``plane``, ``box`` or ``cone``; ``body`` of what stands around the arm; empty of a task
    # Of a box, its lowest and its highest corner, infinite where a side is left out, (6,) [m]
    corners: tuple[float, ...] | None = None
    solid: Solid | None = None  # Of what stands around the arm, what it is; None of the arm itself


class Ghost(NamedTuple):
    """A way out that was found for the arm, as ``ftqp.Planner.ways_out`` has it."""

    kind: str  # ``back``, ``back by the tip``, ``home``, ``halt`` or ``stop``
    clear: bool  # Whether it can be gone
    price: str  # What it takes, in a few words
    sentence: str  # All that there is to say of it
    q: FloatArray  # Postures on the way, from where the arm was to its end, (k, nv) [rad or m]
    joints: FloatArray  # As those of a frame, at its end, (nv + 1, 4, 4)
    tips: FloatArray  # Where the tip goes, (m, 3) [m]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Frame:
    """One picture; arrays are read-only, poses are in the frame of the arm's base."""

    tick: int  # Number of the tick
    t: float  # Its time [s]
    q: FloatArray  # True joint positions at its beginning, (nv,) [rad or m]
    v: FloatArray  # True joint velocities there, (nv,) [rad/s or m/s]
    truth: IntArray  # What each joint is, (nv,), codes of `ftqp.sim.log.signals.CONDITIONS`
    belief: IntArray  # What the planner believes of it, (nv,), the same codes
    position_error: float = 0.0  # Distance of the tip from its target, over the task's rows [m]
    rotation_error: float = 0.0  # Angle of the tip from its target, over the task's rows [rad]
    step_time_us: float = 0.0  # Wall time of the planner's step [us]
    further: tuple[FurtherFact, ...] = ()  # Soft tasks and kept points, always the same ones of an arm
    ways: tuple[Ghost, ...] = ()  # Ways out that were found, none while nobody asks
    rival: Twin | None = None  # None without one, or while a hand leads
    # What follows from these, see `DrawnArm.frame`:
    joints: FloatArray  # Of every joint's frame, moving about or along z, then of the tip, (nv + 1, 4, 4)
    tip: FloatArray  # Pose of the tip, (4, 4)
    target: FloatArray | None  # Where the tip should be, (4, 4); None where that is not known
    braking: BoolArray  # Which joints have a closed brake and still move, (nv,)
    near_limit: BoolArray  # Which joints are within a tenth of half their range of a limit, (nv,)
    status: str  # Name of the step's status, a member of ``ftqp.StepStatus``
    sentence: str  # The same for the operator, in plain words
    # Where each joint is in its range, -1 at its lower and 1 at its upper limit, (nv,); of a joint without
    # limits the share of half a turn from its middle
    share: FloatArray
    # Half axes of the manipulability ellipsoid of the tip's position, longest first, (3,): singular values of
    # the Jacobian over the joints that work and are believed to [m/rad]; and its axes as columns, (3, 3)
    axes: FloatArray
    axes_rotation: FloatArray
    # What is of the clock, which a log does not have:
    stage: int = 0  # How many times the arm has been replaced by another one; a page then draws the new one
    paused: bool = False  # Whether time stands
    speed: float = 1.0  # Simulated seconds in a second that were asked for
    pace: float = 1.0  # Simulated seconds in a second that the machine makes
    message: str = ""  # The last refusal or note, in plain words; empty without one


@final
class DrawnArm:
    """Kinematics and limits of one arm, for its pictures; it has a record of its own and no planner."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        n = robot.nv
        self._session = ArmSession(robot.chain.constants())
        kinematics = self._session.K.kinematics
        self._R, self._o = kinematics.R[:n].reshape(n, 3, 3), kinematics.o[:n]
        self._R_tip, self._o_tip = kinematics.R_tip.reshape(3, 3), kinematics.o_tip
        self._J = kinematics.J[:3, :n]
        low, high = robot.limits.q_min, robot.limits.q_max
        limited = np.isfinite(low) & np.isfinite(high)
        low, high = np.where(limited, low, -np.pi), np.where(limited, high, np.pi)
        self._middle, self._half = 0.5 * (low + high), 0.5 * (high - low)
        self._limited, self._turns = limited, ~limited & ~robot.chain.prismatic
        self._last = robot.neutral.copy()

    def joints(self, q: FloatArray) -> FloatArray:
        """Poses of the joints' frames, then of the tip, (nv + 1, 4, 4)."""
        self._last = np.where(np.isfinite(q), q, self._last)
        self._session.kinematics(self._last)
        n = self.robot.nv
        poses = np.zeros((n + 1, 4, 4))
        poses[:n, :3, :3], poses[:n, :3, 3] = self._R, self._o
        poses[n, :3, :3], poses[n, :3, 3] = self._R_tip, self._o_tip
        poses[:, 3, 3] = 1.0
        return frozen(poses)

    def tips(self, q: FloatArray) -> FloatArray:
        """Where the tip goes from posture to posture, (k, nv), at places between them, too, (m, 3) [m]."""
        places = [q[:1]]
        for one, two in pairwise(q):
            pieces = max(1, int(np.ceil(np.abs(two - one).max() / BETWEEN)))
            places.append(one + np.linspace(0.0, 1.0, pieces + 1)[1:, None] * (two - one))
        return frozen(np.array([self.joints(q)[-1, :3, 3] for q in np.vstack(places)]))

    def codes(self, faults: Mapping[str, Fault]) -> IntArray:
        """Codes of the conditions of all joints, of which these have failed, (nv,)."""
        codes = np.full(self.robot.nv, HEALTHY, dtype=np.int64)
        for joint, fault in faults.items():
            codes[self.robot.joint(joint)] = fault.number
        return frozen(codes)

    def frame(
        self, *, q: FloatArray, v: FloatArray, truth: IntArray, belief: IntArray, target: FloatArray,
        base: FloatArray | None = None, status: int = 0, path_status: int = 0, **given: Any,
    ) -> Frame:  # fmt: skip
        """The picture of a tick, by codes of a log; target and base are positions and quaternions, (7,)."""
        joints = self.joints(q)
        axes, rotation = self._ellipsoid(~(np.isin(truth, _BROKEN) | np.isin(belief, _BROKEN)))
        off = q - self._middle
        off = np.where(self._turns, np.remainder(off + np.pi, 2.0 * np.pi) - np.pi, off)
        share = off / self._half
        locked = (truth == Locked.number) | (belief == Locked.number)
        said, added = STATUSES[status], _SENTENCES.get(path_status)
        return Frame(
            q=frozen(q.copy()),
            v=frozen(v.copy()),
            truth=truth,
            belief=belief,
            joints=joints,
            tip=joints[-1],
            target=_in_base(target, base),
            braking=locked & (np.abs(v) > AT_REST),
            near_limit=self._limited & (np.abs(share) > NEAR),
            status=said.name,
            sentence=said.value if added is None else f"{said.value}; {added}",
            share=share,
            axes=axes,
            axes_rotation=rotation,
            **given,
        )

    def recorded(self, log: Log, tick: int) -> Frame:
        """The picture of one tick of a log, the same that a session would have shown."""
        values = {
            f"{group}.{name}": float(log[f"{group}.{name}"][tick])
            for group in FACTS
            for name in names_in(log, log.metadata, group)
        }
        return self.frame(
            tick=tick,
            t=float(log["t"][tick]),
            q=log["q"][tick],
            v=log["v"][tick],
            truth=log["truth"][tick].astype(np.int64),
            belief=log["belief"][tick].astype(np.int64),
            target=log["target"][tick],
            base=log["base"][tick] if "base_status" in log else None,
            status=int(log["status"][tick]),
            path_status=int(log["path_status"][tick]),
            position_error=float(log["position_error"][tick]),
            rotation_error=float(log["rotation_error"][tick]),
            step_time_us=float(log["step_time"][tick]),
            further=further_facts(log.metadata, values),
        )

    def _ellipsoid(self, working: BoolArray) -> tuple[FloatArray, FloatArray]:
        """Half axes (3,) and rotation (3, 3) over some joints, at the q of the last call of ``joints``."""
        U, axes, _ = np.linalg.svd(self._J * working)
        if np.linalg.det(U) < 0.0:
            U[:, 2] = -U[:, 2]
        return axes if len(axes) == 3 else np.concatenate([axes, np.zeros(3 - len(axes))]), U


def frames_of(log: Log, robot: Robot, ticks: Iterable[int] | None = None) -> Iterator[Frame]:
    """The pictures of a run, the same that a session would have shown at those ticks."""
    arm = DrawnArm(robot)
    for tick in range(len(log)) if ticks is None else ticks:
        yield arm.recorded(log, tick)


def placed(pose: FloatArray) -> FloatArray:
    """Position and quaternion x, y, z, w of a pose (4, 4), as a log keeps them, (7,)."""
    return np.concatenate([pose[:3, 3], quaternions(pose[None, :3, :3])[0]])


def _in_base(target: FloatArray, base: FloatArray | None) -> FloatArray | None:
    """The pose of the target in the frame of the base, (4, 4); None where it is not known."""
    T = transform(rotation_of(target[3:]), target[:3])
    if base is not None:
        R = rotation_of(base[3:])
        T = transform(R.T @ T[:3, :3], R.T @ (T[:3, 3] - base[:3]))
    return frozen(T) if np.isfinite(T).all() else None


def rotation_of(quaternion: FloatArray) -> FloatArray:
    """The rotation (3, 3) of a unit quaternion x, y, z, w; NaN where it is far from one."""
    if not (np.abs(quaternion) < 2.0).all():
        return np.full((3, 3), np.nan)
    columns: FloatArray = rotated(np.asarray(quaternion)[None], np.eye(3)[None])[0]
    return columns.T


def further_facts(about: Mapping[str, Any], values: Mapping[str, float]) -> tuple[FurtherFact, ...]:
    """Soft tasks, kept points and scene, of the metadata of a log and the values of its signals by name."""
    tasks = {
        one["name"]: FurtherFact(one["name"], 0.0, one.get("unit", ""), _three(one.get("place")))
        for one in about.get(FACTS[TASKS], [])
    }
    tasks |= {name + ROTATION: FurtherFact(name + ROTATION, 0.0, "rad") for name in tasks}
    kept = {
        one["name"]: FurtherFact(
            one["name"],
            0.0,
            one.get("unit", "rad" if one.get("kind") == "cone" else "m"),
            _three(one.get("above")),
            _three(one.get("normal")),
            one.get("kind", "plane"),
            _corners(one.get("inside")),
        )
        for one in about.get(FACTS[PLANES], [])
    }
    bodies = {
        one["name"]: FurtherFact(one["name"], 0.0, "m", shape="body", solid=_solid(one))
        for one in about.get(FACTS[BODIES], [])
    }
    return tuple(
        known[name]._replace(value=values[f"{group}.{name}"])
        for group, known in ((TASKS, tasks), (PLANES, kept), (BODIES, bodies))
        for name in names_in(values, about, group)
    )


def _solid(one: dict[str, Any]) -> Solid | None:
    """What something of a scene is; None of the arm itself."""
    if one["kind"] == "arm":
        return None
    pose, corners = (tuple(np.ravel(one.get(name, ())).tolist()) for name in ("pose", "corners"))
    return Solid(one["kind"], tuple(one["extent"]), pose, corners)


def _corners(inside: Any) -> tuple[float, ...] | None:
    """The corners of a box, of which a log leaves out what is infinite."""
    if inside is None:
        return None
    ends = zip(inside, (-np.inf, np.inf), strict=True)
    return tuple(end if place is None else float(place) for corner, end in ends for place in corner)


def _three(place: Any) -> tuple[float, ...] | None:
    return None if place is None else tuple(map(float, place))
