"""Exceptions and signals that come at any line while a planner is told something or steps."""

import os
import signal
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ftqp
from fuzz.inside.world import Disturbed, Stopped, Told, World

SOURCE = str(Path(ftqp.__file__).parent)
RAISED = (Disturbed, Stopped, MemoryError, RecursionError, SystemExit, ValueError)
LONGEST = 3e-4
"""A timer goes off no later after a call has begun [s]."""
LATER = 1.2
"""Lines are drawn from so many times as many as were seen."""


class AtLine:
    """Does something when the n-th line of ftqp is about to run."""

    def __init__(self, n: int, act: Callable[[], None]) -> None:
        self._left, self._act = n, act
        self.count, self.place = 0, ""

    def __call__(self, frame: Any, event: str, arg: Any) -> Any:
        """Follow the functions of ftqp."""
        return self._line if frame.f_code.co_filename.startswith(SOURCE) else None

    def _line(self, frame: Any, event: str, arg: Any) -> Any:
        if event == "line":
            self.count += 1
            if self.count == self._left:
                name = frame.f_code.co_filename.removeprefix(SOURCE).lstrip("/")
                self.place = f"{name}:{frame.f_lineno}"
                self._act()
        return self._line

    def run(self, call: Callable[[], Any]) -> Any:
        """Make the call, watched."""
        before = sys.gettrace()
        sys.settrace(self)
        try:
            return call()
        finally:
            sys.settrace(before)


def line_of(world: World, name: str) -> int:
    """Which line of a call is to be disturbed."""
    return 1 + int(world.rng.integers(int(LATER * world.lines.get(name, 60)) + 2))


def at_line(world: World, name: str, call: Callable[[], Any], act: Callable[[], None]) -> tuple[Any, bool]:
    """Make a call during which something is done at some line: its result, and whether that was reached."""
    watched = AtLine(line_of(world, name), act)
    try:
        return watched.run(call), watched.place != ""
    finally:
        world.lines[name] = max(world.lines.get(name, 0), watched.count)
        if watched.place:
            world.places.add(watched.place)


def _raise(kind: type[BaseException]) -> None:
    raise kind("at this line")


def _signal() -> None:
    os.kill(os.getpid(), signal.SIGUSR1)


class Signals:
    """Handlers that raise while they are armed; what was there before comes back."""

    def __enter__(self) -> "Signals":
        self._armed = False
        self._on = threading.current_thread() is threading.main_thread()
        if self._on:
            self._before = {
                number: signal.signal(number, self._handle) for number in (signal.SIGUSR1, signal.SIGALRM)
            }
        return self

    def __exit__(self, *error: object) -> None:
        if self._on:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            for number, handler in self._before.items():
                signal.signal(number, handler)

    def _handle(self, number: int, frame: Any) -> None:
        if self._armed:
            self._armed = False
            raise Stopped(signal.Signals(number).name)

    def timed(self, call: Callable[[], Any], delay: float) -> Any:
        """Make a call during which, or after which, a timer goes off."""
        try:
            self._armed = True
            signal.setitimer(signal.ITIMER_REAL, delay)
            result = call()
            self._armed = False
            return result
        finally:
            self._armed = False
            signal.setitimer(signal.ITIMER_REAL, 0.0)

    def sent(self, call: Callable[[], Any]) -> Any:
        """Make a call during which signals are heard."""
        self._armed = True
        try:
            return call()
        finally:
            self._armed = False


def interrupted(world: World, signals: Signals, told: Told) -> None:
    """Tell the planner something, be interrupted, and tell it again, or go on as if nothing had been."""
    rng = world.rng
    way = int(rng.integers(4))
    try:
        if way < 2:
            kind = RAISED[int(rng.integers(len(RAISED)))]
            at_line(world, told.name, told.call, lambda: _raise(kind))
        elif way == 2:
            signals.sent(lambda: at_line(world, told.name, told.call, _signal))
        else:
            signals.timed(told.call, float(rng.uniform(1e-6, LONGEST)))
    except RAISED:
        if told.start is not None or rng.random() < 0.5:
            told.call()
            told.happened(world)
        else:
            _go_on(world, told)
    else:
        told.happened(world)


def _go_on(world: World, told: Told) -> None:
    """Nobody knows whether it has happened; but it has as a whole, or not at all."""
    said = world.planner.faults
    if said == told.told:
        told.happened(world)
    elif said != world.told and not world.made.watched:
        world.watch.say_disagreement(
            f"after {told.name} was interrupted {said} is believed, neither {world.told} nor {told.told}"
        )
        world.told = dict(said)


def interrupted_step(world: World, signals: Signals) -> Any:
    """A step that is interrupted, and made again."""
    rng, way = world.rng, int(world.rng.integers(4))
    try:
        if way < 2:
            kind = RAISED[int(rng.integers(len(RAISED)))]
            return at_line(world, "step", world.make, lambda: _raise(kind))[0]
        if way == 2:
            return signals.sent(lambda: at_line(world, "step", world.make, _signal)[0])
        return signals.timed(
            lambda: [world.make() for _ in range(20)][-1], float(rng.uniform(1e-6, 0.2 * LONGEST))
        )
    except RAISED:
        return world.make()
