"""Capsules: rods with round ends, of which the bodies of an arm are made for distances."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ftqp.core.checks import FloatArray, IntArray, array, frozen, positive
from ftqp.core.errors import InputError
from ftqp.core.setting import REQUIRED, setting

CALLED = "what it is called; what it is, and its number, if absent"
"""What a file says of a name."""
Three = tuple[float, float, float]
"""What a file says of a place."""
LARGEST = 100.0
"""A body longer than this [m] was written in millimetres. A convention."""
WORLD = "universe"
"""The frame of bodies that do not move, as pinocchio calls it."""
STICKS_OUT = 1e-4
"""Corners of a body may stick out of its capsule by so much [m]: published capsules are rounded."""
THICKNESS = 0.05
"""Radius of an estimated capsule, as a share of the reach: a Panda's links have 0.06 to 0.1. A convention."""


def length_of(name: str, value: Any) -> float:
    """A length > 0 [m]."""
    found = positive(name, value, "m")
    if found > LARGEST:
        raise InputError(f"{name} is {found:g} m, expected at most {LARGEST:g} m; are these millimetres?")
    return found


def turned_along(z: FloatArray) -> FloatArray:
    """A rotation whose z axis is a direction of length 1, (3, 3)."""
    x = np.zeros(3)
    x[int(np.argmin(np.abs(z)))] = 1.0
    x -= z * (x @ z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


@dataclass(frozen=True, slots=True)
class Capsule:
    """All that is nearer to a line between two points than a radius: a rod with round ends.

    Args:
        a: One end of the line, (3,) [m].
        b: The other end, (3,) [m]; the same point makes a ball.
        radius: > 0 [m].
        frame: The frame, link or joint of a robot that it moves with; None is the world, for a scene.
        name: What it is called; None is its frame.
        estimated: Whether it was guessed from where the joints are, and from nothing that is known of links.
        corners: Of the convex body inside that it stands for, (k, 3) [m], in the same frame. Of a body of an
            arm distances are then those of this hull. None: the capsule is the body.
    """

    a: Any = setting(REQUIRED, "one end of its line", of=Three, unit="m")
    b: Any = setting(REQUIRED, "the other end", of=Three, unit="m")
    radius: float = setting(REQUIRED, "its radius, > 0", unit="m", above=0.0)
    frame: str | None = setting(None, "of a body of the arm, the frame, link or joint that it moves with")
    name: str | None = setting(None, CALLED)
    estimated: bool = False
    corners: Any = None

    def __post_init__(self) -> None:
        for end in ("a", "b"):
            object.__setattr__(self, end, frozen(array(end, getattr(self, end), (3,), "(3,)")))
        object.__setattr__(self, "radius", length_of("radius", self.radius))
        length = float(np.linalg.norm(self.b - self.a))
        if length > LARGEST:
            raise InputError(
                f"a and b are {length:g} m apart, expected at most {LARGEST:g} m; are these millimetres?"
            )
        if self.corners is not None:
            self._take_corners()
        for word in ("frame", "name"):
            value = getattr(self, word)
            if value is not None and not (isinstance(value, str) and value):
                raise InputError(f"{word} is {value!r:.60}, expected a word such as 'panda_link5', or None")

    def _take_corners(self) -> None:
        """The corners, none of which may stick out."""
        points = array("corners", self.corners, (max(len(np.atleast_1d(self.corners)), 1), 3), "(k, 3)")
        way = self.b - self.a
        along = np.clip((points - self.a) @ way / max(float(way @ way), 1e-24), 0.0, 1.0)
        out = np.linalg.norm(points - self.a - along[:, None] * way, axis=1) - self.radius
        if out.max() > STICKS_OUT:
            raise InputError(
                f"corner {int(np.argmax(out))} sticks {1e3 * out.max():.3g} mm out of the capsule, expected "
                "all corners inside; make its radius larger"
            )
        object.__setattr__(self, "corners", frozen(points))

    @property
    def label(self) -> str:
        """What it is called."""
        return self.name or self.frame or "capsule"

    @property
    def extent(self) -> tuple[float, float, float]:
        """Half the length and the radius, as the kernel takes them [m]."""
        return 0.5 * float(np.linalg.norm(self.b - self.a)), self.radius, 0.0

    @property
    def place(self) -> FloatArray:
        """A pose in its middle whose z axis points from a to b, (4, 4) [m]."""
        T, way = np.eye(4), self.b - self.a
        length = float(np.linalg.norm(way))
        if length > 0.0:
            T[:3, :3] = turned_along(way / length)
        T[:3, 3] = 0.5 * (self.a + self.b)
        return T

    @property
    def volume(self) -> float:
        """[m3]."""
        half, r, _ = self.extent
        return float(np.pi * r * r * (2.0 * half + 4.0 / 3.0 * r))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Collision:
    """Geometry of a link as a file has it."""

    link: str  # The link
    # ``sphere``, ``cylinder``, ``capsule``, ``box``, ``mesh`` or ``half_space``, which lies behind its own
    # plane z = 0
    kind: str
    size: tuple[float, ...]  # Radius; radius and length; edges; or the scale of a mesh [m]
    place: FloatArray  # Its pose in the link, (4, 4) [m]
    file: str = ""  # That of a mesh, as it is written; empty of others
    # The URDF itself, from which meshes are looked for; None where it was read from text
    beside: Path | None = None
    corners: FloatArray | None = None  # Of a mesh that was read already, (V, 3) [m]; None of others


Shapes = tuple[Capsule | Collision, ...]
"""Bodies as they were given or read."""


class HullParts(NamedTuple):
    """A convex body, as ``ftqp.model.collision_geometry`` finds it."""

    corners: FloatArray  # (V, 3) [m]
    edges: IntArray  # The two corners of each, (E, 2)
    faces: FloatArray  # The outward normal n, of length 1, and the offset d of n'x <= d of each, (F, 4) [m]


def checked(capsules: Iterable[Any]) -> tuple[Capsule, ...]:
    """The capsules that a robot is given."""
    if isinstance(capsules, Capsule | str) or not isinstance(capsules, Iterable):
        raise InputError(
            f"capsules is {type(capsules).__name__}, expected a list, "
            "[ftqp.Capsule(a, b, radius, frame='link1'), ...]"
        )
    found = tuple(capsules)
    for one in found:
        if not isinstance(one, Capsule):
            raise InputError(f"capsules has {type(one).__name__}, expected ftqp.Capsule(a, b, radius, frame)")
        if one.frame is None:
            raise InputError("a capsule has no frame, expected the link or joint that it moves with, frame=")
    return named_apart(found)


def named_apart(capsules: Sequence[Capsule]) -> tuple[Capsule, ...]:
    """The same, those of one name numbered: ``link5``, ``link5 2``."""
    seen: dict[str, int] = {}
    found = []
    for one in capsules:
        seen[one.label] = seen.get(one.label, 0) + 1
        count = seen[one.label]
        found.append(one if count == 1 else replace(one, name=f"{one.label} {count}"))
    return tuple(found)


def estimated(robot: Any) -> tuple[Capsule, ...]:
    """A capsule from each joint to those that hang on it, and from the last ones to the tips."""
    chain, zero = robot.chain, np.zeros(robot.nv)
    places = [robot.pose(zero, name) for name in robot.joints]
    ends: list[list[FloatArray]] = [[] for _ in places]
    for i, T in enumerate(places):
        if chain.parent[i] >= 0:
            ends[chain.parent[i]].append(T[:3, 3])
    tips = [robot.pose(zero, tip)[:3, 3] for tip in robot.tips]
    ends[int(chain.tip_joint)].append(tips[0])
    reach = float(sum(np.linalg.norm(chain.translation, axis=1)) + np.linalg.norm(chain.tip_translation))
    radius = max(THICKNESS * reach, 1e-3)
    found = []
    for name, T, ways in zip(robot.joints, places, ends, strict=True):
        for end in ways or [T[:3, 3]]:
            b = T[:3, :3].T @ (end - T[:3, 3])
            found.append(Capsule(np.zeros(3), b, radius, frame=name, estimated=True))
    return named_apart(found)


ALIKE = 1e-3
"""Joints of two models of one arm are not farther apart than this [m, and entries of rotations]."""


def bodies_of(other: Any, robot: Any) -> tuple[Capsule, ...]:
    """The capsules of another model of the same arm, each in the frame of the joint that it moves with."""
    there, here = np.zeros(other.nv), np.zeros(robot.nv)
    found = []
    for one in other.capsules:
        T, joint = np.eye(4), WORLD
        if one.frame != WORLD:
            T, frames = other.pose(there, one.frame), other.model.frames
            joint = other.model.names[frames[other.model.getFrameId(one.frame)].parentJoint]
        if joint != WORLD:
            if joint not in robot.joints:
                raise InputError(
                    f"{one.label} of {other.name} moves with {joint!r}, which {robot.name} has not; expected "
                    f"a model of the same arm, with the joints {', '.join(robot.joints)}"
                )
            own = robot.pose(here, joint)
            off = float(np.abs(other.pose(there, joint) - own).max())
            if off > ALIKE:
                raise InputError(
                    f"{joint!r} of {other.name} is {off:.3g} m or rad off that of {robot.name} where all "
                    "joints are at 0; expected a model of the same arm"
                )
            T = np.linalg.inv(own) @ T
        R, p = T[:3, :3], T[:3, 3]
        corners = None if one.corners is None else one.corners @ R.T + p
        a, b = R @ one.a + p, R @ one.b + p
        found.append(replace(one, a=a, b=b, frame=joint, name=one.label, corners=corners))
    return named_apart(found)


def carried(shapes: Shapes, joint: str) -> Shapes:
    """The bodies of an arm that is put on a base: what stood still moves with the last joint of the base."""
    return tuple(
        replace(one, frame=joint) if isinstance(one, Capsule) and one.frame == WORLD else one
        for one in shapes
    )
