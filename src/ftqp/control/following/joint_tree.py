"""A way of the joints round what is in between: two trees that grow towards each other (RRT-Connect)."""

from collections.abc import Generator, Iterator
from typing import final

import numpy as np

from ftqp.control.inverse_kinematics.passable import MotionValidity
from ftqp.core.checks import BoolArray, FloatArray

REACH = 0.6
"""Longest edge of a tree, in the joint that goes farthest [rad or m]."""
AT_ONCE = 8
"""Places that are looked at in one piece."""
GROWTHS = 600
"""Edges that are tried before a way is given up."""
SHORTCUTS = 40
"""Pairs of places that are tried for a straight connection once there is a way."""

Pieces = Generator[None, None, bool]
"""Thinking that yields after each piece and ends with an answer."""


def passing(passable: MotionValidity, begin: FloatArray, end: FloatArray, effort: float) -> Pieces:
    """Look at the straight way of the joints, a few places at a time: whether it is passable.

    Its end counts, its begin does not.
    """
    count = max(1, int(np.ceil(float(np.abs(end - begin).max()) / passable.spacing)))
    share = (np.arange(count) + 1.0)[:, None] / count
    for k in range(0, count, AT_ONCE):
        if not passable.at(begin + share[k : k + AT_ONCE] * (end - begin), effort).all():
            return False
        if k + AT_ONCE < count:
            yield
    return True


@final
class JointTree:
    """Looks for places to pass by between two postures, one edge at a time.

    One tree grows from either posture. In turn, one grows an edge towards a random place, and the other one
    as far as it gets towards the end of that edge; where they meet there is a way, which is then made
    straighter.

    Attributes:
        way: The places to go to one after the other, the last one is the goal, (k, nv); None while there is
            none.

    Source: Kuffner and LaValle 2000.
    """

    def __init__(
        self,
        passable: MotionValidity,
        begin: FloatArray,
        goal: FloatArray,
        *,
        moves: BoolArray,
        low: FloatArray,
        high: FloatArray,
        effort: float,
        seed: int = 0,
    ) -> None:
        self._passable, self._effort = passable, effort
        self._moves, self._low, self._high = moves, low, high
        self._random = np.random.default_rng(seed)
        self._trees = ([begin.copy()], [goal.copy()])
        self._parents: tuple[list[int], list[int]] = ([-1], [-1])
        self.way: FloatArray | None = None

    def grow(self) -> Iterator[None]:
        """Search; the generator yields after every edge and ends with a way, or where it gives up."""
        for k in range(GROWTHS):
            one, other = k % 2, 1 - k % 2
            place = self._low + self._random.random(len(self._low)) * (self._high - self._low)
            place[~self._moves] = self._trees[0][0][~self._moves]
            new = yield from self._edge(one, place)
            yield
            if new is None:
                continue
            aim, met = self._trees[one][new], False
            while not met:
                last = yield from self._edge(other, aim)
                yield
                if last is None:
                    break
                met = bool(np.abs(self._trees[other][last] - aim).max() < 1e-12)
                if met:
                    ends = (new, last) if one == 0 else (last, new)
                    yield from self._straighten(self._joined(*ends))
                    return

    def _edge(self, tree: int, place: FloatArray) -> Generator[None, None, int | None]:
        """Grow an edge towards a place; the index of its end, or None where it is not passable."""
        nodes = np.array(self._trees[tree])
        near = int(np.argmin(np.abs(nodes - place).max(axis=1)))
        way = place - nodes[near]
        size = float(np.abs(way).max())
        end = place if size <= REACH else nodes[near] + way * (REACH / size)
        if size == 0.0 or not (yield from passing(self._passable, nodes[near], end, self._effort)):
            return None
        self._trees[tree].append(end.copy())
        self._parents[tree].append(near)
        return len(self._trees[tree]) - 1

    def _joined(self, first: int, second: int) -> list[FloatArray]:
        """The places from the begin to the goal, where the trees met."""
        places: list[FloatArray] = []
        while first >= 0:
            places.insert(0, self._trees[0][first])
            first = self._parents[0][first]
        second = self._parents[1][second]
        while second >= 0:
            places.append(self._trees[1][second])
            second = self._parents[1][second]
        return places

    def _straighten(self, places: list[FloatArray]) -> Iterator[None]:
        """Leave out places between two others that have a straight way."""
        for _ in range(SHORTCUTS):
            if len(places) < 3:
                break
            i = int(self._random.integers(len(places) - 2))
            j = int(self._random.integers(i + 2, len(places)))
            if (yield from passing(self._passable, places[i], places[j], self._effort)):
                del places[i + 1 : j]
            yield
        self.way = np.array(places[1:])
