"""How the room of a record is laid out for a scene: which body is watched against what."""

from collections.abc import Mapping, Sequence
from typing import final

import numpy as np

from ftqp.control.scene.placed_shapes import CLOUD, Clearance, Content, Placed
from ftqp.control.scene.solid_shapes import KINDS, HalfSpace, Hull, Sphere, fitting, simpler
from ftqp.core.errors import InputError, nearest
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.scene_room import (
    BLOCK,
    BODY_CORNERS,
    CAPSULES,
    CLOUD_BODIES,
    NEAREST,
    PAIRS,
    SEGMENT,
)
from ftqp.model.capsules import Capsule
from ftqp.model.followers import coupled_places
from ftqp.model.frames import mount_of
from ftqp.model.robot import Robot
from ftqp.model.shape import random_postures

SAMPLES = 1000
"""Random postures at which an arm's own pairs are looked at: one in a hundred is met by ten of them."""
MOSTLY = 0.5
"""Own bodies that are too near in more than this share of them are built so. A guess: those of the catalog
are so in 0.75 of them or more, or in less than 0.49."""
SEED = 20170511
FIXED = 1e-9
"""Ends of a capsule that move less than this over all those postures do not move [m]. Rounding."""
FAR_AWAY = 1e6
"""A ball that is not there is so far away [m]. A convention."""
NEVER = -(1 << 40)
"""A tick so long ago that balls are chosen anew."""
SLIDES = 2.0
"""How far a joint without limits slides [m]. A convention."""


