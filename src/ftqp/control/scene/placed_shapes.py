"""A scene: what stands around arms and may move, come and go while they work; and how far they keep."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, NamedTuple, Self, final
from weakref import WeakMethod

import numpy as np

from ftqp.control.scene.solid_shapes import EXAMPLE, Shape, pose_of, shape_of
from ftqp.core.checks import FloatArray, array, frozen
from ftqp.core.errors import InputError, nearest
from ftqp.core.setting import refuse_out_of_range, setting
from ftqp.kernel.entry.session import write_together
from ftqp.kernel.layout.scene_room import BALLS, SHAPES
from ftqp.model.capsules import Capsule, Collision

LARGEST = 3.0
"""Who keeps farther away than this [m] has written millimetres. A convention."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Clearance:
    """How far an arm keeps from itself and from what stands around it.

    Args:
        keep: Bodies are kept so far apart, > 0 [m]; on a motion of ``ftqp.GoTo`` that is proven free half of
            it, or ``stop`` if that is more. Larger is safer and leaves less of the task.
        stop: An arm that is nearer than this to something and still comes nearer is stopped, >= 0 [m].
        gain: How fast a body may come near: no faster than so many times what is left of its way to ``keep``,
            > 0 [1/s]. A larger one comes nearer faster, and brakes later and harder.
        share: Share of what the joints can brake that is counted on, > 0 and <= 1. A larger one lets the arm
            come near faster, and leaves less for what else it has to do meanwhile.
        self_pairs: Whether bodies of the arm are kept apart from each other.
        ignore: Pairs of names that need not be kept apart, of capsules and of what stands in the scene.

    Raises:
        InputError: A number is out of its range, or ``ignore`` is no list of pairs.
    """

    keep: float = setting(0.02, unit="m", above=0.0)
    stop: float = setting(0.005, unit="m", least=0.0)
    gain: float = setting(20.0, unit="1/s", above=0.0)
    share: float = setting(0.5, above=0.0, most=1.0)
    self_pairs: bool = setting(True)
    ignore: Any = setting((), of=tuple[tuple[str, str], ...])

    def __post_init__(self) -> None:
        refuse_out_of_range(self)
        if self.keep > LARGEST:
            raise InputError(
                f"keep is {self.keep:g} m, expected at most {LARGEST:g} m; are these millimetres?"
            )
        if self.share > 1.0:
            raise InputError(f"share is {self.share:g}, expected at most 1, all that they can")
        if self.stop >= self.keep:
            raise InputError(
                f"stop is {self.stop:g} m and keep {self.keep:g} m, expected stop < keep; the arm would stop "
                "where it is to keep"
            )
        pairs = self.ignore
        sound = isinstance(pairs, Sequence) and not isinstance(pairs, str)
        if not sound or any(
            isinstance(pair, str) or len(pair) != 2 or not all(isinstance(name, str) for name in pair)
            for pair in pairs
        ):
            raise InputError(
                f"ignore is {pairs!r:.80}, expected pairs of names, [('panda_link1', 'table'), ...]"
            )
        object.__setattr__(self, "ignore", tuple((str(one), str(other)) for one, other in pairs))


STANDS = np.zeros(6)
STANDS.flags.writeable = False
NONE = np.zeros((0, 4))
NONE.flags.writeable = False
CLOUD = "cloud"
"""What the balls of a cloud are called together."""


class Placed(NamedTuple):
    """Something that stands in a scene."""

    shape: Shape  # What it is
    place: FloatArray  # Its pose when it was last said to be somewhere, (4, 4) [m]
    twist: FloatArray  # Its velocity since, (6,) [m/s, rad/s], along W


class Content(NamedTuple):
    """What stands in a scene at one time."""

    placed: dict[str, Placed]  # What has a name
    balls: FloatArray  # x, y, z and radius of each ball of a cloud, (K, 4) [m]; nobody writes into them

    @property
    def things(self) -> int:
        """How many things stand there, the cloud counted as one."""
        return len(self.placed) + bool(len(self.balls))


Watcher = Callable[[Content, str, Any], list[tuple[Any, Any]]]
"""From what will stand in a scene, what has moved (nothing where others are there then) and the number that
the scene will have, to the arrays that are written then and what into each."""


