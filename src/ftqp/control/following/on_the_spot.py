"""Motions on the spot: to postures that self-motions connect with the arm's, from which a path goes on."""

from collections.abc import Iterator
from typing import Final, final

import numpy as np

from ftqp.control.following.ahead import Ahead
from ftqp.control.planner.planner import Planner
from ftqp.core.checks import FloatArray
from ftqp.faults.kinds import FreeSwinging

STRIDE: Final = 0.15
"""Longest step of a joint from one posture to the next [rad or m]: plain Newton steps come back from it, and
the feedback of the path keeps the tip there between. A guess that `python studies/lock_sets.py` has not
contradicted."""
NODES: Final = 200
"""Postures that are looked at before a path is called blocked ..."""
WALKS: Final = 40
"""... on so many walks at most, ..."""
STEPS: Final = 40
"""... each of so many steps at most, ..."""
REACHES: Final = (1.5, 0.4)
"""... in turn towards places drawn so far away in every joint [rad or m, standard deviation]. Guesses that
the same study has not contradicted."""
STALLED: Final = 0.05
"""A walk is over where the self-motion goes so little of the way, as a share of it, by convention."""
FARTHER: Final = 0.02
"""From a posture that is worth going to the path goes on for this share of its rest, by convention."""
PIECE: Final = 5e-4
"""One piece of thinking, which takes some 0.15 ms, for so much time between two ticks [s]: so the verdict on
a path comes within a second. A guess that tests/laws/test_calm.py has not contradicted."""
SHARE: Final = 0.5
"""Joints go there at this share of their speed limits at most, ..."""
BRAKE: Final = 4.0
"""... slower near the place: by this [1/s] times what is left, ..."""
NEAR: Final = 0.02
"""... and at this distance the next place, or the path, follows [rad or m]. Guesses that the same study has
not contradicted."""
WAITS: Final = 1.0
"""A motion that has come no nearer for so long is given up [s]. A guess that the same study has not
contradicted."""


@final
class OnTheSpot:
    """Thinks of a motion on the spot, a piece in every tick, and says how fast the joints are to go along it.

    Walks begin at the arm or where others have been, towards places drawn at random: steps in the null space
    of the task, each followed by Newton steps back to the pose, within the limits that are left, where motors
    hold the arm and it meets nothing. From each posture the rest of the path is followed in thought; the
    first from which all of it can be done is gone to, else the one that gets farthest.

    Args:
        planner: The planner that is led.
        ahead: The rest of its path.

    Attributes:
        is_over: Whether nothing more will be thought of.
        way: Postures to go to one after the other, (k, nv) [rad or m]; None while there is none.
        nodes: Postures that were looked at.

    Source: docs/theory/ways-out.md, "On the spot".
    """

    def __init__(self, planner: Planner, ahead: Ahead) -> None:
        self._planner, self._ahead, self._view = planner, ahead, planner.view()
        self._belief = self._view.belief
        self._per_tick = max(1, int(planner.dt / PIECE))
        self._pieces: Iterator[None] = self._thoughts()
        self.is_over = False
        self.way: FloatArray | None = None
        self.nodes = 0
        self._at, self._least, self._waited = 0, np.inf, 0.0

    @property
    def is_of_now(self) -> bool:
        """Whether nothing is believed otherwise since it began."""
        return self._belief == self._view.belief

    @property
    def sentence(self) -> str:
        """What was looked for."""
        many = f"{self.nodes} posture{'s' * (self.nodes != 1)}"
        return f"{many} that can be reached on the spot were looked at, and the path goes on from none"

    def think(self) -> None:
        """Think for one tick, unless there is a way or no further one."""
        for _ in range(self._per_tick):
            if self.is_over or self.way is not None:
                return
            self.is_over = next(self._pieces, False) is False and self.way is None

    def drive(self, dt: float) -> FloatArray | None:
        """Velocities that lead the joints on along the way, (nv,) [rad/s or m/s]; None where it is over.

        Args:
            dt: The time since the last call [s].
        """
        assert self.way is not None
        view = self._view
        working = view.working
        away = np.where(working, self.way[self._at] - view.command.q, 0.0)
        off = float(np.abs(away).max())
        if off <= NEAR:
            self._at, self._least, self._waited = self._at + 1, np.inf, 0.0
            if self._at >= len(self.way):
                return None
            away = np.where(working, self.way[self._at] - view.command.q, 0.0)
            off = float(np.abs(away).max())
        if off < 0.99 * self._least:
            self._least, self._waited = off, 0.0
        else:
            self._waited += dt
        if self._waited > WAITS or not self.is_of_now:
            return None
        top = SHARE * view.limits.v
        ratio = float((np.abs(away) / np.maximum(top, 1e-9))[working].max(initial=0.0))
        wanted: FloatArray = away * min(BRAKE, 1.0 / max(ratio, 1e-9))
        return wanted

    def _thoughts(self) -> Iterator[None]:
        """All pieces of thinking."""
        planner, view = self._planner, self._view
        search, working = self._ahead.begin(), view.working
        swings = any(isinstance(fault, FreeSwinging) for fault in planner.faults.values())
        if search is None or swings or int(working.sum()) <= search.m:
            return
        here = view.command.q
        root = search.along(here, self._ahead.pose)
        if root is None:
            return
        passable = planner.passable()
        most = max(0.98, float(passable.effort(root[None])[0]))
        room = float(passable.room(root[None])[0])
        yield
        q, parents = [root], [-1]
        generator = np.random.default_rng(0)
        low, high = view.limits.q_min, view.limits.q_max
        best, farthest = -1, FARTHER
        for walk in range(WALKS):
            at = 0 if walk % 2 == 0 else int(generator.integers(len(q)))
            goal = q[at] + REACHES[walk // 2 % len(REACHES)] * generator.standard_normal(len(here))
            goal = np.where(working, np.clip(goal, low, high), here)
            for _ in range(STEPS):
                step = search.sideways(q[at], goal - q[at], STRIDE)
                tried = None
                if step is not None and np.abs(step).max() > STALLED * np.abs(goal - q[at]).max():
                    tried = search.along(np.clip(q[at] + step, low, high), self._ahead.pose)
                yield
                if tried is None or not 0.1 * STRIDE < np.abs(tried - q[at]).max() < 3.0 * STRIDE:
                    break
                places = np.stack([0.5 * (tried + q[at]), tried])
                if (passable.effort(places) > most).any() or (passable.room(places) < min(0.0, room)).any():
                    break
                q.append(tried)
                parents.append(at)
                at = len(q) - 1
                worth = yield from self._ahead.reached(tried)
                if worth > farthest:
                    best, farthest = at, worth
                if worth >= 1.0:
                    break
            self.nodes = len(q) - 1
            if farthest >= 1.0 or self.nodes >= NODES:
                break
        self.nodes = len(q) - 1
        if best < 0:
            return
        found = []
        while best > 0:
            found.append(q[best])
            best = parents[best]
        self.way = np.array(found[::-1])