@final
class Layout:
    """Capsules, obstacles and pairs of a scene, written into a copy of a planner's record; see ``Laid``."""

    def __init__(
        self, draft: Session, robot: Robot, clearance: Clearance, content: Content,
        attached: Mapping[str, Sequence[Capsule]],
    ) -> None:  # fmt: skip
        self._session, self._robot, self._room = draft, robot, draft.K.scene
        self._clearance, self._content = clearance, content
        self._whole = [*robot.capsules, *(one for own in attached.values() for one in own)]
        self._ends: list[tuple[int, ...]] = []
        self.names: tuple[tuple[str, str], ...] = ()
        self.left_out: tuple[tuple[str, str], ...] = ()
        self.has_cloud = False

    def lay(self, before: Mapping[str, Placed]) -> None:
        """Write capsules, obstacles and pairs anew; what moves on by itself stays where it is by now."""
        capsules, things = self._bodies(), self._content.placed
        if len(capsules) > CAPSULES:
            raise InputError(
                f"{self._robot.name} has {len(capsules)} capsules, their ends counted, "
                f"expected at most {CAPSULES}; make it of fewer, robot.with_capsules([...])"
            )
        both = {capsule.label for capsule in capsules} & {*things}
        if both:
            raise InputError(
                f"two things are called {min(both)!r}, a body of {self._robot.name} and something in the "
                "scene; give that another name"
            )
        room = self._room
        room.slot[:], room.nearest, room.held = -1, -1, 0
        room.look[:], room.gap[:] = 0, -np.inf
        room.capsules, room.pairs, room.cloud = len(capsules), 0, 0
        room.whole = len(self._whole)
        for at, capsule in enumerate(capsules):
            room.body[at], T = mount_of(self._robot, capsule.frame or "universe")
            room.end_a[at], room.end_b[at] = (T[:3, :3] @ end + T[:3, 3] for end in (capsule.a, capsule.b))
            room.wide[at] = capsule.radius
        self._lay_bodies(capsules)
        self._place(before)
        self._lay_hulls()
        self._measure_ways(capsules)
        own = self._own_pairs(capsules)
        pairs = own + self._other_pairs(capsules)
        labels = [capsule.label for capsule in capsules]
        ignored = self._ignored(labels)
        named = [(labels[c], labels[o] if o >= 0 else list(things)[-1 - o]) for c, o in pairs]
        kept = [k for k, names in enumerate(named) if frozenset(names) not in ignored]
        if len(kept) > PAIRS:
            raise InputError(
                f"{len(kept)} pairs of bodies would be watched, expected at most {PAIRS}; leave some out, "
                "ftqp.Clearance(ignore=[...]), or put several shapes into one box"
            )
        for at, k in enumerate(kept):
            room.first[at], room.second[at] = pairs[k]
        self.names, room.pairs = tuple(named[k] for k in kept), len(kept)
        if len(self._content.balls):
            self._lay_cloud(labels, self._that_move(capsules), ignored)
        room.things = self._content.things
        if room.things and not self.has_cloud and all(pairs[k][1] >= 0 for k in kept):
            raise InputError(
                f"no body of {self._robot.name} would be watched against what stands in the scene; give the "
                "arm bodies, robot.with_capsules([...]), take names out of Clearance(ignore=...), or leave "
                "the scene out"
            )

    def _place(self, before: Mapping[str, Placed]) -> None:
        """Write the obstacles."""
        room, things = self._room, self._content.placed
        then = {name: (room.place[at].copy(), room.turn[at].copy()) for at, name in enumerate(before)}
        room.obstacles = len(things)
        for at, (name, placed) in enumerate(things.items()):
            room.solid[at], room.extent[at] = KINDS[type(placed.shape)], placed.shape.extent
            goes_on = before.get(name) is placed
            place, turn = then[name] if goes_on else (placed.place[:3, 3], placed.place[:3, :3].ravel())
            room.place[at], room.turn[at], room.twist[at] = place, turn, placed.twist

    def _lay_hulls(self) -> None:
        """Write corners, edges and faces of the hulls, which are simpler ones where there are many."""
        shapes = {
            at: one.shape
            for at, one in enumerate(self._content.placed.values())
            if isinstance(one.shape, Hull)
        }
        hulls = fitting([one.parts for one in shapes.values()]) if shapes else []
        room, counts = self._room, [0, 0, 0]
        for at, parts in zip(shapes, hulls, strict=True):
            ends = [count + len(part) for count, part in zip(counts, parts, strict=True)]
            corner, edge, face = counts
            room.corner[corner : ends[0]] = parts.corners
            room.corners_of[at] = corner, ends[0]
            room.edge[edge : ends[1]], room.edges_of[at] = parts.edges + corner, (edge, ends[1])
            room.face[face : ends[2]], room.faces_of[at] = parts.faces, (face, ends[2])
            counts = ends

    def _lay_bodies(self, capsules: Sequence[Capsule]) -> None:
        """Write the corners of bodies in capsules, of simpler ones around them where there are many."""
        room = self._room
        known = {at: one.corners for at, one in enumerate(capsules) if one.corners is not None}
        end, room.hull_of[:] = 0, 0
        if sum(-(-len(corners) // BLOCK) for corners in known.values()) * BLOCK > BODY_CORNERS:
            most = BODY_CORNERS // BLOCK // len(known) * BLOCK
            known = {at: simpler(corners, most) for at, corners in known.items()}
        for at, corners in known.items():
            T = mount_of(self._robot, capsules[at].frame or "universe")[1]
            blocks = np.pad(corners, ((0, -len(corners) % BLOCK), (0, 0)), mode="edge")
            room.hull_of[at] = end, end + len(blocks)
            room.hull_corner[:, end : end + len(blocks)] = T[:3, :3] @ blocks.T + T[:3, 3:]
            end += len(blocks)

    def _bodies(self) -> list[Capsule]:
        """The capsules, and behind them the two ends of each, where there is more than balls.

        A capsule that lies along a face or a rod is as near to it everywhere, and which of its points is the
        nearest jumps from end to end: a row for each end keeps the arm from swinging between them.
        """
        capsules = list(self._whole)
        round_only = all(isinstance(placed.shape, Sphere) for placed in self._content.placed.values())
        for one in tuple(capsules):
            known = one.corners is not None  # and then its corners are what is nearest
            ends = () if round_only or known or np.array_equal(one.a, one.b) else (one.a, one.b)
            self._ends.append(tuple(range(len(capsules), len(capsules) + len(ends))))
            capsules += [Capsule(end, end, one.radius, frame=one.frame, name=one.label) for end in ends]
        return capsules

    def _own_pairs(self, capsules: Sequence[Capsule]) -> list[tuple[int, int]]:
        """Pairs of the arm's own bodies that can and need be kept apart."""
        if not self._clearance.self_pairs:
            return []
        robot, room, count = self._robot, self._room, len(self._ends)
        parent = robot.chain.parent
        pairs = [
            (c, o)
            for c in range(count)
            for o in range(count)
            if int(room.body[o]) < int(room.body[c]) and parent[int(room.body[c])] != int(room.body[o])
        ]
        if not pairs:
            return []
        pairs = pairs[:PAIRS]
        for at, (c, o) in enumerate(pairs):
            room.first[at], room.second[at] = c, o
        room.pairs = len(pairs)
        drawn = random_postures(robot.limits, robot.chain.prismatic, SAMPLES, np.random.default_rng(SEED))
        drawn = coupled_places(robot.chain, drawn)
        postures = np.vstack([robot.neutral, drawn])
        distances = self._session.pair_distances(postures)
        near = np.mean(distances[1:] < self._clearance.keep, axis=0) > MOSTLY
        labels = [capsule.label for capsule in capsules]
        ignored = self._ignored(labels)
        self.left_out = tuple((labels[c], labels[o]) for (c, o), out in zip(pairs, near, strict=True) if out)
        for (c, o), out, d in zip(pairs, near, distances[0], strict=True):
            if not out and d < 0.0 and frozenset((labels[c], labels[o])) not in ignored:
                raise InputError(
                    f"{labels[c]} and {labels[o]} of {robot.name} touch at its neutral posture, by "
                    f"{-1e3 * d:.0f} mm; make their capsules smaller, robot.with_capsules([...]), or leave "
                    f"the pair out, ftqp.Clearance(ignore=[({labels[c]!r}, {labels[o]!r})])"
                )
        return [pair for pair, out in zip(pairs, near, strict=True) if not out]

    def _other_pairs(self, capsules: Sequence[Capsule]) -> list[tuple[int, int]]:
        """Pairs of a body that moves and something in the scene; see ``_bodies`` for ends."""
        moves, pairs = self._that_move(capsules), []
        for at, placed in enumerate(self._content.placed.values()):
            for c, ends in enumerate(self._ends):
                which = ends if isinstance(placed.shape, HalfSpace) and ends else (c, *ends)
                which = which if not isinstance(placed.shape, Sphere) else (c,)
                pairs += [(body, -1 - at) for body in which if moves[body]]
        return pairs

    def _that_move(self, capsules: Sequence[Capsule]) -> list[bool]:
        """Whether any posture moves a capsule: one that turns about its own axis stays where it is."""
        robot = self._robot
        drawn = random_postures(robot.limits, robot.chain.prismatic, 3, np.random.default_rng(SEED))
        ends = []
        for q in drawn:
            poses = {one.frame: robot.pose(q, one.frame) for one in capsules}
            ends.append([[poses[one.frame] @ [*end, 1.0] for end in (one.a, one.b)] for one in capsules])
        spread = np.ptp(np.array(ends), axis=0).max(axis=(1, 2))
        return [bool(far > FIXED) for far in spread]

    def _measure_ways(self, capsules: Sequence[Capsule]) -> None:
        """How far any body goes at most by a unit of each joint."""
        chain, limits, room = self._robot.chain, self._robot.limits, self._room
        extents = [
            max(float(np.linalg.norm(end)) for end in (room.end_a[c], room.end_b[c]))
            + (0.0 if one.corners is None else one.radius)
            for c, one in enumerate(capsules)
        ]
        spans = np.linalg.norm(chain.translation, axis=1)
        farthest = np.maximum(np.abs(limits.q_min), np.abs(limits.q_max))
        slides = np.where(np.isfinite(farthest), farthest, SLIDES)
        spans = spans + np.where(chain.prismatic, slides, 0.0)
        for j in range(self._robot.nv):
            way = float(spans[j + 1 :].sum()) + max(extents, default=0.0)
            room.joint_way[j] = 1.0 if chain.prismatic[j] else way

    def _ignored(self, labels: Sequence[str]) -> set[frozenset[str]]:
        known = [*dict.fromkeys(labels), *self._content.placed, CLOUD]
        for pair in self._clearance.ignore:
            for name in pair:
                if name not in known:
                    raise InputError(
                        f"ignore has {name!r}{nearest(name, known)}, expected names of capsules or of what "
                        f"stands in the scene: {', '.join(known)}"
                    )
        return {frozenset(pair) for pair in self._clearance.ignore}

    def _lay_cloud(self, labels: Sequence[str], moves: Sequence[bool], ignored: set[frozenset[str]]) -> None:
        """Give each body that moves its pairs with the balls of a cloud, behind all others."""
        room, at = self._room, int(self._room.pairs)
        bodies = [
            c for c in range(len(self._ends)) if moves[c] and frozenset((labels[c], CLOUD)) not in ignored
        ]
        if len(bodies) > CLOUD_BODIES or at + NEAREST * len(bodies) > PAIRS:
            raise InputError(
                f"{len(bodies)} bodies of {self._robot.name} would keep clear of a cloud, expected at most "
                f"{CLOUD_BODIES}, and {PAIRS} pairs; make it of fewer, robot.with_capsules([...]), or leave "
                f"some out, ftqp.Clearance(ignore=[(name, {CLOUD!r}), ...])"
            )
        room.cloud_pair = at
        for c in bodies:
            for _ in range(NEAREST):
                o = int(room.obstacles)
                room.first[at], room.second[at] = c, -1 - o
                room.solid[o], room.turn[o], room.twist[o] = SEGMENT, np.eye(3).ravel(), 0.0
                room.ball[o], room.place[o], room.extent[o] = -1, FAR_AWAY, 0.0
                room.obstacles, at = o + 1, at + 1
        self.names += tuple((labels[c], CLOUD) for c in bodies for _ in range(NEAREST))
        room.pairs, self.has_cloud = at, bool(bodies)
        room.chosen_tick, room.cloud = NEVER, len(self._content.balls)
