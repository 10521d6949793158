"""The session of a search for ways: a planner's arm and scene as they are now, and its memory."""

from typing import Any, Final, NamedTuple, final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.kernel.entry.session import Call, Session, bound, rooms
from ftqp.kernel.layout.enums import HEALTHY
from ftqp.kernel.layout.record import in_line, memory
from ftqp.kernel.layout.scene_room import HALF_SPACE, PAIRS
from ftqp.kernel.layout.ways_room import POSES, WayStage

ROOMS: Final = ("chain", "scene", "keeps")
"""What is copied of a planner's record."""
SURELY: Final = 0.9
"""Motors that hold an arm in any posture with this share of their limits are strong enough. A convention."""
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
        self._session, self._whole = session, whole
        self.memory = memory("ways")
        self._begin()
        self.adopt()

    def _begin(self) -> None:
        self.K: Any = rooms(self.memory)
        self.W: Any = self.K.ways
        self._table, self._raw = np.zeros((0, 1)), np.zeros((0, 1))

    def adopt(self) -> None:
        """Take over arm, scene and limits as the planner has them now."""
        K, W, session = self.K, self.W, self._session
        for room in ROOMS:
            self.memory[room] = session.memory[room]
        self.n = n = int(K.chain.n)
        believed = session.K
        for name in ("q_min", "q_max", "v_max", "tau_max"):
            getattr(W, name)[:n] = getattr(believed.limits, name)[:n]
        W.a_max[:n] = believed.limits.a_brake[:n]
        works = np.array(believed.faults.code[:n] == HEALTHY)
        W.free[:n] = works & (K.chain.lead[:n] == np.arange(n))
        W.tau_max[:n][~works] = np.inf
        W.weighs = int(bool(K.chain.has_inertia) and self._may_be_too_heavy())
        W.keep = W.share = 1.0
        W.keep = K.scene.keep if K.scene.pairs else 1e-2
        self._choose_pairs()

    def _may_be_too_heavy(self) -> bool:
        """Whether any posture may ask more of a motor than it has; joints that slide may."""
        chain, n = self.K.chain, self.n
        slides, parent = np.array(chain.prismatic[:n]), chain.parent[:n].tolist()
        lead, mass = chain.lead[:n].tolist(), chain.mass[:n].tolist()
        limits = self.W
        ends = np.maximum(np.abs(limits.q_min[:n]), np.abs(limits.q_max[:n]))
        spans = (chain.span[:n] + np.where(slides, ends, 0.0)).tolist()
        levers, ratios, most = chain.lever[:n].tolist(), np.abs(chain.ratio[:n]).tolist(), [0.0] * n
        for k in range(n):
            far, j = levers[k], k
            while j >= 0:
                ratio = 1.0 if lead[j] == j else ratios[j]
                most[lead[j]] += ratio * mass[k] * (1.0 if slides[j] else far)
                far += spans[j]
                j = parent[j]
        return bool((np.array(most) * np.linalg.norm(chain.gravity) > SURELY * limits.tau_max[:n]).any())

    def _choose_pairs(self) -> None:
        """Pairs of whole bodies, and of the ends of those that half-spaces are apart from."""
        scene, W = self.K.scene, self.W
        count = int(scene.cloud_pair if scene.cloud else scene.pairs)
        first, second = np.array(scene.first[:count]), np.array(scene.second[:count])
        flat = (second < 0) & (scene.solid[-1 - np.minimum(second, -1)] == HALF_SPACE)
        chosen = np.flatnonzero((first < self._whole) | flat)
        W.pairs, W.pair[: len(chosen)] = len(chosen), chosen
        W.is_body[:], W.sees_balls[:] = 0, 0
        W.is_body[first[chosen]] = 1
        W.is_body[second[chosen][second[chosen] >= 0]] = 1
        if scene.cloud:
            seen = np.array(scene.first[count : int(scene.pairs)])
            W.is_body[seen] = W.sees_balls[seen] = 1
        found = np.flatnonzero(W.is_body)
        W.bodies = int(found[-1]) + 1 if len(found) else 0

    def begin(self, start: FloatArray) -> Met | None:
        """Begin at a posture, (nv,); what stands in its way."""
        gaps = self._session.pair_distances(start[None])[0] if self.W.pairs else np.zeros(0)
        return self._said(self._bind("begin_ways", np.ascontiguousarray(start), gaps, len(gaps))())

    def add(self, q: FloatArray) -> Met | None:
        """Add a goal posture, (nv,); what stands in its way, and then it is none."""
        return self._said(self._bind("add_goal", np.ascontiguousarray(q))())

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
