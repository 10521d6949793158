"""The session of a search for ways: a planner's arm and scene as they are now, and its memory."""

from typing import Any, Final, NamedTuple, final

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


@final
class WaySession:
    """One search, whose same looks give the same way; its room is ``W``.

    ``whole`` of the capsules of the planner's scene are bodies, and not ends of them.
    """

    def __init__(self, session: Session, whole: int) -> None:
        self.memory = memory("ways")
        self._begin()
        self._adopt(session, whole)

    def _begin(self) -> None:
        self.K: Any = rooms(self.memory)
        self.W: Any = self.K.ways
        self._table, self._raw = np.zeros((0, 1)), np.zeros((0, 1))

    def _adopt(self, session: Session, whole: int) -> None:
        """Take over arm, scene and limits as the planner has them now."""
        write_together([(self.memory[room], session.memory[room]) for room in ROOMS])
        self._bind("know_arm", session.memory)(whole)
        self.n = int(self.K.chain.n)

    def draw_about(self, q: FloatArray, seed: int) -> None:
        """Draw starts about a posture, (nv,)."""
        self._bind("draw_about", np.ascontiguousarray(q))(seed)

    def choose_rows(self, bits: int, tool: bool) -> None:
        """Let these rows of poses count, and of the turn that of the tool axis alone, if that is said."""
        self._bind("choose_rows")(bits, int(tool))

    def aim(self, goal: FloatArray) -> None:
        """Let the goal be a pose of the tip, (4, 4), and starts for its postures begin anew."""
        self._bind("aim_at", np.ascontiguousarray(goal))()

    def begin(self, start: FloatArray) -> Met | None:
        """Begin at a posture, (nv,); what stands in its way."""
        return self._said(self._bind("begin_ways", np.ascontiguousarray(start))())

    def add(self, q: FloatArray) -> Met | None:
        """Add a goal posture, (nv,); what stands in its way, and then it is none."""
        return self._said(self._bind("add_goal", np.ascontiguousarray(q))())

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

    def find(self, looks: int) -> FloatArray | None:
        """Look for a clear posture of the goal, (nv,), for about so many looks; None: not found yet."""
        return self.W.drawn[: self.n].copy() if self._bind("find_posture")(looks) else None

    def explore(self, looks: int) -> int:
        """Grow the tree of the start alone for about so many looks: its next node; -1: none yet."""
        return int(self._bind("explore")(looks))

    def node(self, k: int) -> FloatArray:
        """A node of that tree, (nv,)."""
        return np.array(self.W.node[0, k * self.n : (k + 1) * self.n])

    def lead_to(self, node: int) -> WayStage:
        """Let the way be that to a node of that tree."""
        return WayStage(self._bind("lead_to")(node))

    def follow(self, looks: int) -> bool:
        """Follow the path on for about so many looks; whether it ends."""
        return bool(self._bind("follow_path")(looks))

    def search_step(self, looks: int) -> WayStage:
        """Search for about so many looks."""
        table, raw = self._table, self._raw
        stage = WayStage(self._bind("search_step", looks, table, raw, len(table))())
        if stage is WayStage.SAMPLING:
            self._table, self._raw = (np.zeros((int(self.W.ticks), self.n)) for _ in range(2))
        return stage

    def prove_again(self, table: FloatArray, first: int) -> None:
        """Prove what is left of a motion, from a tick on, in the scene as the planner has it now."""
        self._table, self._raw = table, np.zeros_like(table)
        W = self.W
        W.stage, W.window, W.ticks, W.checked, W.chunk = WayStage.PROVING, 1, len(table), first, 1

    @property
    def table(self) -> FloatArray:
        """The places of every tick of the motion, (ticks, nv)."""
        return self._table[: int(self.W.ticks)]

    def hold_tube(self, poses: FloatArray, radius: tuple[float, float]) -> None:
        """Let the tip stay near poses, (k, 4, 4), by so much in place and in turning [m]."""
        W = self.W
        every = poses[np.linspace(0, len(poses) - 1, min(len(poses), POSES)).astype(int)]
        W.tube, W.tube_pose[: len(every)] = len(every), every[:, :3].reshape(-1, 12)
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
