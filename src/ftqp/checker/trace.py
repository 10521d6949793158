"""What a checker is shown of a run: truth, commands, claims and failures; and how strictly it judges."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import final

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray
from ftqp.core.errors import unknown

ROWS = ("x", "y", "z", "rx", "ry", "rz")
"""The rows that a task may have."""
KINDS = ("locked", "free", "degraded")
"""What the laws know of a joint that has failed."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Failure:
    """What really happened to a joint."""

    joint: int  # Its 0-based index
    kind: str  # One of ``KINDS``
    since: float  # When it failed [s]
    reported_at: float  # When it was reported to the planner [s]; infinite without that
    # Of a weakened joint, what is left of ``q_min``, ``q_max``, ``v_max``, ``a_max``, ``tau_max``
    shares: Mapping[str, float] = field(default_factory=dict)
    jumps: bool = False  # Whether it stops in no time, and the others jump with it
    until: float = float("inf")  # When another failure of the same joint takes its place [s]
    # With which the planner may bring its command for the joint to rest once it knows [rad/s2 or m/s2];
    # infinite: at once
    deceleration: float = float("inf")
    closes: float = 0.0  # How long after that what holds a locked joint takes to close [s]
    # Whether what holds a locked joint may be too weak, so that its motion is nobody's doing
    slips: bool = False

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise unknown("kind of failure", self.kind, "the checker", KINDS)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Plane:
    """A plane on whose side a point of the arm was to stay: normal'p >= offset."""

    joint: int  # 0-based index of the joint that the point moves with
    at_zero: Sequence[float]  # Where the point is while all joints are at 0, in the base frame, (3,) [m]
    normal: Sequence[float]  # Of length 1, into the side that is free, (3,)
    offset: float  # The plane's distance from the base's origin along the normal [m]


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Cone:
    """A cone in which an axis of the arm was to stay."""

    joint: int  # 0-based index of the joint that the axis moves with
    # Where the frame of the axis is while all joints are at 0, in the base frame, (3,) [m]
    at_zero: Sequence[float]
    axis_at_zero: Sequence[float]  # The axis then, of length 1, (3,)
    along: Sequence[float]  # The middle of the cone in the base frame, of length 1, (3,)
    within: float  # How far the axis may lean from it [rad]


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """A link of the arm as a capsule."""

    name: str  # What it is called
    joint: int  # 0-based index of the joint that it moves with; -1 of none
    # Where its ends are while all joints are at 0, in the base frame, (2, 3) [m]
    ends_at_zero: Sequence[Sequence[float]]
    radius: float  # [m]
    # Of the convex body inside, the same; none of a link that is its capsule, (V, 3) [m]
    corners_at_zero: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Thing:
    """Something that stands around the arm."""

    name: str  # What it is called
    kind: str  # ``sphere``, ``capsule``, ``box``, ``cylinder``, ``half_space`` or ``hull``
    extent: Sequence[float]  # Half its edges; of what is round half its length along z, and its radius [m]
    pose: FloatArray  # Where it stands, (4, 4) [m]
    # Of a hull, in its own frame, (V, 3) [m]
    corners: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HeldTask:
    """A task that goes before that of the tip: a frame, an axis or the centre of mass, and its target."""

    name: str  # What it is called
    kind: str  # ``pose``, ``relative``, ``position``, ``axis`` or ``centre_of_mass``
    rows: Sequence[str]  # The rows that count, of x, y, z, rx, ry, rz, along the axes of the base
    joint: int  # 0-based index of the joint that the frame moves with; -1 of none
    # The frame while all joints are at 0, in the base frame, (4, 4) [m]. Of a point it is there.
    at_zero: FloatArray
    # Its pose, (4, 4) [m], that in the other frame of ``relative``; of ``position`` and ``centre_of_mass`` a
    # place, (3,) [m]; of ``axis`` a direction, or a place to point at
    target: FloatArray
    axis: FloatArray | None = None  # Of ``axis``, the axis in the frame, (3,)
    towards: bool = False  # Whether the target of ``axis`` is a place
    # 0-based index of the joint that the other frame moves with, of which the target is one; -1
    other: int = -1
    # That frame while all joints are at 0, in the base frame, (4, 4) [m]
    other_at_zero: FloatArray | None = None


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Rest:
    """What was left of a task after the last failure of a run, and what became of it."""

    joint: int  # 0-based index of the joint that failed last
    since: float  # At which share of the motion it did
    feasible: bool  # Whether a search found a motion of the joints left that does all that was left
    # By how much the arm missed its end: share of the tolerance beyond it, or of the path that is left; 0
    # where it finished
    missed: float
    stopped: bool  # Whether it was stopped instead, and said so


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trace:
    """A run, tick by tick; the plant is asked, not the planner."""

    dt: float  # Sampling period [s]
    level: str  # ``acceleration`` or ``velocity``: what is held during a tick
    q: FloatArray  # True positions at the start of each tick, and at the end, (K + 1, nv) [rad or m]
    v: FloatArray  # True velocities likewise, (K + 1, nv) [rad/s or m/s]
    sent_q: FloatArray  # Positions that were sent, for the end of each tick, (K, nv) [rad or m]
    sent_v: FloatArray  # Velocities that were sent, (K, nv) [rad/s or m/s]
    status: Sequence[str]  # What the planner claimed of each tick, (K,) names
    target: FloatArray  # What was asked, (K, 4, 4) [m]
    rows: Sequence[str]  # The rows of the task, of x, y, z, rx, ry, rz
    # Largest position [m] and rotation error [rad] at which the task counts as followed
    tolerance: tuple[float, float]
    failures: Sequence[Failure] = ()  # What failed
    # A direction in the tip frame, (3,), whose own direction alone counts of the rotation; None: as ``rows``
    # says
    axis: tuple[float, float, float] | None = None
    # Whether the target is known to be within reach, speed and strength of what works
    can_be_followed: bool = False
    until: float = float("inf")  # ... for how long; to the end without that [s].
    planes: Sequence[Plane] = ()  # On whose sides points were to stay
    minds_torques: bool = True  # Whether the planner was to keep torque limits
    brakes: bool = False  # Whether the arm has brakes that close when the planner asks for them
    cones: Sequence[Cone] = ()  # In which axes were to stay
    held: Sequence[HeldTask] = ()  # Tasks that were to be kept before that of the tip
    bodies: Sequence[Body] = ()  # The links
    things: Sequence[Thing] = ()  # What stands around them
    watched: Sequence[tuple[str, str]] = ()  # The names of the pairs that were to be kept apart, ..
    keep: float = 0.0  # ... and how far [m].
    # A path that waits for its arm, in steps of ``path_dt`` of its own time, (N, 4, 4) [m]; None where the
    # clock leads
    path: FloatArray | None = None
    path_dt: float = 0.0  # [s]
    # Of that path, the time that each tick has reached, (K,) [s]
    progress: FloatArray = field(default_factory=lambda: np.zeros(0))
    rest: Rest | None = None  # What was left of the task after the last failure, where somebody has looked
    holds: Sequence[tuple[float, float]] = ()  # When all joints were held at once, and until when [s]
    # Which failed joints the planner counts on, (K, nv); a row of one for all where none
    blamed: BoolArray = field(default_factory=lambda: np.zeros((1, 1), dtype=np.bool_))

    @property
    def t(self) -> FloatArray:
        """When each tick begins, (K,) [s]."""
        return np.asarray(self.dt * np.arange(len(self.status)), dtype=np.float64)

    @property
    def claims_ok(self) -> BoolArray:
        """At which ticks OK was claimed, (K,)."""
        return np.array([status == "OK" for status in self.status])


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Strictness:
    """What is let pass."""

    speed: float = 1e-9  # Share of the speed limit
    acceleration: float = 1e-6  # Share of the acceleration limit
    torque: float = 1e-6  # Share of the torque limit
    position: float = 1e-9  # Beyond the range of a joint, in all [rad or m]
    plane: float = 2e-5  # Beyond the plane of a point [m]
    body: float = 1e-3  # Nearer than bodies are to be kept apart [m]
    creep: float = 0.0  # How far a locked joint may move, or be sent, in all [rad or m]
    standing: float = 0.0  # Speed below which a locked joint stands [rad/s or m/s]
    grace: float = 0.0  # How long a claim may be wrong [s]
    blow: float = 0.0  # How long a joint that strikes its end stop throws the others [s]
    calm: float = 1.0  # How long an arm whose target rests may take to come to rest [s]
    noise: float = 0.0  # Standard deviation of the measured positions [rad or m]


KINEMATIC = Strictness()
"""Of a plant that follows its commands exactly."""
PHYSICS = Strictness(
    speed=0.02,
    acceleration=float("inf"),
    torque=0.02,
    position=0.02,
    plane=0.01,
    body=0.01,
    creep=5e-4,
    standing=1e-2,
    grace=0.1,
    blow=5e-3,
    calm=2.0,
)
"""Of an arm with drives, sensors and friction: 2 %, and a tenth of a second to notice what happened."""
