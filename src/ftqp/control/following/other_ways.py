"""Other ways to a pose than the straight one of the tip: postures of the goal, and ways of the joints."""

from collections.abc import Callable, Generator, Iterator
from typing import final

import numpy as np

from ftqp.control.following.joint_tree import JointTree, passing
from ftqp.control.inverse_kinematics.passable import HELD, MotionValidity
from ftqp.control.inverse_kinematics.posture_search import Posture, PostureSearch, start_box
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.planner_view import PlannerView
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.faults.kinds import FreeSwinging

STARTS_EVERY = 1e-3
"""One start of the search, which takes some 0.2 ms, for so much time between two ticks [s]: a fifth of a
processor."""
ENOUGH = 64
"""Starts after which it is enough to have found one posture where motors hold the arm."""
MOST = 640
"""Starts where none is found ..."""
SLOWER = 10
"""... and where fewer joints work than there are rows a start takes so many times as long, about 2 ms, as
most find nothing: so many times fewer are tried, with so many times the pause between them. Measured on
four arms of the catalog."""
ROUNDS = 8
"""Steps of postures along their self-motions, away from limits."""
CHOICE = 6
"""Postures that are looked at more closely."""
THOROUGH = 4
"""So many times as many starts and postures where only some of the postures will do. These are guesses that
`python benchmarks/compare_peers.py` has not contradicted."""
WORTHLESS = 0.02
"""A posture that is worth less is not gone to, by convention."""
Reach = Callable[[FloatArray], Generator[None, None, float]]
TREES = 3
"""Postures to which a way round is looked for, where no straight one is passable."""


