"""Handles in the scene by which people drag the target of the tip, those of soft tasks, and things around."""

from collections.abc import Callable, Mapping
from time import monotonic
from typing import Any, final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.pose import quaternions, transform
from ftqp.sim.session.frame import rotation_of

LET_GO, SETTLES = 60.0, 1.0
"""A handle of whose hold nothing has been heard for so long was let go, as its browser is gone; what it is of
has so long to go where it was let go [s]."""
STILL = 1e-6
"""A handle nearer to its target than this is there [m, and without unit]."""
TIP, MARK = 0.22, 0.13
"""How large the handle of the tip's target is, and those of tasks and things, as shares of the arm's size."""


@final
class DragHandle:
    """A handle at a pose, (4, 4); ``moved`` gets its pose whenever somebody drags it."""

    def __init__(
        self, scene: Any, name: str, scale: float, pose: FloatArray, moved: Callable[[FloatArray], None],
        *, turns: bool,
    ) -> None:  # fmt: skip
        self.held_until = -np.inf
        self.control = scene.add_transform_controls(
            name, scale=scale, disable_rotations=not turns, depth_test=False, wxyz=wxyz(pose[:3, :3]),
            position=pose[:3, 3],
        )  # fmt: skip

        async def dragged(event: Any) -> None:
            self.held_until = monotonic() + (SETTLES if event.phase == "end" else LET_GO)
            if event.phase != "start":
                moved(_pose(event.target.wxyz, event.target.position))

        self.control.on_update(dragged)

    def follow(self, target: FloatArray | None) -> None:
        """Go with the target, (4, 4), while nobody holds it."""
        if target is None or monotonic() < self.held_until:
            return
        turn, place, control = wxyz(target[:3, :3]), target[:3, 3], self.control
        if np.abs(place - control.position).max() > STILL or 1.0 - abs(float(turn @ control.wxyz)) > STILL:
            control.wxyz, control.position = turn, place


@final
class DragHandles:
    """The handles of the scene with this root node, of an arm of this size [m]."""

    def __init__(self, server: Any, name: str, size: float) -> None:
        self._scene, self._name, self._size = server.scene, name, size
        self.tip: DragHandle | None = None
        self.marks: dict[int, DragHandle] = {}

    def drag(self, moved: Callable[[FloatArray], None], pose: FloatArray, turns: bool) -> None:
        """Put a handle at the pose of the tip's target."""
        self.release()
        self.tip = DragHandle(self._scene, f"{self._name}/handle", TIP * self._size, pose, moved, turns=turns)

    def release(self) -> None:
        """Take the handle of the tip away."""
        if self.tip is not None:
            self.tip.control.remove()
            self.tip = None

    def drag_marks(self, marks: Mapping[int, FloatArray], moved: Callable[[int, FloatArray], None]) -> None:
        """Put a handle at the target of each soft task that has a place, and at each thing around the arm."""
        self.release_marks()
        for k, position in marks.items():

            def placed(pose: FloatArray, k: int = k) -> None:
                moved(k, pose[:3, 3])

            self.marks[k] = DragHandle(
                self._scene, f"{self._name}/handle{k}", MARK * self._size, transform(np.eye(3), position),
                placed, turns=False,
            )  # fmt: skip

    def follow(self, target: FloatArray | None, marks: Mapping[int, FloatArray]) -> None:
        """Let all handles go with what they are of while nobody holds them."""
        if self.tip is not None:
            self.tip.follow(target)
        for k, handle in self.marks.items():
            handle.follow(transform(np.eye(3), marks[k]) if k in marks else None)

    def release_marks(self) -> None:
        """Take the handles of tasks and things away."""
        for handle in self.marks.values():
            handle.control.remove()
        self.marks.clear()


def wxyz(rotation: FloatArray) -> FloatArray:
    """The quaternion w, x, y, z of a rotation (3, 3)."""
    return np.roll(quaternions(rotation[None])[0], 1)


def _pose(turn: FloatArray, position: FloatArray) -> FloatArray:
    """A pose (4, 4) from a quaternion w, x, y, z and a position."""
    return transform(rotation_of(np.roll(turn, -1) / np.linalg.norm(turn)), np.asarray(position))
