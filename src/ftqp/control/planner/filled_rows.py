"""Rows that functions of the user fill in before every tick, and those of soft tasks."""

import logging
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, final

import numpy as np

from ftqp.control.task.own_task import OwnTask
from ftqp.core.checks import FloatArray, frozen
from ftqp.core.clock import now
from ftqp.core.errors import InputError
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.enums import VELOCITY
from ftqp.model.robot import Robot

_LOG = logging.getLogger("ftqp")
LETTERS = 120
"""So much of an exception's text is quoted."""


class RowState(NamedTuple):
    """What a function of the user is shown before each tick.

    Attributes:
        q: Joint positions of the reference, (nv,) [rad or m].
        v: Its joint velocities, (nv,) [rad/s or m/s].
        a: Its joint accelerations, (nv,) [rad/s2 or m/s2].
        level: What x is, ``acceleration`` or ``velocity``.
        dt: The sampling period [s].
    """

    q: FloatArray
    v: FloatArray
    a: FloatArray
    level: str
    dt: float


def seen_of(session: Session, robot: Robot) -> RowState:
    """What functions see of a planner, the memory itself."""
    q, v, a = (session.view("state", name)[: robot.nv] for name in ("q_command", "v_command", "a_command"))
    state = session.K.state
    return RowState(q, v, a, "velocity" if state.level == VELOCITY else "acceleration", float(state.dt))


class _Own(NamedTuple):
    name: str
    fill: Callable[..., object]
    J: FloatArray
    b: FloatArray


SLOW_TIMES = 5
"""A function that takes longer than a tick so often in a row is slow."""


@final
class DeadlineMonitor:
    """Tells once of each function that takes longer than a tick, for the loop is late then.

    One that does so now and then may have been interrupted, so that several times in a row count.
    """

    __slots__ = ("_dt", "_slow")

    def __init__(self, dt: float) -> None:
        self._dt, self._slow = dt, dict[str, int]()

    def look(self, name: str, began: int) -> None:
        """Look at how long a function took."""
        took = 1e-9 * (now() - began)
        times = self._slow.get(name, 0)
        if times >= SLOW_TIMES:
            return
        self._slow[name] = times + 1 if took > self._dt else 0
        if self._slow[name] == SLOW_TIMES:
            _LOG.warning(
                "fill of %s took %.3g ms of a tick of %.3g ms, so that the loop is late; make it quicker, "
                "dt longer, or say step(..., ticks=) how many have passed; this is said once",
                name, 1e3 * took, 1e3 * self._dt,
            )  # fmt: skip


@final
class OwnRows:
    """Asks the user's functions for their rows; one that fails leaves its task out of that tick."""

    __slots__ = ("_all", "_failed", "_pace", "_seen", "_warned")

    def __init__(
        self,
        terms: Any,
        tasks: Sequence[tuple[int, str, OwnTask]],
        robot: Robot,
        seen: RowState,
        failed: dict[str, str],
    ) -> None:
        n, self._seen, self._pace = robot.nv, seen, DeadlineMonitor(seen.dt)
        self._failed = failed
        self._warned: set[str] = set()
        still, fills = resting(seen, robot.neutral), [task.filling(robot) for _, _, task in tasks]
        for (_, name, task), fill in zip(tasks, fills, strict=True):
            why = call_checked(fill, still, np.zeros((task.count, n)), np.zeros(task.count))
            if why:
                raise InputError(
                    f"fill of {name} {why} at the neutral posture at rest, expected that it writes finite "
                    f"numbers into J ({task.count}, {n}) and b ({task.count},) and returns nothing"
                )
        self._all = tuple(
            _Own(name, fill, terms.J[at, : task.count, :n], terms.b[at, : task.count])
            for (at, name, task), fill in zip(tasks, fills, strict=True)
        )

    def fill(self) -> None:
        """Fill in all rows, those of a function that fails with zeros. Ctrl-C goes through."""
        for name, fill, J, b in self._all:
            J[:] = b[:] = 0.0
            began = now()
            try:
                why = call_checked(fill, self._seen, J, b)
            except BaseException:
                J[:] = b[:] = 0.0
                raise
            self._pace.look(name, began)
            if why:
                J[:] = b[:] = 0.0
                self._failed[name] = f"fill {why}, so that {name!r} was left out of the tick"
                if name not in self._warned:
                    self._warned.add(name)
                    _LOG.warning("%s; this is said once", self._failed[name])
            else:
                self._failed.pop(name, None)


def refuse_asking(asking: Sequence[str], whom: str, remedy: str) -> None:
    """Refuse a planner whose tasks or constraints ask Python, for somebody who does not."""
    if asking:
        ask, them = ("asks", "it") if len(asking) == 1 else ("ask", "them")
        raise InputError(
            f"{', '.join(asking)} {ask} a Python function in every step, which {whom} does not; "
            f"{remedy.format(them=them)}"
        )


def call_checked(fill: Callable[..., object], state: RowState, *arrays: FloatArray) -> str:
    """Call a function that fills arrays; what is wrong with it, or nothing. Ctrl-C goes through."""
    try:
        returned = fill(state, *arrays)
    except Exception as error:  # whatever it is
        return f"raised {type(error).__name__}: {error!s:.{LETTERS}}"
    if returned is not None:
        return f"returned {type(returned).__name__}"
    if not np.isfinite(arrays[0]).all() or (len(arrays) == 2 and not np.isfinite(arrays[1]).all()):
        return "gave numbers that are not finite"
    return "gave l > u, or NaN" if len(arrays) == 3 and not (arrays[1] <= arrays[2]).all() else ""


def resting(seen: RowState, neutral: FloatArray) -> RowState:
    """What functions are tried with when a planner is made: a posture at rest."""
    still = frozen(np.zeros(len(neutral)))
    return seen._replace(q=frozen(neutral.copy()), v=still, a=still)
