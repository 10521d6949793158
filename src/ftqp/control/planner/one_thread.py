"""One planner, one thread: a call that comes while another thread is inside one is refused."""

import sys
from collections.abc import Callable
from functools import update_wrapper
from threading import get_ident
from typing import Any, Concatenate, ParamSpec, TypeVar, final

from ftqp.core.errors import InputError

P = ParamSpec("P")
R = TypeVar("R")
Call = Callable[Concatenate[Any, P], R]


@final
class OneThread:
    """Who is inside a planner.

    A thread that an exception has carried out of a call, at whatever line, may be left standing as inside; it
    is looked for among the threads before another one is refused.
    """

    __slots__ = ("_inside",)

    def __init__(self) -> None:
        self._inside: dict[str, tuple[int, str]] = {}

    def enter(self, planner: Any, call: str) -> bool:
        """Enter a call: whether the thread was outside before.

        Args:
            planner: Whose call it is.
            call: Its name.

        Raises:
            InputError: Another thread is inside.
        """
        me = get_ident(), call
        found = self._inside.setdefault("owner", me)
        if found[0] != me[0]:
            if _is_inside(found[0], planner):
                raise InputError(
                    f"planner.{call} is called while another thread is inside planner.{found[1]}; a planner "
                    "belongs to one thread: let the others hand over to it what they want, by a queue.Queue"
                )
            self._inside["owner"] = found = me
        return found is me

    def leave(self) -> None:
        """Nobody is inside any more."""
        self._inside.pop("owner", None)


def _is_inside(thread: int, planner: Any) -> bool:
    """Whether a thread is in a guarded call of this planner."""
    frame: Any = sys._current_frames().get(thread)
    while frame is not None:
        try:
            if frame.f_code is _GUARD and frame.f_locals.get("planner") is planner:
                return True
            frame = frame.f_back
        except AttributeError:  # the frame was just left: that thread is running in it
            return True
    return False


def guarded(name: str) -> Callable[[Call[P, R]], Call[P, R]]:
    """Lets one thread at a time into a method of a planner, which has an ``OneThread`` as ``_inside``.

    Args:
        name: What the user calls.
    """

    def with_guard(call: Call[P, R]) -> Call[P, R]:
        def guard(planner: Any, /, *args: P.args, **kwargs: P.kwargs) -> R:
            outermost = planner._inside.enter(planner, name)
            try:
                return call(planner, *args, **kwargs)
            finally:
                if outermost:
                    planner._inside.leave()

        return update_wrapper(guard, call)

    return with_guard


_GUARD = guarded("")(lambda planner: None).__code__
