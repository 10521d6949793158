"""The session of a search for ways: a planner's arm and scene as they are now, and its memory."""

from typing import Any, Final, NamedTuple

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.kernel.entry.session import Call, Session, bound, rooms, write_together
from ftqp.kernel.layout.record import in_line, memory
from ftqp.kernel.layout.scene_room import PAIRS
from ftqp.kernel.layout.ways_room import POSES, WayStage

ROOMS: Final = ("chain", "scene", "keeps")
"""What is copied of a planner's record."""
LIMIT, EFFORT, KEEP, BALL = "limit", "effort", "keep", "ball"
"""What may stand in the way of a posture beside two bodies."""


class Met(NamedTuple):
    """What stands in the way of a posture."""

    kind: str  # LIMIT or EFFORT of a joint, KEEP, BALL of a body, or ``pair``
    number: int  # Of the joint, of what is kept, of the capsule or of the pair of the scene


class WaySession:
    """One search, whose same looks give the same way; its room is ``W``.

    It takes over arm, scene and limits as the planner of a session has them when it begins.
    """

    def __init__(self, session: Session) -> None:
        self.memory = memory("ways")
        self.K: Any = rooms(self.memory)
        self.W: Any = self.K.ways
        self._session, self.n = session, int(session.K.chain.n)

    @property
    def rooms(self) -> list[tuple[Any, Any]]:
        """What is copied, and from where, before it begins."""
        return [(self.memory[room], self._session.memory[room]) for room in ROOMS]

    def begin(self, start: FloatArray, seed: int) -> None:
        """Begin at a posture, (nv,), with what is asked; the same seed draws the same starts."""
        write_together(self.rooms)
        self._bind("begin_asked", self._session.memory, np.ascontiguousarray(start))(seed)

    def aim(self, goal: FloatArray) -> None:
        """Let the goal be a pose of the tip, (4, 4), and starts for its postures begin anew."""
        self._bind("aim_at", np.ascontiguousarray(goal))()

    def add_goal(self, q: FloatArray) -> None:
        """Add a goal posture, (nv,)."""
        self._bind("add_goal", np.ascontiguousarray(q))()

    @property
    def met(self) -> Met | None:
        """What stands in the way of the goal posture that was added last, or before any of the start."""
        return self._said(int(self.W.goal_met))

    @property
    def start_met(self) -> Met | None:
        """What stands in the way of the start."""
        return self._said(int(self.W.start_met))

    @property
    def hindrance(self) -> Met | None:
        """What stood in the way of postures of the goal most often, where none is clear."""
        return self._said(int(self.W.hindered.argmax()))

    def go_along(self, places: FloatArray) -> None:
        """Let the way lead from the start through places, (k, nv)."""
        W = self.W
        W.place[1 : len(places) + 1, : self.n] = places
        W.place[0], W.places, W.stage = W.start, len(places) + 1, WayStage.ROUNDING
        W.corner, W.pieces, W.before = 0, 0, 0.0

    @property
    def stage(self) -> WayStage:
        """How far it is."""
        return WayStage(int(self.W.stage))

    @property
    def is_searching(self) -> bool:
        """Whether there is more to think of."""
        return self.stage not in (WayStage.READY, WayStage.NO_WAY)

    def find(self, looks: int) -> FloatArray | None:
        """A further clear posture of the goal, (nv,), within about so many looks; None: not found yet."""
        return self.W.drawn[: self.n].copy() if self._bind("find_posture")(looks) else None

    def explore(self, looks: int) -> int | None:
        """A further place that can be come to, by number, within about so many looks; None: not yet."""
        node = int(self._bind("explore")(looks))
        return None if node < 0 else node

    def place(self, node: int) -> FloatArray:
        """A place that was explored, (nv,) [rad or m]."""
        return np.array(self.W.node[0, node * self.n : (node + 1) * self.n])

    def lead_to(self, node: int) -> None:
        """Let there be a way to a place that was explored."""
        self._bind("lead_to")(node)

    def begin_following(self, q: FloatArray, first: int) -> None:
        """Let the path be followed from a posture at one of its poses."""
        self.W.followed, self.W.follows[: len(q)] = first, q

    def follow(self, looks: int) -> bool:
        """Follow it on for about so many looks; whether it ends, as joints cannot go on or at its end."""
        return bool(self._bind("follow_path")(looks))

    @property
    def at(self) -> FloatArray:
        """Where the joints are there, (nv,) [rad or m]."""
        return np.array(self.W.follows[: self.n])

    @property
    def followed(self) -> int:
        """The pose of the path that was come to."""
        return int(self.W.followed)

    def search_step(self, looks: int) -> WayStage:
        """One slice of about so many looks at postures; what is done then."""
        if self.is_searching:
            self._bind("search_step")(looks)
        return self.stage

    @property
    def motion(self) -> FloatArray:
        """The places after every period from rest to rest, (ticks, nv) [rad or m]; READY only."""
        ticks, n = int(self.W.ticks), self.n
        return np.array(self.W.table[: ticks * n]).reshape(ticks, n)

    def hold_tube(self, poses: FloatArray, radius: tuple[float, float]) -> None:
        """Let the tip stay near poses, (k, 4, 4), by so much in place and in turning [m]."""
        W = self.W
        every = poses[np.linspace(0, len(poses) - 1, min(len(poses), POSES)).astype(int)]
        W.tube, W.given_tube[: len(every)] = len(every), every[:, :3].reshape(-1, 12)
        W.radius[:] = radius

    def hold_path(self, poses: FloatArray, leap: FloatArray) -> None:
        """A path, (k, 4, 4), from whose one pose to the next joints go so far at most, (nv,)."""
        W = self.W
        W.path, W.path_pose[: len(poses)] = len(poses), poses[:, :3].reshape(-1, 12)
        W.leap[: self.n] = leap

    def _bind(self, name: str, *things: Any) -> Call:
        return bound(name, self.memory, *things)

    @staticmethod
    def _said(code: int) -> Met | None:
        """What the kernel's number stands for, see ``ftqp.kernel.search.looks``."""
        if code == 0:
            return None
        kinds = ("pair", LIMIT, EFFORT, KEEP, BALL)
        return Met(kinds[(code - 1) // PAIRS], (code - 1) % PAIRS)

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "memory": self.memory, "K": None, "W": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self.memory = in_line(state["memory"])
        self.K = rooms(self.memory)
        self.W = self.K.ways
