"""Frame: what a picture of an arm needs, alike from a session and a log; and what gives frames to a page."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol, final

import numpy as np

from ftqp.control.following.path_follower import PathStatus
from ftqp.control.planner.status import STATUSES
from ftqp.core.checks import BoolArray, FloatArray, frozen
from ftqp.core.pose import rotated, transform
from ftqp.faults.kinds import KINDS, Locked
from ftqp.kernel.entry.session import ArmSession
from ftqp.model.robot import Robot
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.signals import PATH_CODES
from ftqp.sim.session.session_commands import Command
from ftqp.sim.session.tick_facts import Facts, FurtherFact, IntArray, WayFact, facts_of

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
SHARED = (
    "stage", "tick", "t", "paused", "speed", "pace", "truth", "belief", "position_error", "rotation_error",
    "q", "v", "message", "further",
)  # fmt: skip
"""What a frame takes from the facts of a tick as it is."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ghost:
    """A way out as it is drawn: ``Frame.joints`` at its end, and where the tip goes, (k, 3) [m]."""

    way: WayFact
    joints: FloatArray
    tips: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Frame:
    """One picture; arrays are read-only, poses are in the frame of the arm's base.

    Attributes:
        stage: How many times the arm has been replaced by another one; a page then draws the new one.
        tick: Number of the tick.
        t: Its time [s].
        paused: Whether time stands.
        speed: Simulated seconds in a second that were asked for.
        pace: Simulated seconds in a second that the machine makes.
        joints: Pose of every joint's frame, which its motion is about or along z, then of the tip,
            (nv + 1, 4, 4).
        tip: Pose of the tip, (4, 4).
        target: Where the tip should be, (4, 4); None where that is not known.
        rival: ``joints`` of the rival, (nv + 1, 4, 4); None without one, or while a hand leads.
        rival_told: Whether it has been told of all that has failed.
        rival_error: How far its tip is from the target [m]; 0 without a rival.
        truth: What each joint is, (nv,), codes of `ftqp.sim.log.signals.CONDITIONS`.
        belief: What the planner believes of it, (nv,), the same codes.
        braking: Which joints have a closed brake and still move, (nv,).
        near_limit: Which joints are within a tenth of half their range of a limit, (nv,).
        status: Name of the step's status, a member of ``ftqp.StepStatus``.
        sentence: The same for the operator, in plain words.
        position_error: Distance of the tip from its target, over the task's rows [m].
        rotation_error: Angle of the tip from its target, over the task's rows [rad].
        q: Joint positions, (nv,) [rad or m].
        v: Joint velocities, (nv,) [rad/s or m/s].
        share: Where each joint is in its range, -1 at its lower and 1 at its upper limit, (nv,); of a joint
            without limits the share of half a turn from its middle.
        axes: Half axes of the manipulability ellipsoid of the tip's position, longest first, (3,): singular
            values of the Jacobian over the joints that work and are believed to [m/rad].
        axes_rotation: Its axes as columns of a rotation, (3, 3).
        step_time_us: Wall time of the planner's step [us].
        message: The last refusal or note, in plain words; empty without one.
        further: Soft tasks and kept points, always the same ones of an arm.
        ways: Ways out that were found, none while nobody asks.
    """

    stage: int
    tick: int
    t: float
    paused: bool
    speed: float
    pace: float
    joints: FloatArray
    tip: FloatArray
    target: FloatArray | None
    rival: FloatArray | None
    rival_told: bool
    rival_error: float
    truth: IntArray
    belief: IntArray
    braking: BoolArray
    near_limit: BoolArray
    status: str
    sentence: str
    position_error: float
    rotation_error: float
    q: FloatArray
    v: FloatArray
    share: FloatArray
    axes: FloatArray
    axes_rotation: FloatArray
    step_time_us: float
    message: str
    further: tuple[FurtherFact, ...] = ()
    ways: tuple[Ghost, ...] = ()


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
        self._found: tuple[WayFact, ...] = ()
        self._ghosts: tuple[Ghost, ...] = ()

    def ghosts(self, ways: tuple[WayFact, ...]) -> tuple[Ghost, ...]:
        """Ways out as they are drawn; the same objects for the same ways."""
        if ways is not self._found:
            last = self._last
            self._found, self._ghosts = ways, tuple(self._ghost(way) for way in ways)
            self._last = last
        return self._ghosts

    def _ghost(self, way: WayFact) -> Ghost:
        """One of them: its end, and the tip at places between its postures, too."""
        places = [way.q[:1]]
        for one, two in pairwise(way.q):
            pieces = max(1, int(np.ceil(np.abs(two - one).max() / BETWEEN)))
            places.append(one + np.linspace(0.0, 1.0, pieces + 1)[1:, None] * (two - one))
        tips = np.array([self.joints(q)[-1, :3, 3] for q in np.vstack(places)])
        return Ghost(way=way, joints=frozen(self.joints(way.q[-1])), tips=frozen(tips))

    def joints(self, q: FloatArray) -> FloatArray:
        """Poses of the joints' frames, then of the tip, (nv + 1, 4, 4).

        A position that is NaN or infinite counts as the last that was not.
        """
        self._last = np.where(np.isfinite(q), q, self._last)
        self._session.kinematics(self._last)
        n = self.robot.nv
        poses = np.zeros((n + 1, 4, 4))
        poses[:n, :3, :3], poses[:n, :3, 3] = self._R, self._o
        poses[n, :3, :3], poses[n, :3, 3] = self._R_tip, self._o_tip
        poses[:, 3, 3] = 1.0
        return poses

    def ellipsoid(self, working: BoolArray) -> tuple[FloatArray, FloatArray]:
        """Half axes (3,) and rotation (3, 3) over some joints, at the q of the last call of ``joints``."""
        U, axes, _ = np.linalg.svd(self._J * working)
        if np.linalg.det(U) < 0.0:
            U[:, 2] = -U[:, 2]
        return axes if len(axes) == 3 else np.concatenate([axes, np.zeros(3 - len(axes))]), U

    def share(self, q: FloatArray) -> FloatArray:
        """Where each joint is in its range, (nv,)."""
        off = q - self._middle
        off = np.where(self._turns, np.remainder(off + np.pi, 2.0 * np.pi) - np.pi, off)
        result: FloatArray = off / self._half
        return result

    def near(self, share: FloatArray) -> BoolArray:
        """Which joints are near a limit, (nv,)."""
        result: BoolArray = self._limited & (np.abs(share) > NEAR)
        return result


