"""The bodies of a robot, as capsules: given, read from its file, or estimated from its joints."""

from collections.abc import Iterable
from dataclasses import replace
from importlib import import_module
from typing import Any, Self
from weakref import WeakKeyDictionary

from ftqp.model.capsules import Capsule, Collision, checked, estimated
from ftqp.model.reading.srdf import allowed_pairs
from ftqp.model.reduction import frame_names

Shapes = tuple[Capsule | Collision, ...]
"""Bodies as they were given or read."""
WORLD = "universe"
"""The frame of bodies that do not move, as pinocchio calls it."""
_MADE: WeakKeyDictionary[Any, tuple[Capsule, ...]] = WeakKeyDictionary()
"""What was made of the bodies of robots: a fit to meshes takes seconds."""


class Embodied:
    """A robot that has bodies."""

    __slots__ = ()

    @property
    def capsules(self) -> tuple[Capsule, ...]:
        """The bodies as capsules, base to tips, each in the frame of a link or joint.

        They are those of ``with_capsules``, or contain the collision geometry of the URDF; where there is
        none they go from joint to joint, with a radius of a twentieth of the reach, and say so. Meshes are
        read when this is first asked for, which takes seconds.

        Raises:
            InputError: A mesh is missing, or holds nothing.
        """
        if self not in _MADE:
            _MADE[self] = _made(self)
        return _MADE[self]

    def with_capsules(self, capsules: Iterable[Capsule]) -> Self:
        """This robot with other bodies, for distances.

        Args:
            capsules: Rods with round ends, each with the ``frame`` that it moves with.

        Raises:
            InputError: This is no list of capsules with frames of this robot.
        """
        given = checked(capsules)
        for one in given:
            if one.frame != WORLD:
                self.pose(self.neutral, one.frame)  # type: ignore[attr-defined]  # names the frames there are
        return replace(self, shapes=given)  # type: ignore[type-var]

    def allowed_pairs(self, srdf: Any) -> tuple[tuple[str, str], ...]:
        """The pairs of bodies that an SRDF, MoveIt's file beside a URDF, lets touch.

        Capsules belong to the link that is their frame, or that they are called after. The pairs are for
        ``ftqp.Clearance(ignore=...)``; those of links without capsules are left out.

        Args:
            srdf: The path of the file, or the XML itself.

        Raises:
            InputError: The file cannot be read, or a mesh of the robot is missing.
        """
        of: dict[str, list[str]] = {}
        for one in self.capsules:
            for name in {one.frame or "", one.label.partition(" ")[0]}:
                of.setdefault(name, []).append(one.label)
        return tuple(
            (one, other)
            for first, second in allowed_pairs(srdf)
            for one in of.get(first, ())
            for other in of.get(second, ())
        )


def carried(shapes: Shapes, joint: str) -> Shapes:
    """The bodies of an arm that is put on a base: what stood still moves with the last joint of the base."""
    return tuple(
        replace(one, frame=joint) if isinstance(one, Capsule) and one.frame == "universe" else one
        for one in shapes
    )


def volume_ratios(robot: Any) -> dict[str, float]:
    """How many times larger the capsules of a link are than the collision geometry that they contain."""
    shapes = [one for one in robot.shapes if isinstance(one, Collision)]
    if not shapes:
        return {}
    volume_of = import_module("ftqp.model.capsule_fit").volume_of
    inside, around = dict[str, float](), dict[str, float]()
    for shape in shapes:
        inside[shape.link] = inside.get(shape.link, 0.0) + volume_of(shape)
    for one in robot.capsules:
        around[one.frame] = around.get(one.frame, 0.0) + one.volume
    return {link: around[link] / size for link, size in inside.items() if size > 0.0 and link in around}


def _made(robot: Any) -> tuple[Capsule, ...]:
    there = (*frame_names(robot.model), WORLD)
    own = [one for one in robot.shapes if (one.frame if isinstance(one, Capsule) else one.link) in there]
    if not own:
        return estimated(robot)
    fitted = import_module("ftqp.model.capsule_fit").fitted  # it loads scipy, which few robots need
    made: tuple[Capsule, ...] = fitted(own)
    return made
