"""Ticks that a late loop has missed are made up for before the one that comes late."""

from operator import index
from typing import Any

from ftqp.control.planner.given_arrays import mistake
from ftqp.control.planner.stages import Tick
from ftqp.core.checks import FloatArray, shown
from ftqp.core.errors import InputError
from ftqp.kernel.entry.orders import Orders
from ftqp.kernel.layout.thresholds import MOST_TICKS


def whole_ticks(ticks: Any) -> int:
    """How many periods have passed, checked."""
    try:
        count = index(ticks)
    except TypeError:
        count = 0
    if count < 1:
        raise InputError(
            f"ticks is {shown(ticks)}, expected how many dt the last step is ago, a whole number >= 1"
        )
    return count


def made_up_for(orders: Orders, tick: Tick, target: tuple[Any, ...], ticks: int, v: FloatArray) -> None:
    """Do the ticks that were missed; nothing was measured at them, and their targets lead to the given one.

    Args:
        orders: The planner's.
        tick: Its tick.
        target: The packed target of the tick that comes late, and its row.
        ticks: How many periods have passed.
        v: Zeros, (nv,).
    """
    packed, row = target
    for left in range(min(ticks, MOST_TICKS) - 1, 0, -1):
        code = orders.miss(packed, row, left)
        try:
            if code >= 0:
                code = tick(orders.expected, v, orders.target, 0)
        finally:
            orders.hear()
        if code < 0:
            raise mistake(code, orders.expected, v, len(v), len(v))
