"""Motion after a stop: it begins where the arm is, slowly, and only while the controller is ready."""

from collections.abc import Callable, Generator
from math import ceil
from typing import Any, Final, NamedTuple

import numpy as np

from ftqp.control.planner.planner import Planner
from ftqp.core.checks import FloatArray, instance, positive
from ftqp.core.errors import InputError
from ftqp.vendors.word_watch import ONE_STEP, Watch

READY: Final = 0.1
"""The controller is ready and the arm stands for so long without a gap [s]."""
RISES: Final = 2.0
"""From the share of speed at the beginning to full speed in so long [s]."""
WAITS: Final = 60.0
"""Nobody waits longer for a controller [s]."""


class Again(NamedTuple):
    """Where a beginning is.

    Attributes:
        leads: Whether the planner leads the arm in this period: step it, and send its command.
        why: How far it is, or what it waits for, in words.
    """

    leads: bool
    why: str


def begin_again(
    planner: Planner, read: Callable[[], Any], send: Callable[[FloatArray], object],
    ready: Callable[[], bool | str], speed: float = 0.1, *, watch: Watch | None = None,
) -> Generator[Again, None, bool]:  # fmt: skip
    """Lead an arm on after a stop: a generator that is advanced once a period.

        for now in ftqp.vendors.begin_again(planner, read, send, ready):
            if now.leads:
                send(planner.step(read(), None, target).q)

    It waits until ``ready`` has been true and the arm has stood for 0.1 s, resets the planner to what is
    measured, and sends that. ``planner.resume()`` would send an arm that was moved meanwhile back. Faults
    survive. From then on the planner leads: your target begins at ``planner.robot.pose(q)``, and
    ``planner.speed`` rises to what it was in 2 s, for whatever leads by it; targets of your own clock are
    for you to slow down. If ``ready`` ends, the planner stops, and all begins anew.

    Args:
        planner: The planner that was stopped.
        read: Measures the configuration, (nv,) [rad or m]; it waits while NaN is in it.
        send: Sends positions to the arm.
        ready: Whether the controller takes commands; a string says why not.
        speed: Share of the planner's speed at the beginning, in (0, 1].
        watch: What ``read`` looks with: what it does not see any more is withdrawn.

    Returns:
        Whether the arm goes on, as the value of the generator; not after 60 s without ``ready``, and the last
        ``why`` says what it waited for.

    Raises:
        InputError: No planner or watch, nothing that can be called, or a speed outside (0, 1].
    """
    instance("planner", planner, Planner, "an ftqp.Planner, ftqp.Planner(robot)")
    instance("watch", watch, Watch | None, 'an ftqp.vendors.Watch, Watch(planner, "feetech"), or None')
    for name, called in (("read", read), ("send", send), ("ready", ready)):
        instance(name, called, Callable, "a function")  # type: ignore[arg-type]
    if not 0.0 < positive("speed", speed) <= 1.0:
        raise InputError(f"speed is {speed:g}, expected a share of full speed in (0, 1]")
    return _beginning(planner, read, send, ready, speed, watch)


def _beginning(
    planner: Planner, read: Callable[[], Any], send: Callable[[FloatArray], object],
    ready: Callable[[], bool | str], speed: float, watch: Watch | None,
) -> Generator[Again, None, bool]:  # fmt: skip
    """The generator of ``begin_again``."""
    dt, full = planner.dt, planner.speed
    window, rise, last = (ceil(span / dt - 1e-9) for span in (READY, RISES, WAITS))
    try:
        while True:
            stood, waited, place = 0, 0, None
            while stood < window:
                said, q = ready(), np.asarray(read(), dtype=float)
                rests = place is not None and bool(np.all(np.abs(q - place) <= ONE_STEP))
                place = place if rests else q.copy()
                stood, waited = (stood + 1 if rests and said is True else 0), waited + 1
                why = "waits until the arm stands" if said is True else _why(said)
                if waited >= last:
                    yield Again(False, f"not ready for {WAITS:.0f} s: {why}")
                    return False
                if stood < window:
                    yield Again(False, why)
            if watch is not None:
                watch.begin()
            planner.reset(q)
            share = speed
            planner.speed = share * full
            send(q.copy())
            yield Again(False, "begins where the arm is")
            for tick in range(1, rise + 1):
                said = ready()
                if said is not True:
                    break
                if tick % window == 0:
                    share = speed + (1.0 - speed) * tick / rise
                    planner.speed = share * full
                yield Again(True, f"at {share:.2f} of its speed")
            else:
                return True
            planner.stop()
            yield Again(False, _why(said))
    finally:
        planner.speed = full


def _why(said: bool | str) -> str:
    """Why the controller is not ready."""
    return said if isinstance(said, str) else "the controller is not ready"
