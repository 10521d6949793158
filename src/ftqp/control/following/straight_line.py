"""The straight way of the tip to a pose, followed in thought before it is gone."""

from collections.abc import Iterator
from typing import final

import numpy as np

from ftqp.control.following.led_joints import looks_per_tick
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.planner_view import PlannerView
from ftqp.control.planner.ways.ways import Ways
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.core.pose import rotation_exp, rotation_vector
from ftqp.faults.kinds import FreeSwinging

PLACES, LEAP = 100, 0.3
"""The way is looked at in so many places, and from one to the next joints go this far at most [rad or m].
Guesses."""


@final
class StraightLine:
    """Asks whether the joints can follow the straight way of the tip to a pose, a piece in every tick.

    Attributes:
        goes: Whether they can, within limits and clear of the scene; None while that is not known.
        refusal: Why it is not asked, nor for other ways; empty where it is.

    Source: docs/theory/ways-to-a-goal.md.
    """

    def __init__(self, planner: Planner, pose: FloatArray, tolerance: tuple[float, float]) -> None:
        self._planner, self._pose, self._tolerance = planner, pose, tolerance
        self._view: PlannerView = planner.view()
        self._looks = looks_per_tick(planner.dt)
        self.forget()

    def forget(self) -> None:
        """Nothing has been thought of yet."""
        self.goes: bool | None = None
        self.refusal = ""
        self._pieces: Iterator[None] = self._thoughts()

    @property
    def asked(self) -> dict[str, object]:
        """What is asked of ``Ways`` in its place."""
        return {"goal": self._pose, "tolerance": self._tolerance}

    def think(self) -> bool | None:
        """Think for one tick, until it is known; whether they can follow it."""
        if self.goes is None and not self.refusal:
            next(self._pieces, None)
        return self.goes

    def _thoughts(self) -> Iterator[None]:
        robot, view = self._planner.robot, self._view
        if robot.chain.floating or not robot.is_serial:
            self.refusal = "arms with branches, and floating ones, go straight only"
        elif not view.working.any():
            self.refusal = "no joints work"
        elif any(isinstance(fault, FreeSwinging) for fault in self._planner.faults.values()):
            self.refusal = "a joint swings freely"
        if self.refusal:
            return
        share, now = np.linspace(0.0, 1.0, PLACES + 1), view.tip.pose
        turn = rotation_vector(self._pose[:3, :3] @ now[:3, :3].T)
        line = np.tile(now, (PLACES + 1, 1, 1))
        line[:, :3, 3] += share[:, None] * (self._pose[:3, 3] - now[:3, 3])
        line[:, :3, :3] = [rotation_exp(k * turn) @ now[:3, :3] for k in share]
        leap = np.full(robot.nv, LEAP)
        try:
            ways = Ways(self._planner, path=line, leap=leap, tolerance=self._tolerance)
        except InputError as error:
            self.refusal = str(error)
            return
        ways.begin_following(view.command.q, 0)
        while not ways.follow(self._looks):
            yield
        self.goes = ways.followed == PLACES
        yield
