"""A scene: what stands around arms, by name, and may move, come and go while they work."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from importlib import import_module
from typing import Any, NamedTuple, Self, final
from weakref import WeakMethod

import numpy as np

from ftqp.control.scene.solid_shapes import EXAMPLE, Shape, pose_of, shape_of
from ftqp.core.checks import FloatArray, array, frozen
from ftqp.core.errors import InputError, nearest
from ftqp.kernel.layout.scene_room import BALLS, SHAPES
from ftqp.model.capsules import Capsule, Collision
from ftqp.model.placed_collisions import placed_collisions

STANDS = np.zeros(6)
STANDS.flags.writeable = False
NONE = np.zeros((0, 4))
NONE.flags.writeable = False
CLOUD = "cloud"
"""What the balls of a cloud are called together."""


class Placed(NamedTuple):
    """Something that stands in a scene.

    Attributes:
        shape: What it is.
        place: Its pose when it was last said to be somewhere, (4, 4) [m].
        twist: Its velocity since, (6,) [m/s, rad/s], along W.
    """

    shape: Shape
    place: FloatArray
    twist: FloatArray


@final
class Scene(Mapping[str, Placed]):
    """What stands around arms, by name.

    Planners that were given it see every change in their next step. Use it in the thread of its planners.
    """

    @classmethod
    def from_urdf(cls, source: Any) -> Self:
        """A scene of the collision geometry of a URDF, its joints at zero, each called after its link.

        Balls, boxes, cylinders and capsules are taken as they are, a mesh as its convex hull.

        Args:
            source: The path of a file, or the XML itself; meshes are looked for beside the file.

        Raises:
            InputError: The file cannot be read, a mesh is missing or holds nothing, a size is one of
                millimetres, nothing stands there, or there is more than a scene has room for.
        """
        return cls._of(placed_collisions(source), "the URDF has no collision geometry, expected <collision>")

    @classmethod
    def from_mjcf(cls, source: Any) -> Self:
        """A scene of the geoms of a MuJoCo model that collide, its joints where they begin.

        Each is called as it is, or after its body. Planes are half-spaces; an ellipsoid stands for the box
        around it, and a mesh for its convex hull. MuJoCo reads the file, which the extra ``sim`` installs.

        Args:
            source: The path of a file, or the XML itself.

        Raises:
            InputError: The file cannot be read, MuJoCo refuses it, a size is one of millimetres, nothing
                stands there, or there is more than a scene has room for.
            MissingPackage: MuJoCo is not installed.
        """
        pieces = import_module("ftqp.model.reading.mjcf_geometry").mjcf_collisions(source)
        return cls._of(pieces, "the MJCF has no geom that collides, expected contype or conaffinity")

    @classmethod
    def _of(cls, pieces: Iterable[Collision], nothing: str) -> Self:
        found = cls()
        for one in pieces:
            name = one.link or "thing"
            counts = sum(other == name or other.startswith(f"{name} ") for other in found)
            found.add(name if counts == 0 else f"{name} {counts + 1}", shape_of(one))
        if not found:
            raise InputError(nothing)
        return found

    def __init__(self) -> None:
        self._placed: dict[str, Placed] = {}
        self._balls = NONE
        self._watchers: list[WeakMethod[Callable[[str], None]]] = []

    def add(self, name: str, shape: Shape) -> None:
        """Put something into the scene; the name is free again once it is removed.

        Args:
            name: What it is called in statuses, reports and certificates.
            shape: An ``ftqp.Box``, ``Sphere``, ``Capsule``, ``Cylinder``, ``HalfSpace`` or ``Hull``.

        Raises:
            InputError: This is no shape, the name is taken, or there is no more room.
        """
        if not (isinstance(name, str) and name):
            raise InputError(f"name is {name!r:.60}, expected a word such as 'table'")
        if not isinstance(shape, Shape):
            raise InputError(f"{name} is {type(shape).__name__}, expected a shape such as {EXAMPLE}")
        if isinstance(shape, Capsule) and shape.frame is not None:
            raise InputError(
                f"{name} has the frame {shape.frame!r}, and what is in a scene stands in the world; leave "
                "it out, or give it to the arm, robot.with_capsules([...])"
            )
        if name == CLOUD:
            raise InputError(f"{CLOUD!r} stands for the balls of scene.update(balls); give this another name")
        if name in self._placed:
            raise InputError(
                f"there is a {name!r} in the scene; remove it, move it, or give this another name"
            )
        if len(self._placed) >= SHAPES:
            raise InputError(
                f"the scene has {SHAPES} shapes, and no room for {name!r}; put several into one box"
            )
        self._placed[name] = Placed(shape, shape.place, STANDS)
        try:
            self._tell("")
        except InputError:
            del self._placed[name]
            self._tell("")
            raise

    def move(self, name: str, place: Any, twist: Any = None) -> None:
        """Say where something is now, and how fast it goes on.

        Args:
            name: Which.
            place: Its pose, (4, 4) [m], or its place, (3,) [m], which leaves it turned as it was.
            twist: Its velocity along W, (6,) [m/s, rad/s]; None stands. Planners move it on until it is
                moved again.

        Raises:
            InputError: There is nothing of that name, or a number is not finite; then nothing changes.
        """
        was = self[name]
        T = pose_of("place", place)
        if np.shape(place) == (3,):
            T = np.array(T)
            T[:3, :3] = was.place[:3, :3]
            T.flags.writeable = False
        speed = STANDS if twist is None else array("twist", twist, (6,), "(6,)")
        self._placed[name] = Placed(was.shape, T, speed)
        self._tell(name)

    def update(self, balls: Any) -> None:
        """Say where a cloud of balls is now, as a camera sees a room; those of before are gone.

        Each body of an arm keeps clear of the six that are nearest to it and apart from each other, which are
        chosen anew while it moves. Together they are called ``cloud``.

        Args:
            balls: x, y, z and radius of each, (K, 4), K up to 4096 [m]; (0, 4) is no ball.

        Raises:
            InputError: A wrong shape, a number that is not finite, a radius that is not positive, or too many
                balls; then nothing changes.
        """
        found = array("balls", balls, (len(balls) if np.ndim(balls) == 2 else 0, 4), "(K, 4)")
        if len(found) > BALLS:
            raise InputError(
                f"balls are {len(found)}, expected at most {BALLS}; take larger ones, or those within reach"
            )
        if not (found[:, 3] > 0.0).all():
            at = int(np.argmin(found[:, 3] > 0.0))
            raise InputError(f"ball {at} has the radius {found[at, 3]:g}, expected > 0 [m]")
        self._balls = frozen(np.array(found, dtype=np.float64))
        self._tell(CLOUD)

    @property
    def balls(self) -> FloatArray:
        """The balls of the cloud, x, y, z and radius, (K, 4) [m]."""
        return self._balls

    def remove(self, name: str) -> None:
        """Take something out of the scene.

        Args:
            name: Which.

        Raises:
            InputError: There is nothing of that name.
        """
        self[name]
        del self._placed[name]
        self._tell("")

    def copy(self) -> Self:
        """A scene of its own with the same things in it, that nobody watches."""
        other = type(self)()
        other._placed, other._balls = dict(self._placed), self._balls
        return other

    def watch(self, told: Callable[[str], None]) -> None:
        """Be told of changes: by the name of what has moved, ``cloud``, or nothing where others are there.

        Args:
            told: A method, which is forgotten with its object.
        """
        self._watchers.append(WeakMethod(told))

    def _tell(self, name: str) -> None:
        alive = [(one, told) for one in self._watchers if (told := one()) is not None]
        self._watchers = [one for one, _ in alive]
        for _, told in alive:
            told(name)

    def __getstate__(self) -> dict[str, Any]:
        return {"_placed": dict(self._placed), "_balls": self._balls, "_watchers": []}

    def __getitem__(self, name: str) -> Placed:
        try:
            return self._placed[name]
        except (KeyError, TypeError):
            known = ", ".join(self._placed) or "nothing"
            raise InputError(
                f"there is no {name!r:.60} in the scene{nearest(str(name), self._placed)}; there is {known}"
            ) from None

    def __contains__(self, name: object) -> bool:
        return name in self._placed

    def __iter__(self) -> Iterator[str]:
        return iter(self._placed)

    def __len__(self) -> int:
        return len(self._placed)

    def __repr__(self) -> str:
        """What stands there."""
        return f"Scene({', '.join(self._placed)})"
