"""Target: where the tip should be, packed as the kernel reads it."""

from collections.abc import Callable
from math import nan
from typing import Any, Final

import numpy as np

from ftqp.core.checks import FloatArray, array, as_number, frozen, numbers, seen, sized
from ftqp.core.errors import InputError
from ftqp.core.pose import pose as checked_pose
from ftqp.kernel.entry.session import writer_of
from ftqp.kernel.layout.enums import (
    TARGET_ACCELERATION,
    TARGET_HAS_ROTATION,
    TARGET_POSE,
    TARGET_SIZE,
    TARGET_TWIST,
)

_STILL: Final = np.zeros(6)


class Target:
    """Pose (or position), twist and acceleration that the end effector should have now; or a twist alone.

    In a loop that makes its targets as it goes, ``planner.step(q, v, target.at(T, twist))`` rewrites one
    target instead of making a new one every tick. The arrays are views of one buffer, so that single numbers
    can be written, too (``target.pose[2, 3] += 0.001``). A target that is not finite, whose rotation part is
    none or whose last row is not 0 0 0 1 by the time of the step, is the world's doing: the step's status is
    INVALID_INPUT.

    A twist alone, as a joystick gives it, says where the end effector should go and not where it should be:
    an ``ftqp.TargetFollower`` takes it. It needs the stamp of the message that it came from, as only a new
    stamp distinguishes a fresh twist from one that nobody has renewed. It need not be finite: what is not
    counts as not renewed.

    Args:
        pose: (4, 4) homogeneous transform, or anything with ``.homogeneous``; of the end effector in the base
            frame W.
        position: (3,) [m], instead of a pose, for tasks without rotation rows.
        twist: (6,) linear [m/s] then angular [rad/s] along W; (3,) with a position; None is zero.
        acceleration: as the twist, [m/s2], [rad/s2].
        stamp: time or number of the message of a twist alone, any number that grows with every message.

    Attributes:
        pose: Where the end effector should be, (4, 4).
        position: The same without the rotation, (3,) [m]; a view into ``pose``.
        twist: (6,) [m/s], [rad/s].
        acceleration: (6,) [m/s2], [rad/s2].
        packed: The one buffer with all of them, (29,).
        stamp: That of a twist alone, else NaN; to be written together with the twist.
        row: The row of ``packed`` that a step takes, always 0.

    Raises:
        InputError: neither or both of pose and position, no numbers, a wrong shape, a finite pose whose
            rotation part is none or whose last row is not 0 0 0 1, or a stamp without a twist alone or the
            other way round.
    """

    __slots__ = ("_write", "acceleration", "packed", "pose", "position", "stamp", "twist")
    row = 0
    pose: FloatArray
    position: FloatArray
    twist: FloatArray
    acceleration: FloatArray
    packed: FloatArray
    stamp: float
    _write: Callable[..., int] | None

    def __init__(
        self,
        pose: Any = None,
        position: Any = None,
        twist: Any = None,
        acceleration: Any = None,
        *,
        stamp: float | None = None,
    ) -> None:
        alone = pose is None and position is None and twist is not None
        if alone != (stamp is not None):
            raise InputError(
                "a twist alone needs a stamp, the time or number of the message that it came from, so that a "
                "twist that nobody renews is not followed for ever; a target with a pose or position has none"
            )
        if stamp is not None:
            self._own(_buffer())
            self.packed[TARGET_HAS_ROTATION] = -1.0
            self.pose[:] = np.eye(4)
            self.twist[:] = sized("twist", twist, (6,))
            self.stamp = stamp
            return
        if (pose is None) == (position is None):
            raise InputError(
                "a target needs exactly one of pose and position; a pose gives both position and rotation"
            )
        self._own(_buffer())
        if position is None:
            matrix = sized("pose", getattr(pose, "homogeneous", pose), (4, 4))
            self.pose[:] = checked_pose(matrix) if np.isfinite(matrix).all() else matrix
            self.packed[TARGET_HAS_ROTATION] = 1.0
        else:
            self.pose[:] = np.eye(4)
            self.position[:] = sized("position", position, (3,))
        for name, value, view in (
            ("twist", twist, self.twist),
            ("acceleration", acceleration, self.acceleration),
        ):
            if value is not None:
                view[:] = _six(name, value, position is None)

    def _own(self, packed: FloatArray) -> None:
        """Take ``packed``, (29,), as the one buffer."""
        pose = packed[TARGET_POSE:TARGET_TWIST].reshape(4, 4)
        views = {
            "packed": packed,
            "pose": pose,
            "position": pose[:3, 3],
            "twist": packed[TARGET_TWIST:TARGET_ACCELERATION],
            "acceleration": packed[TARGET_ACCELERATION:TARGET_HAS_ROTATION],
        }
        for name, view in views.items():
            object.__setattr__(self, name, view)
        object.__setattr__(self, "stamp", nan)
        object.__setattr__(self, "_write", None)

    def at(self, pose: Any, twist: Any = None, acceleration: Any = None) -> "Target":
        """This target, moved: what ``planner.step`` takes in a loop that makes its targets as it goes.

        Arrays of float64 are copied in one compiled call; anything else that Target takes is converted. NaN,
        infinities and what is no pose are taken, too: they are the world's doing, and the step's status says
        so.

        Args:
            pose: Where the end effector should be, as for Target: (4, 4); of a target with a position only,
                (3,) [m].
            twist: (6,) linear [m/s] then angular [rad/s] along W; None is zero.
            acceleration: (6,), [m/s2], [rad/s2]; None is zero.

        Returns:
            The target itself.

        Raises:
            InputError: A wrong shape or no numbers, or a target with a twist alone; nothing is written then.
        """
        write = self._write
        if write is None:
            write = self._made_ready()
        if (
            write(pose, _STILL if twist is None else twist, _STILL if acceleration is None else acceleration)
            < 0
        ):
            self._write_converted(pose, twist, acceleration)
        return self

    def _made_ready(self) -> Callable[..., int]:
        """What writes the arrays of a pose; where there is none, what leaves it to ``_write_converted``."""
        if self.packed[TARGET_HAS_ROTATION] > 0.0 and self.packed.flags.writeable:
            write: Callable[..., int] = writer_of(self.packed)
        else:
            write = _not_written
        object.__setattr__(self, "_write", write)
        return write

    def _write_converted(self, pose: Any, twist: Any, acceleration: Any) -> None:
        """As ``at``, of anything that is taken for such arrays."""
        if not self.packed.flags.writeable:
            raise InputError("this target is somebody else's, to be looked at; make a Target(pose=...)")
        if self.packed[TARGET_HAS_ROTATION] < 0.0:
            raise InputError(
                "a target with a twist alone is at no pose; write target.twist and target.stamp, or make a "
                "Target(pose=...)"
            )
        has_pose = self.packed[TARGET_HAS_ROTATION] > 0.0
        name, place = ("pose", self.pose) if has_pose else ("position", self.position)
        given = sized(name, getattr(pose, "homogeneous", pose), place.shape)
        moving = [
            np.zeros(6) if value is None else _six(name, value, has_pose)
            for name, value in (("twist", twist), ("acceleration", acceleration))
        ]
        place[...] = given
        self.twist[:], self.acceleration[:] = moving

    def __setattr__(self, name: str, value: Any) -> None:
        """Write into the buffer: ``target.pose = T`` is ``target.pose[:] = T`` with the shape checked."""
        if name == "stamp" and self.packed[TARGET_HAS_ROTATION] < 0.0:
            object.__setattr__(self, name, as_number(name, value))
            return
        if name not in ("pose", "position", "twist", "acceleration"):
            raise AttributeError(
                f"a target has pose, position, twist and acceleration to be written, not {name!r}"
            )
        view = getattr(self, name)
        if not view.flags.writeable:
            raise InputError("this target is somebody else's, to be looked at; make a Target(pose=...)")
        view[...] = sized(name, getattr(value, "homogeneous", value), view.shape)

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (self.packed.copy(), self.stamp)

    def __copy__(self) -> "Target":
        return _restored(self.packed, self.stamp)

    def __repr__(self) -> str:
        if self.packed[TARGET_HAS_ROTATION] < 0.0:
            return f"Target(twist={np.array2string(self.twist, precision=4)}, stamp={self.stamp:g})"
        what = "pose" if self.packed[TARGET_HAS_ROTATION] else "position"
        return f"Target({what} at {np.array2string(self.position, precision=4)})"


