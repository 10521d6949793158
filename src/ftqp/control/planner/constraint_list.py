"""A planner's list of constraints: points and axes that are kept somewhere, and rows of one's own."""

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from math import nan
from typing import Any, NamedTuple, final

from ftqp.control.planner.filled_rows import Filled, FilledRows, seen_of
from ftqp.control.planner.stages import CLOCK, FREE, LED, Stage
from ftqp.control.task.keep import CONE, Keep, Side, TorqueLimits
from ftqp.control.task.own_task import OwnConstraint
from ftqp.core.errors import InputError, nearest
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.rows import KEEP, KEEPS, OWN_ROW, OWN_ROWS, Asked
from ftqp.model.frames import mount_of
from ftqp.model.robot import Robot

_LOG = logging.getLogger(__name__)
Constraint = Keep | OwnConstraint | TorqueLimits


def checked_constraints(constraints: Any) -> tuple[Constraint, ...]:
    """The constraints that a planner was given."""
    if constraints is None:
        return ()
    if isinstance(constraints, Constraint | str | Mapping) or not isinstance(constraints, Sequence):
        what = type(constraints).__name__
        raise InputError(f"constraints is {what}, expected a list, [ftqp.Keep(...), ...]")
    for one in constraints:
        if not isinstance(one, Constraint):
            raise InputError(
                f"constraints has {type(one).__name__}, expected ftqp.Keep, ftqp.Rows or ftqp.TorqueLimits"
            )
    names = [one.label for one in constraints]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"two things are called {twice!r}; give the constraint another name=")
    sides, rows = sides_of(constraints), sum(one.count for one in own_of(constraints))
    if len(sides) > KEEPS:
        raise InputError(
            f"constraints has {len(sides)} sides of planes, boxes and cones, expected at most {KEEPS}; make "
            "sides of a box that nothing comes near infinite"
        )
    if rows > OWN_ROWS:
        raise InputError(f"constraints has {rows} rows of your own, expected at most {OWN_ROWS}")
    return tuple(constraints)


def kept_of(constraints: Sequence[Constraint]) -> tuple[Keep, ...]:
    """Those that keep a point or an axis somewhere."""
    return tuple(one for one in constraints if isinstance(one, Keep))


def sides_of(constraints: Sequence[Constraint]) -> tuple[tuple[Keep, Side], ...]:
    """Their sides, each a row of the QP, in the order of the rows."""
    return tuple((keep, side) for keep in kept_of(constraints) for side in keep.sides)


def own_of(constraints: Sequence[Constraint]) -> tuple[OwnConstraint, ...]:
    """Those that are rows of the user's own."""
    return tuple(one for one in constraints if isinstance(one, OwnConstraint))


def refuse_without_effect(constraints: Sequence[Constraint], robot: Robot, torque_limits: bool) -> None:
    """Refuse torque limits that are asked for and could not be kept."""
    for one in constraints:
        if isinstance(one, TorqueLimits):
            one.refuse_without_effect(robot, torque_limits)


def needs_qp(constraints: Sequence[Constraint]) -> bool:
    """Whether some are kept by rows of a QP only; a closed form keeps torque limits, too."""
    return any(not isinstance(one, TorqueLimits) for one in constraints)


def row_names(constraints: Sequence[Constraint]) -> Asked:
    """Names of their rows, by kind."""
    own = [f"{one.label} {k}" for one in own_of(constraints) for k in range(one.count)]
    sides = tuple(f"{keep.label} {side.name}".rstrip() for keep, side in sides_of(constraints))
    return {KEEP.name: sides, OWN_ROW.name: own}


class Kept(NamedTuple):
    """A constraint of a planner.

    Attributes:
        given: As it was asked for.
        distance: Of a point from its plane or from the nearest side of its box [m], or of an axis from its
            cone [rad], before the last step, positive where it should be; NaN of torque limits and of rows of
            one's own.
        failed: Why nothing is known of rows of one's own any more, so that the arm was stopped; empty while
            they are good.
    """

    given: Constraint
    distance: float
    failed: str


@final
class Constraints(Mapping[str, Kept]):
    """The constraints of a planner by name."""

    def __init__(
        self, session: Session, robot: Robot, constraints: Sequence[Constraint], stop: Callable[[str], object]
    ) -> None:
        self._room, self._stop = session.K.keeps, stop
        self._given: dict[str, Constraint] = {one.label: one for one in constraints}
        self._failed = dict.fromkeys(self._given, "")
        self._sides: dict[str, list[int]] = {one.label: [] for one in kept_of(constraints)}
        for at, (keep, side) in enumerate(sides_of(constraints)):
            self._sides[keep.label].append(at)
            _write(self._room, at, keep, side, robot)
        room, own, at = self._room, [], 0
        for one in own_of(constraints):
            part = slice(at, at + one.count)
            arrays = room.own_C[part, : robot.nv], room.own_l[part], room.own_u[part]
            own.append(Filled(f"constraint {one.label}", one.filling(robot), arrays))
            at += one.count
        room.count, room.own = len(sides_of(constraints)), at
        self._own = FilledRows(seen_of(session, robot), robot.neutral, own, self._tell) if own else None

    @property
    def stage(self) -> Stage:
        """What they do in a planner's life."""
        return Stage() if self._own is None else Stage(ticks=(CLOCK, FREE, *LED), before=self._own.fill)

    @property
    def asking(self) -> tuple[str, ...]:
        """Those that ask a Python function in every tick."""
        return tuple(f"constraint {one.label!r}" for one in own_of([*self._given.values()]))

    def _tell(self, name: str, why: str) -> None:
        """Stop the arm where nothing is known of rows of one's own any more."""
        label = name.removeprefix("constraint ")
        if why:
            sentence = f"fill of constraint {label!r} {why}, so that the arm is stopped"
            if not self._failed[label]:
                _LOG.warning("%s", sentence)
            self._stop(sentence)
        self._failed[label] = why and f"fill {why}, so that the arm was stopped"

    def __getitem__(self, name: str) -> Kept:
        try:
            one = self._given[name]
        except (KeyError, TypeError):
            known = ", ".join(self._given) or "none"
            raise InputError(
                f"there is no constraint {name!r:.60}{nearest(str(name), self._given)}; there are: {known}"
            ) from None
        sides = self._sides.get(name)
        distance = nan if sides is None else float(self._room.distance[sides].min())
        return Kept(one, distance, self._failed[name])

    def __contains__(self, name: object) -> bool:
        return name in self._given

    def __iter__(self) -> Iterator[str]:
        return iter(self._given)

    def __len__(self) -> int:
        return len(self._given)


def _write(room: Any, at: int, keep: Keep, side: Side, robot: Robot) -> None:
    """A side of something that is kept."""
    if keep.label in robot.joints and keep.name is not None:
        raise InputError(f"two things are called {keep.label!r}; give the constraint another name=")
    room.body[at], T = mount_of(robot, keep.frame)
    if room.body[at] < 0:
        raise InputError(f"frame {keep.frame!r} of {keep.label} does not move with any joint")
    room.turns[at] = keep.shape == CONE
    room.place[at] = T[:3, :3] @ keep.axis if room.turns[at] else T[:3, :3] @ keep.point + T[:3, 3]
    room.normal[at], room.offset[at], room.brake[at] = side.normal, side.offset, keep.braking
