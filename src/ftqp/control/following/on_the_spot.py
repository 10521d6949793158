"""Motions on the spot, or near a path: to postures that they lead to and from which the path goes on."""

from collections.abc import Generator, Iterator
from typing import Any, Final, NamedTuple, final

import numpy as np

from ftqp.control.following.ahead import PathLookahead
from ftqp.control.following.path_tube import PathTube
from ftqp.control.inverse_kinematics.passable import HELD, passing
from ftqp.control.inverse_kinematics.posture_search import PostureSearch
from ftqp.control.planner.planner import Planner
from ftqp.core.checks import FloatArray
from ftqp.faults.kinds import FreeSwinging

STRIDE: Final = 0.15
"""Longest step of a joint from one posture to the next [rad or m]: plain Newton steps come back from it, and
the feedback of the path keeps the tip there between."""
NODES: Final = 200
"""Postures that are looked at before a path is called blocked, a quarter of them where little is left, ..."""
WALKS: Final = 40
"""... on so many walks at most, ..."""
STEPS: Final = 40
"""... each of so many steps at most, ..."""
REACHES: Final = (1.5, 0.4)
"""... in turn towards places drawn so far away in every joint [rad or m, standard deviation]."""
STALLED: Final = 0.05
"""A walk is over where the self-motion goes so little of the way, as a share of it, by convention."""
FARTHER: Final = 0.02
"""From a posture that is worth going to the path goes on for this share of its rest, by convention; where
hardly anything is left, for all of it."""
PIECE, NEAR_PIECE = 5e-4, 2e-3
"""One piece of thinking, which takes some 0.15 ms, for so much time between two ticks [s]: so the verdict on
a path comes within a second."""
SHARE: Final = 0.5
"""Joints go there at this share of their speed limits at most, ..."""
BRAKE: Final = 4.0
"""... slower near the place: by this [1/s] times what is left, ..."""
NEAR: Final = 0.02
"""... and at this distance the next place, or the path, follows [rad or m]."""
WAITS: Final = 1.0
"""A motion that has come no nearer for so long is given up [s]."""
BACK: Final = 0.1
"""In a tube walks begin so much of the path farther back at most."""
MERGED: Final = 24
"""So many steps of a way in a tube may become one at most."""


class _Node(NamedTuple):
    """A posture of a walk: its own, its parent's number, postures from there on, and what it is worth.

    ``back`` are postures that lead from it to where the path was left, in a tube.
    """

    q: FloatArray
    parent: int
    edge: FloatArray
    worth: float
    back: Any = None


