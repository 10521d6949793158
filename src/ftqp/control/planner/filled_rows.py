"""Rows that functions of the user fill in before every tick, and those of soft tasks."""

import logging
from collections.abc import Callable, Sequence
from typing import NamedTuple, final

import numpy as np

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


SLOW_TIMES = 5
"""A function that takes longer than a tick so often in a row is slow: now and then it may be interrupted."""
EMPTY = {2: (0.0, 0.0), 3: (0.0, -np.inf, np.inf)}
"""What J and b of a task, or C, l and u of a constraint, hold before a function fills them in."""


class Filled(NamedTuple):
    """A function of the user, and the arrays that it fills in."""

    name: str
    fill: Callable[..., object]
    arrays: tuple[FloatArray, ...]

    def clear(self) -> None:
        """Leave nothing of what was filled in."""
        for array, value in zip(self.arrays, EMPTY[len(self.arrays)], strict=True):
            array[:] = value


@final
class FilledRows:
    """Asks the user's functions for their rows; those of one that fails are empty in that tick."""

    __slots__ = ("_all", "_seen", "_slow", "_tell")

    def __init__(
        self,
        seen: RowState,
        neutral: FloatArray,
        all_of_them: Sequence[Filled],
        tell: Callable[[str, str], None],
    ) -> None:
        self._seen, self._all, self._tell, self._slow = seen, all_of_them, tell, dict[str, int]()
        still = frozen(np.zeros(len(neutral)))
        rest = seen._replace(q=frozen(neutral.copy()), v=still, a=still)
        for name, fill, arrays in all_of_them:
            tried = [
                np.full_like(array, value) for array, value in zip(arrays, EMPTY[len(arrays)], strict=True)
            ]
            if why := _call_checked(fill, rest, *tried):
                letters = ("J", "b") if len(arrays) == 2 else ("C", "l", "u")
                shapes = [f"{letter} {array.shape}" for letter, array in zip(letters, arrays, strict=True)]
                raise InputError(
                    f"fill of {name} {why} at the neutral posture at rest, expected that it writes numbers "
                    f"into {', '.join(shapes[:-1])} and {shapes[-1]} and returns nothing"
                )

    def fill(self) -> None:
        """Fill in all rows. Ctrl-C goes through."""
        for one in self._all:
            one.clear()
            began = now()
            try:
                why = _call_checked(one.fill, self._seen, *one.arrays)
            except BaseException:
                one.clear()
                raise
            self._look_at_time(one.name, 1e-9 * (now() - began))
            if why:
                one.clear()
            self._tell(one.name, why)

    def _look_at_time(self, name: str, took: float) -> None:
        """Tell once of a function that takes longer than a tick, for the loop is late then."""
        times = self._slow.get(name, 0)
        if times >= SLOW_TIMES:
            return
        self._slow[name] = times + 1 if took > self._seen.dt else 0
        if self._slow[name] == SLOW_TIMES:
            _LOG.warning(
                "fill of %s took %.3g ms of a tick of %.3g ms, so that the loop is late; make it quicker, "
                "dt longer, or say step(..., ticks=) how many have passed; this is said once",
                name, 1e3 * took, 1e3 * self._seen.dt,
            )  # fmt: skip


def refuse_asking(asking: Sequence[str], whom: str, remedy: str) -> None:
    """Refuse a planner whose tasks or constraints ask Python, for somebody who does not."""
    if asking:
        ask, them = ("asks", "it") if len(asking) == 1 else ("ask", "them")
        raise InputError(
            f"{', '.join(asking)} {ask} a Python function in every step, which {whom} does not; "
            f"{remedy.format(them=them)}"
        )


def _call_checked(fill: Callable[..., object], state: RowState, *arrays: FloatArray) -> str:
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
