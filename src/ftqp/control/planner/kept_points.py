"""A planner's list of constraints: points that are kept on their side of a plane."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple, final

from ftqp.control.task.keep import Keep
from ftqp.core.errors import InputError, nearest
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.rows import KEEPS
from ftqp.model.body_frames import mount_of
from ftqp.model.robot import Robot


def listed(constraints: Any) -> tuple[Keep, ...]:
    """The constraints that a planner was given.

    Raises:
        InputError: This is no list of them, or too many.
    """
    if constraints is None:
        return ()
    if isinstance(constraints, Keep | str | Mapping) or not isinstance(constraints, Sequence):
        what = type(constraints).__name__
        raise InputError(f"constraints is {what}, expected a list, [ftqp.Keep(...), ...]")
    for one in constraints:
        if not isinstance(one, Keep):
            raise InputError(f"constraints has {type(one).__name__}, expected ftqp.Keep")
    if len(constraints) > KEEPS:
        raise InputError(f"constraints has {len(constraints)}, expected at most {KEEPS}")
    return tuple(constraints)


class KeptPoint(NamedTuple):
    """A point that is kept.

    Attributes:
        given: As it was asked for.
        distance: From its plane, into the free side, before the last step [m].
    """

    given: Keep
    distance: float


@final
class Kept(Mapping[str, KeptPoint]):
    """The points that a planner keeps, by name.

    Args:
        session: The planner's, whose record they are written into.
        robot: The arm.
        keeps: As they were given.

    Raises:
        InputError: An unknown frame, one that does not move, or a name that occurs twice.
    """

    def __init__(self, session: Session, robot: Robot, keeps: Sequence[Keep]) -> None:
        self._room = session.K.keeps
        self._given: dict[str, Keep] = {}
        for at, keep in enumerate(keeps):
            if keep.label in self._given or (keep.label in robot.joints and keep.name is not None):
                raise InputError(f"two things are called {keep.label!r}; give the constraint another name=")
            body, T = mount_of(robot, keep.frame)
            if body < 0:
                raise InputError(f"frame {keep.frame!r} of {keep.label} does not move with any joint")
            room = self._room
            room.body[at], room.place[at] = body, T[:3, :3] @ keep.point + T[:3, 3]
            room.normal[at], room.offset[at], room.brake[at] = keep.normal, keep.offset, keep.braking
            self._given[keep.label] = keep
        self._room.count = len(keeps)

    def __getitem__(self, name: str) -> KeptPoint:
        try:
            at = list(self._given).index(name)
        except ValueError:
            known = ", ".join(self._given) or "none"
            raise InputError(
                f"there is no constraint {name!r:.60}{nearest(str(name), self._given)}; there are: {known}"
            ) from None
        return KeptPoint(self._given[name], float(self._room.distance[at]))

    def __contains__(self, name: object) -> bool:
        return name in self._given

    def __iter__(self) -> Iterator[str]:
        return iter(self._given)

    def __len__(self) -> int:
        return len(self._given)
