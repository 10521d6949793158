"""What a planner keeps its arm away from: itself, and a scene."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple, final

import numpy as np

from ftqp.control.planner.scene_layout import FAR_AWAY, NEVER, Layout
from ftqp.control.planner.stages import Stage
from ftqp.control.scene.placed_shapes import CLOUD, Clearance, Content, Scene
from ftqp.core.checks import FloatArray, array
from ftqp.core.errors import InputError, nearest
from ftqp.kernel.entry.session import Session, write_together
from ftqp.kernel.layout.rows import CLEARANCES
from ftqp.model.capsules import Capsule, named_apart
from ftqp.model.robot import Robot


def clearance_rows(asked: bool) -> tuple[str, ...]:
    """Names of the rows that keep bodies apart, of a planner that asks for them."""
    return tuple(f"pair {k + 1}" for k in range(CLEARANCES)) if asked else ()


class Laid(NamedTuple):
    """What the room of a record was laid out for."""

    content: Content  # What stood in the scene
    # Bodies that are attached to the arm, by what they are called together
    attached: dict[str, tuple[Capsule, ...]]
    names: tuple[tuple[str, str], ...] = ()  # The bodies of each pair
    # Pairs of the arm's own bodies that are built too near to each other, by name
    left_out: tuple[tuple[str, str], ...] = ()
    has_cloud: bool = False  # Whether there are pairs with the balls of a cloud


Changes = list[tuple[Any, Any]]
"""Arrays that are written, and what into each."""


@final
class CollisionModel:
    """The part of a planner that knows where bodies are; each change is written by one compiled call."""

    def __init__(self, session: Session, robot: Robot, scene: Scene | None, clearance: Clearance) -> None:
        self.scene, self.clearance = Scene() if scene is None else scene, clearance
        self._session, self._robot, self._room = session, robot, session.K.scene
        self._laid: dict[int, Laid] = {}
        room = self._room
        room.keep, room.halt = clearance.keep, clearance.stop
        room.gain, room.share = clearance.gain, clearance.share
        self._version = self.scene.version  # the record looks at it
        room.version_at, room.version = self._version.ctypes.data, self._version[0]
        write_together(self._lay(self.scene.content, {}))
        self.scene.watch(self.changes_for)  # once it can answer

    @property
    def stage(self) -> Stage:
        """What it does in a planner's life."""
        return Stage(mount=self._mount)

    @property
    def _now(self) -> Laid:
        return self._laid[int(self._room.laid)]

    @property
    def names(self) -> tuple[tuple[str, str], ...]:
        """The bodies of each pair that is watched."""
        return self._now.names

    @property
    def left_out(self) -> tuple[tuple[str, str], ...]:
        """Pairs of the arm's own bodies that are built too near to each other to be kept apart."""
        return self._now.left_out

    def changes_for(self, content: Content, name: str, version: FloatArray) -> Changes:
        """What is to be written where the scene changes; nothing is written yet."""
        now = self._now
        if name == CLOUD and now.has_cloud:
            changes = self._seen_anew(content)
        elif name in ("", CLOUD):
            changes = self._lay(content, now.attached)
            return [*changes, self._number("version", version)]
        else:
            at, placed, room = list(content.placed).index(name), content.placed[name], self._room
            given = placed.place[:3, 3], placed.place[:3, :3].ravel(), placed.twist
            fields = room.place[at], room.turn[at], room.twist[at]
            changes = [*zip(fields, map(_copied, given), strict=True), *self._looked_at_again()]
        self._know(now._replace(content=content))
        return [*changes, self._number("version", version), self._number("laid", self._next)]

    def attach(self, name: str, shapes: Any) -> None:
        """Count on more bodies that move with the arm."""
        if not (isinstance(name, str) and name):
            raise InputError(f"name is {name!r:.60}, expected a word such as 'tray'")
        given = [shapes] if isinstance(shapes, Capsule) else shapes
        if not isinstance(given, Sequence) or not given or not all(isinstance(one, Capsule) for one in given):
            raise InputError(f"{name} is {shapes!r:.60}, expected a list of ftqp.Capsule(a, b, radius)")
        now = self._now
        if name in {one.label for one in self._whole(now.attached)} | {*self.scene, *now.attached}:
            raise InputError(f"there is a {name!r} already; detach it, or give this another name")
        tip = self._robot.tip
        own = named_apart([replace(one, frame=one.frame or tip, name=name) for one in given])
        write_together(self._lay(now.content, now.attached | {name: own}))

    def detach(self, name: str) -> None:
        """Forget bodies that were attached."""
        now = self._now
        if name not in now.attached:
            known = ", ".join(now.attached) or "nothing"
            raise InputError(
                f"there is no {name!r:.60} attached{nearest(str(name), now.attached)}; there is {known}"
            )
        left = {other: own for other, own in now.attached.items() if other != name}
        write_together(self._lay(now.content, left))

    @property
    def _next(self) -> FloatArray:
        """The number of the next layout, (1,)."""
        return np.array([int(self._room.laid) + 1])

    def _know(self, laid: Laid) -> None:
        """What is known once the next layout is written; until then the present one is."""
        at = int(self._room.laid)
        known = {at: self._laid[at]} if at in self._laid else {}
        self._laid = known | {at + 1: laid}

    def _number(self, field: str, value: FloatArray) -> tuple[Any, Any]:
        return self._session.field("scene", field), value

    def _whole(self, attached: dict[str, tuple[Capsule, ...]]) -> list[Capsule]:
        """The bodies of the arm, and those that are attached to it."""
        return [*self._robot.capsules, *(one for own in attached.values() for one in own)]

    def _mount(self, robot: Robot) -> None:
        self._robot = robot

    def _looked_at_again(self) -> Changes:
        room = self._room
        return [(room.look, np.zeros_like(room.look)), (room.gap, np.full_like(room.gap, -np.inf))]

    def _seen_anew(self, content: Content) -> Changes:
        """Where the balls of a cloud are then; they are chosen in the next tick."""
        session, room, count = self._session, self._room, len(content.balls)
        changes = [
            *self._looked_at_again(),
            (room.ball, np.full_like(room.ball, -1)),
            self._number("chosen_tick", np.array([NEVER])),
            self._number("cloud_at", np.array([session.lend(content.balls)])),
            self._number("cloud", np.array([count])),
            self._number("things", np.array([content.things])),
        ]
        if not count:
            place, first = np.array(room.place), int(room.cloud_pair)
            place[-1 - room.second[first : room.pairs]] = FAR_AWAY
            changes.append((room.place, place))
        return changes

    def _lay(self, content: Content, attached: dict[str, tuple[Capsule, ...]]) -> Changes:
        """What makes the room that of these things: all of it is worked out, and nothing is written yet."""
        draft, before = self._session.copy(), self._laid.get(int(self._room.laid))
        layout = Layout(draft, self._robot, self.clearance, content, attached)
        layout.lay({} if before is None else before.content.placed)
        laid = Laid(content, attached, layout.names, layout.left_out, layout.has_cloud)
        room = draft.K.scene
        room.version_at, room.laid = self._room.version_at, self._room.laid + 1
        if len(content.balls):
            room.cloud_at = self._session.lend(content.balls)
        self._know(laid)
        return [(self._session.memory["scene"], draft.memory["scene"])]

    def distances_at(self, q: Any) -> dict[tuple[str, str], FloatArray]:
        """The same at one posture, (nv,) or (nq,), a number each, or at several, (S, nv)."""
        if np.ndim(q) == 2:
            return self.distances(array("q", q, (len(q), self._robot.nv), "(S, nv)"))
        return {names: d[0] for names, d in self.distances(self._robot.angles(q)[None]).items()}

    def distances(self, q: FloatArray) -> dict[tuple[str, str], FloatArray]:
        """The distance of every pair at some postures, (S,) [m] each, by their names."""
        least: dict[tuple[str, str], FloatArray] = {}
        for names, d in zip(self.names, self._session.pair_distances(q).T, strict=True):
            least[names] = np.minimum(least[names], d) if names in least else d
        return least


def _copied(values: FloatArray) -> FloatArray:
    """The same in one piece."""
    return np.array(values, dtype=np.float64, order="C")