@final
class SelfMotionPlanner:
    """Thinks of a motion on the spot, or near the path, a piece in every tick.

    It says how fast the joints are to go along it. Walks begin at the arm or where others have been, towards
    places drawn at random: steps in the null space of the task, each followed by Newton steps back to the
    pose, within the limits that are left, where motors hold the arm and it meets nothing. From each posture
    the rest of the path is followed in thought; the first from which all of it can be done is gone to, else
    the one that gets farthest.

    In a tube the path is first followed as nearly as the joints can, until they are on it again. Walks go
    back along it first, by as much as drawn, and the tip may leave it: directions in which it hardly moves
    count as self-motions, and what leads out of the tube is led back onto the path.

    Attributes:
        is_over: Whether nothing more will be thought of.
        way: Postures to go to one after the other, (k, nv) [rad or m]; None while there is none.
        starts: Postures that were looked at.
        until: The path time at which the way comes back to the path [s].

    Source: docs/theory/ways-out.md, "On the spot".
    """

    def __init__(self, planner: Planner, ahead: PathLookahead, tube: PathTube | None = None) -> None:
        self._planner, self._ahead, self._view, self._tube = planner, ahead, planner.view(), tube
        self._belief = self._view.belief
        self._per_tick = max(1, int(planner.dt / (PIECE if tube is None else NEAR_PIECE)))
        self._pieces: Iterator[None] = self._thoughts()
        self.is_over = False
        self.way: FloatArray | None = None
        self.starts, self.until = 0, ahead.progress
        self._at, self._least, self._waited = 0, np.inf, 0.0

    @property
    def is_of_now(self) -> bool:
        """Whether nothing is believed otherwise since it began."""
        return self._belief == self._view.belief

    @property
    def sentence(self) -> str:
        """What was looked for."""
        if self.is_over and not self.starts:
            return f"no joint is left for a motion {'on the spot' if self._tube is None else 'near the path'}"
        many = f"{self.starts} posture{'s' * (self.starts != 1)}"
        where = "on the spot" if self._tube is None else "near the path"
        return f"{many} that can be reached {where} were looked at, and the path goes on from none"

    @property
    def is_ready(self) -> bool:
        """Whether there is a way to take."""
        return self.way is not None

    def take(self) -> FloatArray:
        """The places to go to one after the other, (k, nv) [rad or m]."""
        assert self.way is not None
        return self.way

    def think(self) -> None:
        """Think for one tick, unless there is a way or no further one."""
        for _ in range(self._per_tick):
            if self.is_over or self.way is not None:
                return
            self.is_over = next(self._pieces, False) is False and self.way is None

    def drive(self, dt: float) -> FloatArray | None:
        """Velocities that lead the joints on along the way, (nv,) [rad/s or m/s]; None where it is over."""
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
        planner, view, tube, ahead = self._planner, self._view, self._tube, self._ahead
        search, working = ahead.begin(), view.working
        swings = any(isinstance(fault, FreeSwinging) for fault in planner.faults.values())
        if search is None or swings or (tube is None and int(working.sum()) <= search.m):
            return
        root = search.along(view.command.q, ahead.pose)
        if root is None and tube is None:
            return
        root = view.command.q if root is None else root
        self._passable = planner.passable(tube)
        self._most = max(HELD, float(self._passable.effort(root[None])[0]))
        self._room = min(0.0, float(self._passable.room(root[None])[0]))
        yield
        if tube is not None:
            yield from self._pass_by(root)
            if self.way is not None:
                return
        nodes, generator = [_Node(root, -1, root[None], 0.0)], np.random.default_rng(0)
        best, low, high = 0, view.limits.q_min, view.limits.q_max
        enough = NODES // 4 if ahead.is_little else NODES
        for walk in range(WALKS):
            at = 0 if walk % 2 == 0 else int(generator.integers(len(nodes)))
            if tube is not None:
                at = yield from self._retreat(nodes, at, generator.random())
            reach = REACHES[walk // 2 % len(REACHES)]
            goal = nodes[at].q + reach * generator.standard_normal(len(root))
            goal = np.where(working, np.clip(goal, low, high), root)
            for _ in range(STEPS):
                tried = yield from self._tried(nodes[at].q, goal, search)
                yield
                if tried is None or not self._passes(nodes[at].q, tried):
                    break
                nodes.append(_Node(tried, at, tried[None], 0.0))
                at = len(nodes) - 1
                yield from self._value(nodes, search)
                best = at if nodes[at].worth > nodes[best].worth else best
                if nodes[best].worth >= 1.0:
                    break
            self.starts = len(nodes) - 1
            if nodes[best].worth >= 1.0 or self.starts >= enough:
                break
        if nodes[best].worth > (0.999 if ahead.is_little else FARTHER):
            yield from self._found(nodes, best)

    def _pass_by(self, root: FloatArray) -> Iterator[None]:
        """Follow the path as nearly as the joints can, within the tube, until they are on it again."""
        gone, ahead = [root], self._ahead
        for q, time, there in ahead.near(root):
            yield
            if not (yield from passing(self._passable, gone[-1], q, self._most)):
                return
            gone.append(q)
            if there and (yield from ahead.reached(q, time=time)) > FARTHER + self._share(time):
                self.until = time
                yield from self._merge(np.array(gone))
                return

    def _share(self, time: float) -> float:
        """The share of the rest of the path that is before a time."""
        return (time - self._ahead.progress) / (self._ahead.duration - self._ahead.progress)

    def _tried(
        self, q: FloatArray, goal: FloatArray, search: PostureSearch
    ) -> Generator[None, None, FloatArray | None]:
        """A posture one step farther towards a goal; None where there is none."""
        tube, limits = self._tube, self._view.limits
        stride, slack = (STRIDE, 0.0) if tube is None else (tube.stride, tube.slack)
        step = search.sideways(q, goal - q, stride, slack)
        if step is None or np.abs(step).max() <= min(0.99 * stride, STALLED * np.abs(goal - q).max()):
            return None
        place = np.clip(q + step, limits.q_min, limits.q_max)
        if tube is None:
            tried = search.along(place, self._ahead.pose)
        elif tube.room(place[None])[0] > 0.0:
            tried = place
        else:
            yield
            tried = tube.onto(place, search)
        near = tried is None or not 0.1 * stride < np.abs(tried - q).max() < 3.0 * stride
        return None if near else tried

    def _passes(self, begin: FloatArray, end: FloatArray) -> bool:
        """Whether the arm may be on the way and at the end of a step."""
        count = 2 if self._tube is None else int(np.ceil(np.abs(end - begin).max() / self._tube.spacing))
        places = begin + (np.arange(max(count, 1)) + 1.0)[:, None] / max(count, 1) * (end - begin)
        held = (self._passable.effort(places) <= self._most).all()
        return bool(held and (self._passable.room(places) >= self._room).all())

    def _retreat(self, nodes: "list[_Node]", at: int, drawn: float) -> Generator[None, None, int]:
        """Add where the arm would be a drawn way back along the path, if it can; the node to walk from."""
        tube, ahead = self._tube, self._ahead
        assert tube is not None
        time = tube.time_of(nodes[at].q)
        back = min(time, drawn * BACK * ahead.duration)
        gone = yield from ahead.along(nodes[at].q, time, time - back, tube.stride)
        yield
        if gone is None or not len(gone):
            return at
        nodes.append(_Node(gone[-1], at, gone, 0.0))
        return len(nodes) - 1

    def _value(self, nodes: "list[_Node]", search: PostureSearch) -> Iterator[None]:
        """Look how far the path can be followed from the last node, back to where it was left before."""
        node, tube, ahead = nodes[-1], self._tube, self._ahead
        if tube is not None:
            on = tube.onto(node.q, search)
            yield
            if on is None or np.abs(on - node.q).max() > 2.0 * tube.stride or not self._passes(node.q, on):
                return
            yield
            gone = yield from ahead.along(on, tube.time_of(on), ahead.progress, tube.stride)
            if gone is None:
                return
            yield
            node = node._replace(back=np.vstack([on, gone]))
        worth = yield from ahead.reached(node.q if node.back is None else node.back[-1])
        nodes[-1] = node._replace(worth=worth)

    def _found(self, nodes: "list[_Node]", best: int) -> Iterator[None]:
        """Put the way together; in a tube as few places as its straight ways allow."""
        parts = [] if nodes[best].back is None else [nodes[best].back]
        while best > 0:
            parts.append(nodes[best].edge)
            best = nodes[best].parent
        way = np.vstack(parts[::-1])
        if self._tube is None:
            self.way = way
        else:
            yield from self._merge(np.vstack([nodes[0].q, way]))

    def _merge(self, way: FloatArray) -> Iterator[None]:
        """Leave out places of a way in the tube between which there is a straight one."""
        kept, at = [self._view.command.q], -1
        while at < len(way) - 1:
            far = at + 1
            for k in range(min(at + MERGED, len(way) - 1), at + 1, -1):
                if (yield from passing(self._passable, kept[-1], way[k], self._most)):
                    far = k
                    break
                yield
            if far == at + 1 and not self._passes(kept[-1], way[far]):
                return
            kept.append(way[far])
            at = far
        self.way = np.array(kept)  # the arm comes to rest where it is, so that the ways are straight