def _buffer() -> FloatArray:
    """Memory of a target, (29,), which nobody can make shorter while compiled code writes into it."""
    return np.frombuffer(bytearray(8 * TARGET_SIZE))


def _not_written(*_: Any) -> int:
    """What no compiled code writes."""
    return -1


def _six(name: str, value: Any, has_rotation: bool) -> FloatArray:
    """Six numbers; of a target without rotation, three are enough."""
    if has_rotation or np.shape(value) != (3,):
        return sized(name, value, (6,))
    return np.concatenate([sized(name, value, (3,)), np.zeros(3)])


def target_on(packed: FloatArray) -> Target:
    """A target whose one buffer is ``packed``, (29,), which somebody else writes."""
    target = Target.__new__(Target)
    target._own(packed)
    return target


def _restored(packed: FloatArray, stamp: float = nan) -> Target:
    """A target that holds the same as one before it."""
    target = target_on(_buffer())
    target.packed[:] = packed
    object.__setattr__(target, "stamp", stamp)
    return target


class Targets:
    """A whole trajectory of targets, packed once; ``targets.at(k)`` is what ``planner.step`` takes at tick k.

    Args:
        pose: (K, 4, 4) homogeneous transforms of the end effector in the base frame W.
        twist: (K, 6) linear [m/s] then angular [rad/s] along W; None is zero.
        acceleration: (K, 6), [m/s2], [rad/s2]; None is zero.

    Raises:
        InputError: a wrong shape, not finite, a rotation part that is not a rotation, or a last row that is
            not 0 0 0 1.
    """

    __slots__ = ("_count", "packed", "row")

    def __init__(self, pose: Any, twist: Any = None, acceleration: Any = None) -> None:
        poses = numbers("pose", pose)
        count = len(poses) if poses.ndim == 3 else 0
        if count == 0:
            raise InputError(f"pose has shape {poses.shape}, expected (K, 4, 4), at least one pose")
        packed = np.zeros((count, TARGET_SIZE))
        poses = array("pose", poses, (count, 4, 4), "(K, 4, 4)")
        off = np.abs(np.swapaxes(poses[:, :3, :3], 1, 2) @ poses[:, :3, :3] - np.eye(3)).max((1, 2))
        worst = int(np.argmax(np.maximum(off, np.abs(poses[:, 3] - (0.0, 0.0, 0.0, 1.0)).max(1))))
        checked_pose(poses[worst], f"pose[{worst}]")
        packed[:, TARGET_POSE:TARGET_TWIST] = poses.reshape(count, 16)
        packed[:, TARGET_HAS_ROTATION] = 1.0
        for name, value, begin in (
            ("twist", twist, TARGET_TWIST),
            ("acceleration", acceleration, TARGET_ACCELERATION),
        ):
            if value is not None:
                packed[:, begin : begin + 6] = array(name, value, (count, 6), "(K, 6)")
        self.packed: FloatArray = seen(frozen(packed))
        self._count = count
        self.row = 0

    def __len__(self) -> int:
        return self._count

    def __repr__(self) -> str:
        return f"Targets({self._count} poses, now number {self.row})"

    def at(self, k: int) -> "Targets":
        """The target of tick k: this object, turned to that row, until ``at`` is called again.

        Args:
            k: The tick, 0 to the number of targets minus 1.

        Raises:
            InputError: no such tick.
        """
        if 0 <= k < self._count:
            self.row = k
            return self
        raise InputError(f"there is no target {k}; the trajectory has targets 0 to {self._count - 1}")
