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


def interrupted(call: Callable[[], Any], line: int, act: Callable[[], Any] = stop) -> bool:
    """Whether the call came to the ``line``-th line of ftqp, from 0 on, before which ``act`` was done."""
    count = -1

    def look(frame: Any, event: str, _: Any) -> Any:
        nonlocal count
        file = frame.f_code.co_filename
        if not file.startswith(SOURCE) or file.startswith(LOADING):
            return None
        if event == "line":
            count += 1
            if count == line:
                act()
        return look

    before = sys.gettrace()
    sys.settrace(look)
    try:
        call()
    except Interrupt:
        return True
    finally:
        sys.settrace(before)
    return count >= line