@final
class Scene(Mapping[str, Placed]):
    """What stands around arms, by name.

    Planners that were given it see every change in their next step. Use it in the thread of its planners. A
    change is one whatever comes: where a planner refuses it, or an exception ends it, the scene and all its
    planners are as before or as after.

    Attributes:
        version: How often it was changed, (1,); planners compare it at every step. It is only read.
    """

    @classmethod
    def from_urdf(cls, source: Any) -> Self:
        """A scene of the collision geometry of a URDF, its joints at zero, each called after its link.

        Balls, boxes, cylinders and capsules are taken as they are, a mesh as its convex hull.

        Args:
            source: The path of a file, or the XML itself; meshes are looked for next to the file.

        Raises:
            InputError: The file cannot be read, a mesh is missing or holds nothing, a size is one of
                millimetres, nothing stands there, or there is more than a scene has room for.
        """
        from ftqp.model.collision_geometry import placed_collisions  # it loads scipy

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
        pieces = import_module("ftqp.model.reading.compiled_mjcf").mjcf_collisions(source)
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
        self._begin(Content({}, NONE))

    def _begin(self, content: Content) -> None:
        self.version = np.zeros(1, dtype=np.int64)
        self._contents = {0: content}
        self._watchers: list[WeakMethod[Watcher]] = []

    @property
    def content(self) -> Content:
        """What stands there now."""
        return self._contents[int(self.version[0])]

    def add(self, name: str, shape: Shape) -> None:
        """Put something into the scene; the name is free again once it is removed.

        Args:
            name: What it is called in statuses, reports and certificates.
            shape: An ``ftqp.Box``, ``Sphere``, ``Capsule``, ``Cylinder``, ``HalfSpace`` or ``Hull``.

        Raises:
            InputError: This is no shape, the name is taken, or there is no more room.
        """
        if not (isinstance(name, str) and name):
            raise InputError(f"name is {name!r:.60}, expected a word: add('table', {EXAMPLE})")
        if not isinstance(shape, Shape):
            raise InputError(f"{name} is {type(shape).__name__}, expected a shape such as {EXAMPLE}")
        if isinstance(shape, Capsule) and shape.frame is not None:
            raise InputError(
                f"{name} has the frame {shape.frame!r}, and what is in a scene stands in the world; leave "
                "it out, or give it to the arm, robot.with_capsules([...])"
            )
        if name == CLOUD:
            raise InputError(f"{CLOUD!r} stands for the balls of scene.update(balls); give this another name")
        placed = self.content.placed
        if name in placed:
            raise InputError(
                f"{name!r} is in the scene already; remove it, move it, or give this another name"
            )
        if len(placed) >= SHAPES:
            raise InputError(
                f"the scene has {SHAPES} shapes, and no room for {name!r}; put several into one box, or "
                "small ones as balls into a cloud, scene.update(balls)"
            )
        self._change(placed | {name: Placed(shape, shape.place, STANDS)}, self.balls)

    def move(self, name: str, place: Any, twist: Any = None) -> None:
        """Say where something is now, and how fast it goes on.

        Args:
            name: Which.
            place: Its pose, (4, 4) [m], or its place, (3,) [m], which leaves it turned as it was.
            twist: Its velocity along W, (6,) [m/s, rad/s]; None stands. Planners move it on until the next.

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
        self._change(self.content.placed | {name: Placed(was.shape, T, speed)}, self.balls, name)

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
        self._change(self.content.placed, frozen(np.array(found, dtype=np.float64, order="C")), CLOUD)

    @property
    def balls(self) -> FloatArray:
        """The balls of the cloud, x, y, z and radius, (K, 4) [m]."""
        return self.content.balls

    def remove(self, name: str) -> None:
        """Take something out of the scene.

        Args:
            name: Which.

        Raises:
            InputError: There is nothing of that name, or a planner's ``Clearance(ignore=...)`` names it; then
                nothing changes.
        """
        self[name]
        left = {other: placed for other, placed in self.content.placed.items() if other != name}
        self._change(left, self.balls)

    def copy(self) -> Self:
        """A scene of its own with the same things in it, that nobody watches."""
        other = type(self)()
        other._begin(self.content)
        return other

    def watch(self, watcher: Watcher) -> None:
        """Let someone say what else is written with every change.

        Args:
            watcher: A method, which is forgotten with its object.
        """
        self._watchers.append(WeakMethod(watcher))

    def _change(self, placed: dict[str, Placed], balls: FloatArray, name: str = "") -> None:
        """Work out a change for all who watch, then write it by one call."""
        self._watchers = [one for one in self._watchers if one() is not None]
        content, version = Content(placed, balls), self.version + 1
        self._contents = {int(self.version[0]): self.content, int(version[0]): content}
        watching = [watcher for one in self._watchers if (watcher := one()) is not None]
        changes = [change for watcher in watching for change in watcher(content, name, version)]
        write_together([*changes, (self.version, version)])

    def __getstate__(self) -> Content:
        return self.content

    def __setstate__(self, content: Content) -> None:
        self._begin(content)

    def __getitem__(self, name: str) -> Placed:
        try:
            return self.content.placed[name]
        except (KeyError, TypeError):
            known = f"it has {', '.join(self)}" if self.content.placed else "it is empty"
            raise InputError(
                f"there is no {name!r:.60} in the scene{nearest(str(name), self)}; {known}"
            ) from None

    def __contains__(self, name: object) -> bool:
        return name in self.content.placed

    def __iter__(self) -> Iterator[str]:
        return iter(self.content.placed)

    def __len__(self) -> int:
        return len(self.content.placed)

    def __repr__(self) -> str:
        """What stands there."""
        return f"Scene({', '.join(self)})"
