"""One planner, one thread: a call that comes while another thread is inside one is refused.

So is a step that comes from inside a step, of a function that the step asks.
"""

import sys
from collections.abc import Callable
from functools import update_wrapper
from threading import get_ident
from types import FrameType
from typing import Any, Concatenate, Final, ParamSpec, TypeVar

from ftqp.core.errors import InputError

P = ParamSpec("P")
R = TypeVar("R")
Call = Callable[Concatenate[Any, P], R]
Inside = dict[str, tuple[int, str, FrameType]]
"""The thread, the name and the frame of the call that is inside a planner, under ``CALL``; or nothing."""
CALL: Final = "call"


def _runs(thread: int, frame: FrameType) -> bool:
    """Whether a call of that thread still runs; one that an exception has ended may not have said so."""
    found = sys._current_frames().get(thread)
    while found is not None and found is not frame:
        found = found.f_back
    return found is not None


def _enter(inside: Inside, me: tuple[int, str, FrameType]) -> bool:
    """Whether nobody was inside before; a call of another thread is refused, and a step inside a step."""
    found = inside.setdefault(CALL, me)
    if found is me:
        return True
    (thread, call, _), (owner, other, frame) = me, found
    if not _runs(owner, frame):
        inside[CALL] = me
        return True
    if thread != owner:
        raise InputError(
            f"planner.{call} is called while another thread is inside planner.{other}; a planner "
            "belongs to one thread: let the others hand over to it what they want, by a queue.Queue"
        )
    if call == other == "step":
        raise InputError(
            "planner.step is called inside planner.step, by a function that it asks; let that only fill "
            "in its arrays, and step another planner to look ahead"
        )
    return False


def guarded(name: str) -> Callable[[Call[P, R]], Call[P, R]]:
    """Lets one thread at a time into a method of a planner, which has an ``Inside`` as ``_inside``."""

    def with_guard(call: Call[P, R]) -> Call[P, R]:
        def guard(planner: Any, /, *args: P.args, **kwargs: P.kwargs) -> R:
            inside: Inside = planner._inside
            if not _enter(inside, (get_ident(), name, sys._getframe())):
                return call(planner, *args, **kwargs)
            try:
                return call(planner, *args, **kwargs)
            finally:
                inside.pop(CALL, None)

        return update_wrapper(guard, call)

    return with_guard
