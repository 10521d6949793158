"""What an arm keeps clear of while its failures are studied: a scene as it stands now, and the arm itself."""

from dataclasses import dataclass
from typing import Any, Self, final

import numpy as np

from ftqp.control.planner.planner import Planner
from ftqp.control.scene.keeping_clear import Clearance
from ftqp.control.scene.placed_shapes import Scene
from ftqp.core.checks import FloatArray, instance
from ftqp.core.errors import InputError
from ftqp.model.robot import Robot

BY_CAPSULE = ("body", "end_a", "end_b", "wide")
BY_OBSTACLE = ("solid", "place", "turn", "extent")
BY_PAIR = ("first", "second")
"""Fields of the room that say what is to be kept apart, by what they count."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Around:
    """What an arm keeps clear of, as it stood when this was made; made by ``around_of``."""

    scene: Scene  # What stands around it
    clearance: Clearance  # How far it keeps
    room: Any  # The room of a planner that keeps clear of it, a copy, (1,)

    def on(self, robot: Robot) -> Self:
        """The same around another arm."""
        return type(self)(scene=self.scene, clearance=self.clearance, room=_room(robot, self))

    def moved(self, robot: Robot, by: FloatArray) -> Self:
        """The same arm, with everything around it moved."""
        scene = self.scene.copy()
        for name, placed in self.scene.items():
            scene.move(name, placed.place[:3, 3] + by)
        return type(self)(scene=scene, clearance=self.clearance, room=None).on(robot)

    @property
    def numbers(self) -> list[Any]:
        """All that decides which postures are clear."""
        room = self.room[0]
        shapes = int(room["obstacles"])
        counts = (
            (BY_CAPSULE, int(room["capsules"])),
            (BY_OBSTACLE, shapes),
            (BY_PAIR, int(room["pairs"])),
            (("face",), int(room["faces_of"][:shapes].max(initial=0))),
        )
        return [room["keep"], *(room[name][:count] for names, count in counts for name in names)]


def around_of(robot: Robot, scene: Scene | None, clearance: Clearance | None) -> Around | None:
    """What an arm keeps clear of, as it stands now."""
    instance("scene", scene, Scene | None, "an ftqp.Scene or None")
    instance("clearance", clearance, Clearance | None, "an ftqp.Clearance or None")
    if scene is None and clearance is None:
        return None
    stands = Scene() if scene is None else scene.copy()
    if len(stands.balls):
        raise InputError(
            f"the scene has a cloud of {len(stands.balls)} balls, and failures are studied among shapes that "
            "have a name; add them as balls or boxes, or take the cloud away, scene.update(np.zeros((0, 4)))"
        )
    moving = [name for name, placed in stands.items() if placed.twist.any()]
    if moving:
        raise InputError(
            f"{moving[0]!r} in the scene moves, and which failures a path survives is known among things "
            f"that stand; say where it stands, scene.move({moving[0]!r}, place)"
        )
    kept = Around(scene=stands, clearance=Clearance() if clearance is None else clearance, room=None)
    return kept.on(robot)


def _room(robot: Robot, around: Around) -> Any:
    planner = Planner(robot, scene=around.scene, clearance=around.clearance)
    return np.array(planner.what_ifs().session.K["scene"]).reshape(1)
