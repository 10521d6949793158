"""What stands around an arm: spheres, capsules, boxes, cylinders, hulls and half-spaces."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, array, frozen, positive
from ftqp.core.errors import InputError
from ftqp.core.pose import pose, rotation_exp, rotation_x, rotation_z, transform
from ftqp.core.setting import REQUIRED, setting
from ftqp.kernel.layout.scene_room import (
    BOX,
    CYLINDER,
    HALF_SPACE,
    HULL,
    HULL_CORNERS,
    HULL_EDGES,
    HULL_FACES,
    SEGMENT,
)
from ftqp.model.capsules import Capsule, Collision, HullParts, Three, length_of, turned_along

HULL_ROOM = (HULL_CORNERS, HULL_EDGES, HULL_FACES)
"""How many corners, edges and faces all hulls of a scene have at most ..."""
BOX_CORNERS = 8
"""... for which no hull need be simpler than a box."""


def pose_of(name: str, value: Any) -> FloatArray:
    """A pose, (4, 4) [m], from one or from a place, (3,) [m]."""
    if np.shape(value) == (3,):
        T = np.eye(4)
        T[:3, 3] = array(name, value, (3,), "(3,)")
        return frozen(T)
    return frozen(pose(value, name))


def turned(name: str, place: Any, rpy: Any) -> FloatArray:
    """A pose, (4, 4) [m], from one, or from a place and the angles by which a body is turned there."""
    T = pose_of(name, place)
    if rpy is None:
        return T
    if np.shape(place) != (3,):
        raise InputError(f"rpy is given together with a whole pose, expected it with {name} (3,)")
    roll, pitch, yaw = array("rpy", rpy, (3,), "(3,)")
    turn = rotation_z(yaw) @ rotation_exp(np.array([0.0, pitch, 0.0])) @ rotation_x(roll)
    return frozen(transform(turn, T[:3, 3]))


@dataclass(frozen=True, slots=True)
class Sphere:
    """A ball.

    Args:
        radius: Its radius, > 0 [m].
        place: Where its centre is, (3,) [m], or a pose, (4, 4).
        name: What a scenario calls it; ``scene.add`` has its own name.
    """

    radius: float = setting(REQUIRED, unit="m", above=0.0)
    place: Any = setting((0.0, 0.0, 0.0), of=Three, unit="m")
    name: str | None = setting(None, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", length_of("radius", self.radius))
        object.__setattr__(self, "place", pose_of("place", self.place))

    @property
    def extent(self) -> tuple[float, float, float]:
        """Half the length and the radius, as the kernel takes them [m]."""
        return 0.0, self.radius, 0.0


@dataclass(frozen=True, slots=True)
class Box:
    """A box.

    Args:
        size: The lengths of its edges along its own x, y and z, each > 0, (3,) [m].
        place: Where its middle is, (3,) [m], or its pose, (4, 4).
        rpy: Roll, pitch and yaw in place of that, as in a URDF, (3,) [rad]. None: not turned.
        name: What a scenario calls it; ``scene.add`` has its own name.
    """

    size: Any = setting(REQUIRED, of=Three, unit="m")
    place: Any = setting((0.0, 0.0, 0.0), of=Three, unit="m")
    rpy: Any = setting(None, of=Three, unit="rad")
    name: str | None = setting(None, kw_only=True)

    def __post_init__(self) -> None:
        edges = array("size", self.size, (3,), "(3,)")
        for edge in edges:
            length_of("size", float(edge))
        object.__setattr__(self, "size", tuple(float(edge) for edge in edges))
        object.__setattr__(self, "place", turned("place", self.place, self.rpy))

    @property
    def extent(self) -> tuple[float, float, float]:
        """Half its edges, as the kernel takes them [m]."""
        x, y, z = self.size
        return 0.5 * x, 0.5 * y, 0.5 * z


@dataclass(frozen=True, slots=True)
class Cylinder:
    """A cylinder along its own z axis.

    Args:
        radius: Its radius, > 0 [m].
        length: Its length, > 0 [m].
        place: Where its middle is, (3,) [m], or its pose, (4, 4).
        rpy: Roll, pitch and yaw in place of that, as in a URDF, (3,) [rad]. None: not turned.
        name: What a scenario calls it; ``scene.add`` has its own name.
    """

    radius: float = setting(REQUIRED, unit="m", above=0.0)
    length: float = setting(REQUIRED, unit="m", above=0.0)
    place: Any = setting((0.0, 0.0, 0.0), of=Three, unit="m")
    rpy: Any = setting(None, of=Three, unit="rad")
    name: str | None = setting(None, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", length_of("radius", self.radius))
        object.__setattr__(self, "length", length_of("length", self.length))
        object.__setattr__(self, "place", turned("place", self.place, self.rpy))

    @property
    def extent(self) -> tuple[float, float, float]:
        """Half the length and the radius, as the kernel takes them [m]."""
        return 0.5 * self.length, self.radius, 0.0


@dataclass(frozen=True, slots=True)
class HalfSpace:
    """All that lies behind a plane: a floor, a wall.

    Args:
        point: A place on the plane, (3,) [m].
        normal: Across the plane, into the free side, (3,); its length does not matter.
        name: What a scenario calls it; ``scene.add`` has its own name.
    """

    point: Any = setting((0.0, 0.0, 0.0), of=Three, unit="m")
    normal: Any = setting((0.0, 0.0, 1.0), of=Three)
    name: str | None = setting(None, kw_only=True)

    def __post_init__(self) -> None:
        point, normal = array("point", self.point, (3,), "(3,)"), array("normal", self.normal, (3,), "(3,)")
        size = np.linalg.norm(normal)
        if not size > 0.0:
            raise InputError("normal is (0, 0, 0), expected a direction, for example (0, 0, 1)")
        object.__setattr__(self, "point", frozen(point))
        object.__setattr__(self, "normal", frozen(normal / size))

    @property
    def extent(self) -> tuple[float, float, float]:
        """It has none."""
        return 0.0, 0.0, 0.0

    @property
    def place(self) -> FloatArray:
        """A pose whose z axis is the normal, (4, 4) [m]."""
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = turned_along(self.normal), self.point
        return T


@dataclass(frozen=True)
class Hull:
    """The convex hull of some points: a wedge, a bracket, a workpiece.

    A hull with more than 64 corners is replaced by one around it that has fewer. What has a hole or a hollow
    is better made of several.

    Args:
        corners: Points in its own frame, (N, 3) [m], N at least 4; None where ``mesh`` is given.
        mesh: In place of that, a file with a mesh, in STL, OBJ, PLY, GLB or DAE by its name,
            in a scenario from that one's folder.
        scale: By what the numbers of the mesh are multiplied: 0.001 for millimetres.
        place: Where its own origin is, (3,) [m], or its pose, (4, 4).
        rpy: Roll, pitch and yaw in place of that, as in a URDF, (3,) [rad]. None: not turned.
        name: What a scenario calls it; ``scene.add`` has its own name.
    """

    corners: Any = setting(None, of=tuple[Three, ...], unit="m", count=(4, None))
    mesh: str | None = setting(None, file=True)
    scale: float = setting(1.0, above=0.0)
    place: Any = setting((0.0, 0.0, 0.0), of=Three, unit="m")
    rpy: Any = setting(None, of=Three, unit="rad")
    name: str | None = setting(None, kw_only=True)

    def __post_init__(self) -> None:
        if (self.corners is None) == (self.mesh is None):
            raise InputError(
                "a hull is of corners or of a mesh, expected one of them: ftqp.Hull(mesh='part.stl')"
            )
        points = self.corners
        if self.mesh is None and self.scale != 1.0:
            raise InputError(
                f"scale is {self.scale!r:.20} together with corners, expected it with a mesh; scale them "
                "yourself"
            )
        if self.mesh is not None:
            fits = import_module("ftqp.model.collision_geometry")  # loads scipy, as the next one does
            points = fits.mesh_corners(self.mesh, positive("scale", self.scale))
        points = array("corners", points, (len(points) if np.ndim(points) == 2 else 4, 3), "(N, 3)")
        parts: HullParts = import_module("ftqp.model.collision_geometry").hull_of(points)
        length_of("the length of the hull", float(np.ptp(parts.corners, axis=0).max()))
        object.__setattr__(self, "corners", frozen(parts.corners))
        object.__setattr__(self, "_parts", parts)
        object.__setattr__(self, "place", turned("place", self.place, self.rpy))

    @property
    def parts(self) -> HullParts:
        """Its corners, edges and faces."""
        found: HullParts = self.__dict__["_parts"]
        return found

    @property
    def extent(self) -> tuple[float, float, float]:
        """How far it reaches along its own axes from its origin [m]."""
        x, y, z = np.abs(self.parts.corners).max(axis=0).tolist()
        return x, y, z


Shape = Sphere | Capsule | Box | Cylinder | HalfSpace | Hull


def simpler(corners: FloatArray, most: int) -> FloatArray:
    """The corners of a hull around some points that has so many at most, (k, 3) [m]."""
    found: HullParts = import_module("ftqp.model.collision_geometry").hull_of(corners, most)
    return found.corners


def fitting(hulls: Sequence[HullParts]) -> list[HullParts]:
    """The hulls of a scene, or as simple ones around them as there is room for."""
    found, most = list(hulls), max(len(one.corners) for one in hulls)
    simpler = import_module("ftqp.model.collision_geometry").hull_of
    while most > BOX_CORNERS and not all(
        sum(len(one[k]) for one in found) <= room for k, room in enumerate(HULL_ROOM)
    ):
        most = max(2 * most // 3, BOX_CORNERS)
        found = [simpler(one.corners, most) for one in hulls]
    return found


def shape_of(one: Collision) -> Shape:
    """The shape of a piece of collision geometry, which stands where its link does."""
    match one.kind:
        case "sphere":
            return Sphere(one.size[0], one.place)
        case "box":
            return Box(one.size, one.place)
        case "cylinder":
            return Cylinder(one.size[0], one.size[1], one.place)
        case "capsule":
            half = 0.5 * one.size[1] * one.place[:3, 2]
            return Capsule(one.place[:3, 3] - half, one.place[:3, 3] + half, one.size[0])
        case "half_space":
            return HalfSpace(one.place[:3, 3], one.place[:3, 2])
        case _:
            from ftqp.model.collision_geometry import vertices  # it loads scipy

            return Hull(vertices(one), place=one.place)


KINDS = {
    Sphere: SEGMENT, Capsule: SEGMENT, Box: BOX, Cylinder: CYLINDER, HalfSpace: HALF_SPACE, Hull: HULL,
}  # fmt: skip
"""What the kernel takes each for."""
WORDS = {
    "sphere": Sphere, "capsule": Capsule, "box": Box, "cylinder": Cylinder, "half_space": HalfSpace,
    "hull": Hull,
}  # fmt: skip
"""What a file calls them."""
EXAMPLE = "ftqp.Box(size=(0.4, 0.6, 0.05), place=(0.5, 0, 0.2))"
