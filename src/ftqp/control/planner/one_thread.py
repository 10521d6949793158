"""One planner, one thread: a call that comes while another thread is inside one is refused.

So is a step that comes from inside a step, of a function that the step asks.
"""

import sys
from collections.abc import Callable
from functools import update_wrapper
from threading import get_ident
from types import FrameType
from typing import Any, Concatenate, ParamSpec, TypeVar, final
from weakref import ref

from ftqp.core.errors import InputError

P = ParamSpec("P")
R = TypeVar("R")
Call = Callable[Concatenate[Any, P], R]


@final
class Stay:
    """Lives as long as a call: an exception ends it, at whatever line it comes."""

    __slots__ = ("__weakref__",)


def _runs(stay: Stay | None) -> bool:
    """Whether the call of this thread with that ``Stay`` still runs; else an exception alone holds it."""
    frame: FrameType | None = sys._getframe()
    while frame is not None:
        if frame.f_code.co_name == "guard" and frame.f_locals.get("stay") is stay:
            return True
        frame = frame.f_back
    return False


@final
class OneThread:
    """Who is inside a planner.

    A thread that an exception has carried out of a call before it could say so is no longer inside: its
    ``Stay`` is gone. While it handles the exception, which still holds that, its stack says so.
    """

    __slots__ = ("_inside",)

    def __init__(self) -> None:
        self._inside: dict[str, tuple[int, str, ref[Stay]]] = {}

    def enter(self, call: str, stay: Stay) -> bool:
        """Enter a call: whether the thread was outside before."""
        me = get_ident(), call, ref(stay)
        found = self._inside.setdefault("owner", me)
        if found is me:
            return True
        if found[2]() is None:
            self._inside["owner"] = me
            return True
        if found[0] != me[0]:
            raise InputError(
                f"planner.{call} is called while another thread is inside planner.{found[1]}; a planner "
                "belongs to one thread: let the others hand over to it what they want, by a queue.Queue"
            )
        if call == found[1] == "step":
            if not _runs(found[2]()):
                self._inside["owner"] = me
                return True
            raise InputError(
                "planner.step is called inside planner.step, by a function that it asks; let that only fill "
                "in its arrays, and step another planner to look ahead"
            )
        return False

    def leave(self) -> None:
        """Nobody is inside any more."""
        self._inside.pop("owner", None)


def guarded(name: str) -> Callable[[Call[P, R]], Call[P, R]]:
    """Lets one thread at a time into a method of a planner, which has an ``OneThread`` as ``_inside``."""

    def with_guard(call: Call[P, R]) -> Call[P, R]:
        def guard(planner: Any, /, *args: P.args, **kwargs: P.kwargs) -> R:
            stay = Stay()
            outermost = planner._inside.enter(name, stay)
            try:
                return call(planner, *args, **kwargs)
            finally:
                if outermost:
                    planner._inside.leave()

        return update_wrapper(guard, call)

    return with_guard
