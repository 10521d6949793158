"""Other ways to a pose than the straight one of the tip: postures of the goal to which there is a way."""

from collections.abc import Iterator
from typing import Final, final

import numpy as np

from ftqp.control.following.led_joints import looks_per_tick
from ftqp.control.following.ways import Ways
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.planner_view import PlannerView
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.core.pose import rotation_exp, rotation_vector
from ftqp.faults.kinds import FreeSwinging
from ftqp.kernel.layout.ways_room import WayStage

NOTHING: Final = "no other way was looked for"
LINE, LEAP = 100, 0.3
"""Whether joints can follow the straight way of the tip is asked in so many places of it, and from one to the
next they go this far at most [rad or m]. Guesses."""


@final
class GoalWays:
    """Thinks of other ways to a pose, a piece in every tick, so that no tick is late and nothing runs beside.

    First the straight way of the tip is followed in thought. Then postures of the goal are found while trees
    grow towards them. The same ticks give the same ways.

    Attributes:
        goes_straight: Whether the joints can follow the straight way; None while that is not known.
        is_looking: Whether other ways have been looked for.

    Source: docs/theory/round-obstacles.md.
    """

    def __init__(self, planner: Planner, pose: FloatArray, tolerance: tuple[float, float]) -> None:
        self._planner, self._pose, self.tolerance = planner, pose, tolerance
        self._view: PlannerView = planner.view()
        self._looks = looks_per_tick(planner.dt)
        self.forget()

    def forget(self) -> None:
        """Nothing has been thought of yet."""
        self._pieces: Iterator[None] | None = None
        self._way: Ways | None = None
        self.is_over = self.is_ready = self.is_looking = False
        self.goes_straight: bool | None = None
        self.found = self.starts = self.taken = 0
        self._said = NOTHING

    def think(self) -> None:
        """Think for one tick, unless a way is there to be taken or there are no further ones."""
        if self.is_over or self.is_ready:
            return
        if self._pieces is None:
            self._pieces = self._thoughts()
        self.is_over = next(self._pieces, False) is False

    def take(self) -> FloatArray:
        """The posture to go to, (nv,) [rad or m]; then it may be thought on."""
        assert self._way is not None
        self.is_ready = False
        self.taken += 1
        end: FloatArray = self._way.way[-1]
        return end

    def give_up(self, ways: Ways) -> None:
        """There is no way, as a search from where the arm came to rest has found."""
        self.starts, (self.found, _) = ways.starts, ways.postures
        self.is_over = self.is_looking = True

    @property
    def seconds(self) -> float:
        """How long the way that is there takes [s]; 0 where there is none."""
        return self._way.duration if self.is_ready and self._way is not None else 0.0

    @property
    def sentence(self) -> str:
        """What was looked for and found."""
        if not self.starts:
            return self._said
        if not self.found:
            return f"no other posture found in {self.starts} starts"
        many = f"{self.found} posture{'s' * (self.found > 1)} of the goal found in {self.starts} starts"
        further = "no further" if self.taken else "no"
        return f"{many}, and {further} way to {'them' if self.found > 1 else 'it'}"

    def _thoughts(self) -> Iterator[None]:
        """Ways to the goal's postures, each search with other draws; it yields where one is there, too."""
        planner, works = self._planner, int(self._view.working.sum())
        if planner.robot.chain.floating or not planner.robot.is_serial:
            self._said = f"{NOTHING}: arms with branches, and floating ones, go straight only"
        elif works == 0:
            self._said = f"{NOTHING}: no joints work"
        elif any(isinstance(fault, FreeSwinging) for fault in planner.faults.values()):
            self._said = f"{NOTHING}: a joint swings freely"
        else:
            try:
                yield from self._followed()
                self.is_looking = True
                yield from self._searched()
            except InputError as error:
                self._said = f"{NOTHING}: {error}"

    def _followed(self) -> Iterator[None]:
        """Follow the straight way of the tip."""
        view, share = self._view, np.linspace(0.0, 1.0, LINE + 1)
        now, goal = view.tip.pose, self._pose
        turn = rotation_vector(goal[:3, :3] @ now[:3, :3].T)
        line = np.tile(now, (LINE + 1, 1, 1))
        line[:, :3, 3] += share[:, None] * (goal[:3, 3] - now[:3, 3])
        line[:, :3, :3] = [rotation_exp(k * turn) @ now[:3, :3] for k in share]
        leap = np.full(len(view.working), LEAP)
        ways = Ways(self._planner, path=line, leap=leap, tolerance=self.tolerance)
        ways.begin_following(view.command.q, 0)
        while not ways.follow(self._looks):
            yield
        self.goes_straight = ways.followed == LINE
        yield

    def _searched(self) -> Iterator[None]:
        seed = 0
        while True:
            ways = Ways(self._planner, goal=self._pose, tolerance=self.tolerance, seed=seed)
            while ways.is_thinking:
                ways.think(self._looks)
                self.starts, (self.found, _) = ways.starts, ways.postures
                yield
            if ways.stage is WayStage.NO_WAY:
                return
            self._way, self.is_ready, seed = ways, True, seed + 1
            yield