@final
class GoalPosturePlanner:
    """Thinks of other ways to a pose, a piece in every tick, so that no tick is late and nothing runs beside.

    First postures of the goal are looked for, from one start after another. Then the straight way of the
    joints to each is looked at, the soonest first, and then ways round, by ``JointTree``. The same ticks
    give the same ways.

    Attributes:
        search: The search for postures; None for arms that have none: with branches, or floating.

    Source: docs/theory/ways-out.md.
    """

    def __init__(self, planner: Planner, pose: FloatArray, reach: Reach | None = None) -> None:
        self._planner, self._pose, self._reach = planner, pose, reach
        self._view: PlannerView = planner.view()
        self.search = self._searcher()
        self._per_tick = max(1, int(planner.dt / STARTS_EVERY))
        self.forget()

    def _searcher(self) -> PostureSearch | None:
        """The search for this goal."""
        planner = self._planner
        self._fitted = planner.robot
        if planner.robot.chain.floating or not planner.robot.is_serial:
            return None
        try:
            return PostureSearch(planner.robot, self._pose, planner.kept_rows, planner.task.axis)
        except InputError:
            return None

    def forget(self) -> None:
        """Nothing has been thought of yet."""
        self._pieces: Iterator[None] | None = None
        self._way: FloatArray | None = None
        self.is_over = False
        self.found, self.starts = 0, 0
        self._goes_on_from: int | None = None
        self.taken = 0

    @property
    def has_begun(self) -> bool:
        """Whether it has been thought about since ``forget``."""
        return self._pieces is not None

    @property
    def is_ready(self) -> bool:
        """Whether there is a way to take."""
        return self._way is not None

    def think(self) -> None:
        """Think for one tick, unless a way is there to be taken or there are no further ones."""
        if self.is_over or self._way is not None:
            return
        if self._pieces is None:
            self._pieces = self._thoughts()
        if next(self._pieces, False) is False:
            self.is_over = True

    def take(self) -> FloatArray:
        """The places to go to, one after the other, (k, nv) [rad or m]; then it may be thought on."""
        way, self._way = self._way, None
        assert way is not None
        self.taken += 1
        return way

    @property
    def seconds(self) -> float:
        """How long the way that is there takes the slowest joint at full speed [s]; 0 where there is none."""
        if self._way is None:
            return 0.0
        legs = np.abs(np.diff(np.vstack([self._view.command.q, self._way]), axis=0))
        top = np.where(self._view.working, self._view.limits.v, np.inf)
        return float((legs / np.maximum(top, 1e-9)).max(axis=1).sum())

    @property
    def sentence(self) -> str:
        """What was looked for and found."""
        if not self.has_begun:
            return "no other way was looked for"
        if not self.starts:
            return f"no other way was looked for: {self._lacking}"
        if not self.found:
            return f"no other posture found in {self.starts} starts"
        if self._goes_on_from == 0:
            return f"{self.found} postures found in {self.starts} starts, and the path goes on from none"
        many = f"{self.found} posture{'s' * (self.found > 1)} of the goal found in {self.starts} starts"
        return (
            f"{many}, and {'no further' if self.taken else 'no'} way to {'them' if self.found > 1 else 'it'}"
        )

    @property
    def _lacking(self) -> str:
        """Why nothing was looked for."""
        if self.search is None:
            return "arms with branches, and floating ones, go straight only"
        if not self._view.working.any():
            return f"no joints work, and the goal has {self.search.m} rows"
        return "a joint swings freely"

    def _thoughts(self) -> Iterator[None]:
        """All pieces of thinking; it yields after each, and where a way is there."""
        planner, view = self._planner, self._view
        swings = any(isinstance(fault, FreeSwinging) for fault in planner.faults.values())
        if self._fitted is not planner.robot:
            self.search = self._searcher()  # another load or tool
        search = self.search
        works = int(view.working.sum())
        if search is None or swings or works == 0:
            return
        limits, working = view.limits, view.working
        search.begin(view.command.q, working=working, q_min=limits.q_min, q_max=limits.q_max)
        yield
        passable = planner.passable()
        yield
        found: tuple[Posture, ...] = ()
        more = 1 if self._reach is None else THOROUGH
        slower = 1 if works >= search.m else SLOWER
        per_tick, pause = max(1, self._per_tick // slower), max(1, slower // self._per_tick)
        while search.starts < MOST // slower and not found:
            for _ in range(more * ENOUGH // (slower * per_tick) + 1):
                search.look(per_tick)
                self.starts = search.starts
                for _ in range(pause):
                    yield
            search.thin(more * CHOICE, limits.v)
            for _ in range(ROUNDS):
                if not search.make_room():
                    break
                yield
            found = search.postures(more * CHOICE, passable, limits.v)
            self.found = len(found)
            found = tuple(one for one in found if one.is_held)
            yield
        yield from self._ways(found, passable)

    def _ways(self, found: tuple[Posture, ...], passable: MotionValidity) -> Iterator[None]:
        """Straight ways of the joints to postures, then ways round."""
        view, far = self._view, []
        if self._reach is not None:
            worth = []
            for posture in found:
                worth.append((yield from self._reach(posture.q)))
            order = sorted(range(len(found)), key=lambda k: -worth[k])
            found = tuple(found[k] for k in order if worth[k] >= WORTHLESS)
            self._goes_on_from = len(found)
        for posture in found:
            here = view.command.q
            if (yield from passing(passable, here, posture.q, self._effort(passable, here))):
                self._way = posture.q[None]
            else:
                far.append(posture)
            yield
        low, high = start_box(self._planner.robot, limited=True)
        limits = view.limits
        low, high = np.maximum(low, limits.q_min), np.minimum(high, limits.q_max)
        for posture in far[:TREES]:
            here = view.command.q
            tree = JointTree(
                passable, here, posture.q, moves=view.working, low=low, high=high,
                effort=self._effort(passable, here),
            )  # fmt: skip
            for _ in tree.grow():
                yield
            self._way = tree.way
            yield

    @staticmethod
    def _effort(passable: MotionValidity, here: FloatArray) -> float:
        """Motors that cannot hold the arm where it is count as strong enough for what they need there."""
        return max(HELD, float(passable.effort(here[None])[0]))
