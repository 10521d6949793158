"""What a planner keeps its arm away from: itself, and a scene."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, final

import numpy as np

from ftqp.control.planner.stages import Stage
from ftqp.control.scene.keeping_clear import Clearance
from ftqp.control.scene.placed_shapes import CLOUD, Scene
from ftqp.control.scene.solid_shapes import KINDS, HalfSpace, Hull, Sphere, fitting
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError, nearest
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.rows import CLEARANCES
from ftqp.kernel.layout.scene_room import (
    BALLS,
    CAPSULES,
    CLOUD_BODIES,
    NEAREST,
    PAIRS,
    SEGMENT,
)
from ftqp.model.body_frames import mount_of
from ftqp.model.capsules import Capsule, named_apart
from ftqp.model.followers import coupled_places
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


def clearance_rows(asked: bool) -> tuple[str, ...]:
    """Names of the rows that keep bodies apart, of a planner that asks for them."""
    return tuple(f"pair {k + 1}" for k in range(CLEARANCES)) if asked else ()


def refuse_moving_base(leader: str, surroundings: "Surroundings | None") -> None:
    """Refuse an inertial task beside a scene.

    Args:
        leader: Who leads the planner.
        surroundings: What it keeps clear of; None is nothing.

    Raises:
        InputError: They do not go together.
    """
    if leader == "base" and surroundings is not None:
        raise InputError(
            "a scene stands where the base does, and an inertial task has a base that moves; make a "
            "planner without scene and clearance, or put the arm on its base, robot.on_planar_base(...)"
        )


@final
class Surroundings:
    """The part of a planner that knows where bodies are, and what is called what.

    Args:
        session: The planner's, whose record is written.
        robot: The arm.
        scene: What stands around it; None is nothing, so that the arm keeps from itself only.
        clearance: How far it keeps.

    Raises:
        InputError: Too many bodies, an unknown name in ``ignore``, or an arm whose bodies touch each other
            where it begins.
    """

    def __init__(self, session: Session, robot: Robot, scene: Scene | None, clearance: Clearance) -> None:
        self.scene, self.clearance = Scene() if scene is None else scene, clearance
        self._session, self._robot, self._room = session, robot, session.K.scene
        self._attached: dict[str, tuple[Capsule, ...]] = {}
        self._cloud: FloatArray | None = None
        self.left_out: tuple[tuple[str, str], ...] = ()
        self.names: tuple[tuple[str, str], ...] = ()
        room = self._room
        room.keep, room.halt = clearance.keep, clearance.stop
        room.gain, room.share = clearance.gain, clearance.share
        self._lay()
        self.scene.watch(self.told)

    @property
    def stage(self) -> Stage:
        """What it does in a planner's life."""
        return Stage(mount=self._mount)

    @property
    def attached(self) -> dict[str, tuple[Capsule, ...]]:
        """Bodies that are attached to the arm, by what they are called together."""
        return dict(self._attached)

    def told(self, name: str) -> None:
        """Take over what has changed in the scene.

        Args:
            name: What has moved; nothing where others are there now.
        """
        if name == CLOUD and self._cloud is not None:
            self._write_cloud(self._cloud)
            return
        if name in ("", CLOUD):
            self._lay()
            return
        at = list(self.scene).index(name)
        placed, room = self.scene[name], self._room
        room.place[at], room.turn[at] = placed.place[:3, 3], placed.place[:3, :3].ravel()
        room.twist[at] = placed.twist
        self._look_again()

    def attach(self, name: str, shapes: Any) -> None:
        """Count on more bodies that move with the arm.

        Args:
            name: What they are called together.
            shapes: Capsules, those without a frame in that of the robot's own tip.

        Raises:
            InputError: These are no capsules, the name is taken, or they touch the arm; nothing changes then.
        """
        if not (isinstance(name, str) and name):
            raise InputError(f"name is {name!r:.60}, expected a word such as 'tray'")
        given = [shapes] if isinstance(shapes, Capsule) else shapes
        if not isinstance(given, Sequence) or not given or not all(isinstance(one, Capsule) for one in given):
            raise InputError(f"{name} is {shapes!r:.60}, expected a list of ftqp.Capsule(a, b, radius)")
        if name in {one.label for one in self._whole()} | {*self.scene, *self._attached}:
            raise InputError(f"there is a {name!r} already; detach it, or give this another name")
        tip = self._robot.tip
        own = named_apart([replace(one, frame=one.frame or tip, name=name) for one in given])
        self._attached[name] = own
        try:
            self._lay()
        except InputError:
            del self._attached[name]
            self._lay()
            raise

    def detach(self, name: str) -> None:
        """Forget bodies that were attached.

        Args:
            name: What they are called.

        Raises:
            InputError: Nothing of that name is attached.
        """
        if name not in self._attached:
            known = ", ".join(self._attached) or "nothing"
            raise InputError(
                f"there is no {name!r:.60} attached{nearest(str(name), self._attached)}; there is {known}"
            )
        del self._attached[name]
        self._lay()

    def _whole(self) -> list[Capsule]:
        """The bodies of the arm, and those that are attached to it."""
        return [*self._robot.capsules, *(one for own in self._attached.values() for one in own)]

    def _mount(self, robot: Robot) -> None:
        self._robot = robot

    def _forget(self) -> None:
        """After a reset no row is held, and every pair is looked at anew."""
        room = self._room
        room.slot[:], room.nearest, room.held = -1, -1, 0
        self._look_again()

    def _look_again(self) -> None:
        self._room.look[:], self._room.gap[:] = 0, -np.inf

    def _lay(self) -> None:
        """Write capsules, obstacles and pairs anew."""
        capsules = self._bodies()
        if len(capsules) > CAPSULES:
            raise InputError(
                f"{self._robot.name} has {len(capsules)} capsules, their ends counted, "
                f"expected at most {CAPSULES}; make it of fewer, robot.with_capsules([...])"
            )
        both = {capsule.label for capsule in capsules} & {*self.scene}
        if both:
            raise InputError(
                f"two things are called {min(both)!r}, a body of {self._robot.name} and something in the "
                "scene; give that another name"
            )
        room = self._room
        self._forget()
        room.capsules, room.obstacles, room.pairs = len(capsules), len(self.scene), 0
        room.cloud, self._cloud = 0, None
        for at, capsule in enumerate(capsules):
            room.body[at], T = mount_of(self._robot, capsule.frame or "universe")
            room.end_a[at], room.end_b[at] = (T[:3, :3] @ end + T[:3, 3] for end in (capsule.a, capsule.b))
            room.wide[at] = capsule.radius
        for at, placed in enumerate(self.scene.values()):
            room.solid[at], room.extent[at] = KINDS[type(placed.shape)], placed.shape.extent
            room.place[at], room.turn[at] = placed.place[:3, 3], placed.place[:3, :3].ravel()
            room.twist[at] = placed.twist
        self._lay_hulls()
        self._measure_ways(capsules)
        own = self._own_pairs(capsules)
        pairs = own + self._other_pairs(capsules)
        labels = [capsule.label for capsule in capsules]
        ignored = self._ignored(labels)
        named = [(labels[c], labels[o] if o >= 0 else list(self.scene)[-1 - o]) for c, o in pairs]
        kept = [k for k, names in enumerate(named) if frozenset(names) not in ignored]
        if len(kept) > PAIRS:
            raise InputError(
                f"{len(kept)} pairs of bodies would be watched, expected at most {PAIRS}; leave some out, "
                "ftqp.Clearance(ignore=[...]), or put several shapes into one box"
            )
        self._write(pairs, named, kept)
        if len(self.scene.balls):
            self._lay_cloud(labels, self._that_move(capsules), ignored)

    def _lay_hulls(self) -> None:
        """Write corners, edges and faces of the hulls, which are simpler ones where there are many."""
        shapes = {at: one.shape for at, one in enumerate(self.scene.values()) if isinstance(one.shape, Hull)}
        hulls = fitting([one.parts for one in shapes.values()]) if shapes else []
        room, counts = self._room, [0, 0, 0]
        for at, parts in zip(shapes, hulls, strict=True):
            ends = [count + len(part) for count, part in zip(counts, parts, strict=True)]
            corner, edge, face = counts
            room.corner[corner : ends[0]] = parts.corners
            room.edge[edge : ends[1]], room.edges_of[at] = parts.edges + corner, (edge, ends[1])
            room.face[face : ends[2]], room.faces_of[at] = parts.faces, (face, ends[2])
            counts = ends

    def _bodies(self) -> list[Capsule]:
        """The capsules, and behind them the two ends of each, where there is more than balls.

        A capsule that lies along a face or a rod is as near to it everywhere, and which of its points is the
        nearest jumps from end to end: a row for each end keeps the arm from swinging between them.
        """
        capsules = self._whole()
        round_only = all(isinstance(placed.shape, Sphere) for placed in self.scene.values())
        self._ends: list[tuple[int, ...]] = []
        for one in tuple(capsules):
            ends = () if round_only or np.array_equal(one.a, one.b) else (one.a, one.b)
            self._ends.append(tuple(range(len(capsules), len(capsules) + len(ends))))
            capsules += [Capsule(end, end, one.radius, frame=one.frame, name=one.label) for end in ends]
        return capsules

    def _own_pairs(self, capsules: Sequence[Capsule]) -> list[tuple[int, int]]:
        """Pairs of the arm's own bodies that can and need be kept apart."""
        if not self.clearance.self_pairs:
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
        near = np.mean(distances[1:] < self.clearance.keep, axis=0) > MOSTLY
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
        for at, placed in enumerate(self.scene.values()):
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
            for c in range(len(capsules))
        ]
        spans = np.linalg.norm(chain.translation, axis=1)
        farthest = np.maximum(np.abs(limits.q_min), np.abs(limits.q_max))
        slides = np.where(np.isfinite(farthest), farthest, SLIDES)
        spans = spans + np.where(chain.prismatic, slides, 0.0)
        for j in range(self._robot.nv):
            way = float(spans[j + 1 :].sum()) + max(extents, default=0.0)
            room.joint_way[j] = 1.0 if chain.prismatic[j] else way

    def _ignored(self, labels: Sequence[str]) -> set[frozenset[str]]:
        known = [*dict.fromkeys(labels), *self.scene, CLOUD]
        for pair in self.clearance.ignore:
            for name in pair:
                if name not in known:
                    raise InputError(
                        f"ignore has {name!r}{nearest(name, known)}, expected names of capsules or of what "
                        f"stands in the scene: {', '.join(known)}"
                    )
        return {frozenset(pair) for pair in self.clearance.ignore}

    def _write(
        self, pairs: Sequence[tuple[int, int]], named: Sequence[tuple[str, str]], kept: Sequence[int]
    ) -> None:
        room = self._room
        for at, k in enumerate(kept):
            room.first[at], room.second[at] = pairs[k]
        self.names = tuple(named[k] for k in kept)
        room.pairs = len(kept)

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
        room.pairs = at
        self._cloud = np.zeros((BALLS, 4))
        self._write_cloud(self._cloud)

    def _write_cloud(self, memory: FloatArray) -> None:
        """Where the balls are now; they are chosen in the next tick."""
        room, balls = self._room, self.scene.balls
        memory[: len(balls)] = balls
        room.cloud_at, room.cloud = memory.ctypes.data, len(balls)
        room.ball[:], room.chosen_tick = -1, NEVER
        if not len(balls):
            first = int(room.cloud_pair)
            room.place[-1 - room.second[first : room.pairs]] = FAR_AWAY
        self._look_again()

    def distances(self, q: FloatArray) -> dict[tuple[str, str], FloatArray]:
        """The distance of every pair at some postures, (S,) [m] each, by their names.

        Args:
            q: Joint positions, (S, nv) [rad or m].
        """
        least: dict[tuple[str, str], FloatArray] = {}
        for names, d in zip(self.names, self._session.pair_distances(q).T, strict=True):
            least[names] = np.minimum(least[names], d) if names in least else d
        return least
