"""Calls that are interrupted: an exception at the n-th line of ftqp that they run."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

SOURCE = str(Path(__file__).resolve().parents[1] / "src" / "ftqp")
LOADING = str(Path(SOURCE, "kernel", "compiled"))
"""What loads machine code holds a lock of the process: left there by a tracer, other tests would wait."""


class Interrupt(Exception):
    """What a signal handler might raise."""


def stop() -> None:
    """What an interruption does."""
    raise Interrupt


def traced(call: Callable[[], Any], at_line: Callable[[Any], None]) -> None:
    """Make a call, and look at every line of ftqp before it is run."""

    def look(frame: Any, event: str, _: Any) -> Any:
        file = frame.f_code.co_filename
        if not file.startswith(SOURCE) or file.startswith(LOADING):
            return None
        if event == "line":
            at_line(frame)
        return look

    before = sys.gettrace()
    sys.settrace(look)
    try:
        call()
    finally:
        sys.settrace(before)


def interrupted(call: Callable[[], Any], line: int, act: Callable[[], Any] = stop) -> bool:
    """Whether the call came to the ``line``-th line of ftqp, from 0 on, before which ``act`` was done."""
    count = -1

    def at_line(_: Any) -> None:
        nonlocal count
        count += 1
        if count == line:
            act()

    try:
        traced(call, at_line)
    except Interrupt:
        return True
    return count >= line


def lines_of(call: Callable[[], Any]) -> list[int]:
    """When each line of ftqp is run for the first and for the last time, as ``interrupted`` counts."""
    first: dict[tuple[str, int], int] = {}
    last: dict[tuple[str, int], int] = {}
    count = -1

    def at_line(frame: Any) -> None:
        nonlocal count
        count += 1
        place = frame.f_code.co_filename, frame.f_lineno
        first.setdefault(place, count)
        last[place] = count

    traced(call, at_line)
    return sorted({*first.values(), *last.values()})