def frame_of(facts: Facts, arm: DrawnArm) -> Frame:
    """The picture of one tick."""
    ghosts = arm.ghosts(facts.ways)
    rival = None if facts.twin is None else arm.joints(facts.twin.q)
    joints = arm.joints(facts.q)
    fails = np.isin(facts.truth, _BROKEN) | np.isin(facts.belief, _BROKEN)
    axes, rotation = arm.ellipsoid(~fails)
    share = arm.share(facts.q)
    locked = (facts.truth == Locked.number) | (facts.belief == Locked.number)
    added = _SENTENCES.get(facts.path_status)
    status = STATUSES[facts.status]
    twin = facts.twin
    return Frame(
        **{name: getattr(facts, name) for name in SHARED},
        joints=frozen(joints),
        tip=frozen(joints[-1]),
        target=_target(facts),
        rival=None if rival is None else frozen(rival),
        rival_told=twin is not None and twin.told,
        rival_error=0.0 if twin is None else twin.position_error,
        braking=locked & (np.abs(facts.v) > AT_REST),
        near_limit=arm.near(share),
        status=status.name,
        sentence=status.value if added is None else f"{status.value}; {added}",
        share=share,
        axes=axes,
        axes_rotation=rotation,
        step_time_us=facts.step_time,
        ways=ghosts,
    )


def frames_of(log: Log, robot: Robot, ticks: Iterable[int] | None = None) -> Iterator[Frame]:
    """The pictures of a run, the same that a session would have shown at those ticks."""
    arm = DrawnArm(robot)
    for tick in range(len(log)) if ticks is None else ticks:
        yield frame_of(facts_of(log, tick), arm)


def _target(facts: Facts) -> FloatArray | None:
    """The target in the frame of the base."""
    target = transform(rotation_of(facts.target_quaternion), facts.target_position)
    if facts.base_position is not None and facts.base_quaternion is not None:
        R = rotation_of(facts.base_quaternion)
        target = transform(R.T @ target[:3, :3], R.T @ (target[:3, 3] - facts.base_position))
    return frozen(target) if np.isfinite(target).all() else None


def rotation_of(quaternion: FloatArray) -> FloatArray:
    """The rotation (3, 3) of a unit quaternion x, y, z, w; NaN where it is far from one."""
    if not (np.abs(quaternion) < 2.0).all():
        return np.full((3, 3), np.nan)
    columns: FloatArray = rotated(np.asarray(quaternion)[None], np.eye(3)[None])[0]
    return columns.T


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HeatMap:
    """Which failures a motion survives, for a picture that can be clicked: ``coverage`` of them, from 0 to 1.

    Codes are the verdicts, (nv, K), on a failure of each joint at each time, (K,) [s]; each has words and a
    colour, ``#rrggbb``.
    """

    joints: tuple[str, ...]
    times: FloatArray
    codes: IntArray
    words: Mapping[int, str]
    colours: Mapping[int, str]
    coverage: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stage:
    """What stays the same from frame to frame until the arm is replaced by another one.

    Attributes:
        number: That of the frames which belong to it, ``Frame.stage``.
        title: What is shown, for the head of the page.
        robot: The arm.
        scheme: Name of the scheme.
        backend: Name of the backend.
        tell: How the planner learns of failures, one of `ftqp.sim.session.session_commands.TELLS`.
        path: Points of the path in the frame of the base, (K, 3) [m]; None where there is none to draw.
        urdf: The URDF that the arm was read from, whose meshes can be drawn; None of an arm without one.
        live: Whether joints can be broken; a replay takes ``Pause``, ``Speed`` and ``Seek`` only.
        duration: The end of a replay [s]; None of a live session.
        robots: Catalog robots that ``Use`` takes; none in a replay.
        scenarios: Bundled scenarios that ``Use`` takes; none in a replay.
        schemes: Schemes that ``Use`` takes; none in a replay.
        backends: Backends that ``Use`` takes and that are installed; none in a replay.
        box: Whether a box was put beside the path.
        heat: Which failures the motion survives, each of which can be a ``Play``; None without a coverage
            report.
    """

    number: int
    title: str
    robot: Robot
    scheme: str
    backend: str
    tell: str = "at once"
    path: FloatArray | None = None
    urdf: str | None = None
    live: bool = True
    duration: float | None = None
    robots: Sequence[str] = ()
    scenarios: Sequence[str] = ()
    schemes: Sequence[str] = ()
    backends: Sequence[str] = ()
    box: bool = False
    heat: HeatMap | None = None


class Source(Protocol):
    """The role of what gives a page its frames and takes its commands; any thread may call any method."""

    def frame(self) -> Frame:
        """The latest frame."""

    def stage(self) -> Stage:
        """The stage; that of the latest frame, or a later one."""

    def put(self, command: Command) -> None:
        """Ask for something; it is applied between two ticks, and a refusal is the ``message`` of a frame."""
