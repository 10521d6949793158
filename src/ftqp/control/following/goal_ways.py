"""Other ways to a pose than the straight one of the tip: postures of the goal to which there is a way."""

from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from typing import Final, final

import numpy as np

from ftqp.control.following.led_joints import LOOKS_A_SECOND
from ftqp.control.following.ways import Ways
from ftqp.control.inverse_kinematics.posture_search import PostureSearch
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.planner_view import PlannerView
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.faults.kinds import FreeSwinging
from ftqp.kernel.layout.ways_room import WayStage

STARTS, SLOWER = 256, 4
"""Starts for postures of which only some will do, so many times fewer where fewer joints work than there are
rows, as a start takes so much longer then. Guesses."""
STARTS_EVERY: Final = 1e-3
"""One of these starts, which takes some 0.2 ms, for so much time between two ticks [s]."""
ROUNDS, CHOICE = 8, 24
"""Steps of postures along their self-motions, away from limits, and postures that are looked at closely."""
WORTHLESS: Final = 0.02
"""A posture that is worth less is not gone to, by convention."""
Reach = Callable[[FloatArray], Generator[None, None, float]]


@final
class GoalWays:
    """Thinks of other ways to a pose, a piece in every tick, so that no tick is late and nothing runs beside.

    Postures of the goal are found while trees grow towards them. Where ``reach`` says what a posture is
    worth, postures are found first, and ways are sought to those that are worth most, one after the other.
    The same ticks give the same ways.

    Source: docs/theory/round-obstacles.md.
    """

    def __init__(self, planner: Planner, pose: FloatArray, reach: Reach | None = None) -> None:
        self._planner, self._pose, self._reach = planner, pose, reach
        self._view: PlannerView = planner.view()
        self._looks = max(10, round(LOOKS_A_SECOND * planner.dt))
        self.search: PostureSearch | None = None
        self.forget()

    def forget(self) -> None:
        """Nothing has been thought of yet."""
        self._pieces: Iterator[None] | None = None
        self._way: Ways | None = None
        self.is_over = self.is_ready = False
        self.found = self.starts = self.taken = 0
        self._worth: int | None = None
        self._said = "no other way was looked for"

    @property
    def has_begun(self) -> bool:
        """Whether it has been thought about since ``forget``."""
        return self._pieces is not None

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
        many = f"{self.found} posture{'s' * (self.found > 1)}"
        if self._worth == 0:
            return f"{many} found in {self.starts} starts, and the path goes on from none"
        many = f"{many} of the goal found in {self.starts} starts"
        further = "no further" if self.taken else "no"
        return f"{many}, and {further} way to {'them' if self.found > 1 else 'it'}"

    def _thoughts(self) -> Iterator[None]:
        """All pieces of thinking; it yields after each, and where a way is there."""
        planner, view = self._planner, self._view
        robot, works = planner.robot, int(view.working.sum())
        swings = any(isinstance(fault, FreeSwinging) for fault in planner.faults.values())
        search: PostureSearch | None = None
        if not robot.chain.floating and robot.is_serial:
            with suppress(InputError):
                search = PostureSearch(robot, self._pose, planner.kept_rows, planner.task.axis)
        self.search = search
        if search is None:
            why = "arms with branches, and floating ones, go straight only"
        elif works == 0:
            why = f"no joints work, and the goal has {search.m} rows"
        else:
            why = "a joint swings freely" if swings else ""
        if why or search is None:
            self._said = f"no other way was looked for: {why}"
            return
        yield
        if self._reach is None:
            yield from self._to_any_posture()
        else:
            yield from self._to_worthy_postures(search, self._reach)

    def _to_any_posture(self) -> Iterator[None]:
        """Ways to the goal's postures, each search with other draws."""
        seed = 0
        while True:
            ways = Ways(self._planner, goal=self._pose, seed=seed)
            while ways.is_thinking:
                ways.think(self._looks)
                self.starts, (self.found, _) = ways.starts, ways.postures
                yield
            if ways.stage is WayStage.NO_WAY:
                return
            self._way, self.is_ready, seed = ways, True, seed + 1
            yield

    def _to_worthy_postures(self, search: PostureSearch, reach: Reach) -> Iterator[None]:
        """Ways to postures, the one that is worth most first."""
        planner, view = self._planner, self._view
        limits, working = view.limits, view.working
        search.begin(view.command.q, working=working, q_min=limits.q_min, q_max=limits.q_max)
        per_tick = max(1, int(planner.dt / STARTS_EVERY))
        most = STARTS // (SLOWER if int(working.sum()) < search.m else 1)
        while search.starts < most:
            search.look(per_tick)
            self.starts = search.starts
            yield
        search.thin(CHOICE, limits.v)
        for _ in range(ROUNDS):
            if not search.make_room():
                break
            yield
        ways = Ways(planner)
        places = [one for one in search.q if ways.looks_at(one) is None]
        self.found = len(search.q)
        yield
        worth = []
        for q in places:
            worth.append((yield from reach(q)))
        order = [k for k in np.argsort(np.negative(worth), kind="stable") if worth[k] >= WORTHLESS]
        self._worth = len(order)
        for k in order:
            ways = Ways(planner, goals=[places[k]])
            while ways.is_thinking:
                ways.think(self._looks)
                yield
            if ways.stage is WayStage.READY:
                self._way, self.is_ready = ways, True
                yield
