"""A finished run, played from its log."""

from collections.abc import Callable
from dataclasses import replace
from math import isfinite
from threading import Lock
from time import monotonic
from typing import Any, final

import numpy as np

from ftqp.app.run.recorded_robot import notes_of, recorded_robot, scenario_of
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.model.robot import Robot
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.signals import refuse_unknown_conditions
from ftqp.sim.session.frame import DrawnArm, Frame
from ftqp.sim.session.live_session import FASTEST
from ftqp.sim.session.session_commands import Command, Pause, Reset, Seek, Speed
from ftqp.viz.live.stage import Stage


@final
class ReplaySource:
    """Plays a log by a clock [s]: Pause, Speed, Seek and Reset to time 0; it stands at its end."""

    def __init__(self, log: Log, title: str, *, clock: Callable[[], float] = monotonic) -> None:
        if not len(log):
            raise InputError(f"{log.title} has no rows yet, so there is nothing to play")
        for name in ("truth", "belief"):
            refuse_unknown_conditions(log[name], log.title)
        self._log, self._clock = log, clock
        self._t = np.asarray(log["t"], dtype=np.float64)
        self._arm, self._lock = DrawnArm(robot_of(log)), Lock()
        self._paused, self._speed = False, 1.0
        self._message = " ".join(notes_of(log.metadata, float(log["t"][-1])))
        self._at, self._since = float(self._t[0]), clock()
        facts = log.metadata
        self._stage = Stage(
            number=0,
            title=title,
            robot=self._arm.robot,
            scheme=str(facts.get("scheme", "")),
            backend=str(facts.get("backend", "")),
            path=way_of(log),
            urdf=scenario_of(facts).get("robot", {}).get("urdf"),
            live=False,
            duration=float(self._t[-1]),
        )

    def frame(self) -> Frame:
        """The frame of this moment."""
        with self._lock:
            t = self._now()
            tick = max(int(np.searchsorted(self._t, t + 1e-9, side="right")) - 1, 0)
            return replace(
                self._arm.recorded(self._log, tick),
                paused=self._paused,
                speed=self._speed,
                pace=self._speed,
                message=self._message,
            )

    def stage(self) -> Stage:
        """The stage, always the same."""
        return self._stage

    def put(self, command: Command) -> None:
        """Do it at once; what a finished run cannot do is said in the frame's message."""
        with self._lock:
            self._at, self._since = self._now(), self._clock()
            match command:
                case Pause():
                    self._paused = bool(command.paused)
                case Speed() if _is_number(command.factor) and 0.0 < command.factor <= FASTEST:
                    self._speed = float(command.factor)
                case Speed():
                    self._message = (
                        f"Speed is {command.factor!r}, expected a factor above 0 and at most {FASTEST:g}."
                    )
                case Seek() if _is_number(command.t):
                    self._at = min(max(float(command.t), float(self._t[0])), float(self._t[-1]))
                case Reset():
                    self._at = float(self._t[0])
                case _:
                    self._message = "This is a finished run: nothing of it can be changed; view its scenario."

    def _now(self) -> float:
        """Time of the run that is shown [s]."""
        gone = 0.0 if self._paused else self._speed * (self._clock() - self._since)
        return min(self._at + gone, float(self._t[-1]))


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and isfinite(value)


def robot_of(log: Log) -> Robot:
    """The arm of a run."""
    robot, why = recorded_robot(log.rows)
    if robot is None:
        raise InputError(f"{why}; a run can be viewed while its arm can be made")
    return robot


def way_of(log: Log, count: int = 120) -> FloatArray | None:
    """Points of the path that was followed, (count + 1, 3) [m]; None on a base that moves, or without any."""
    if "base_status" in log or not len(log):
        return None
    at = [round(k * (len(log) - 1) / count) for k in range(count + 1)]
    points: FloatArray = log["target"][at, :3]
    return points
