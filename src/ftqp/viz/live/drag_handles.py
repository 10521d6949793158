"""Handles in the scene by which people drag the target of the tip, those of soft tasks, and things around."""

from collections.abc import Callable, Mapping
from time import monotonic
from typing import Any, final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.pose import quaternions, transform
from ftqp.viz.live.frame import rotation_of

LET_GO = 60.0
"""A handle of whose hold nothing has been heard for so long was let go: its browser is gone [s]."""
HELD = 1.0
"""A handle of a task or thing that was dragged within this time is held [s]. A convention."""
STILL = 1e-6
"""A handle nearer to its target than this is there [m, and without unit]."""


@final
class DragHandles:
    """The handles of one scene.

    Args:
        server: The server of the page.
        name: The name of the scene's root node.
        size: The size of the arm [m].
    """

    def __init__(self, server: Any, name: str, size: float) -> None:
        self._server, self._name, self._size = server, name, size
        self._handle: Any = None
        self._marks: dict[int, Any] = {}
        self._marks_moved: dict[int, float] = {}
        self._moved = -np.inf
        self._target: FloatArray | None = None
        self._left: FloatArray | None = None

    def drag(self, moved: Callable[[FloatArray], None], pose: FloatArray, turns: bool) -> None:
        """Put a handle at a pose, (4, 4); ``moved`` is told its pose whenever somebody drags it."""
        self.release()
        self._moved, self._left = -np.inf, None
        handle = self._server.scene.add_transform_controls(
            f"{self._name}/handle",
            scale=0.22 * self._size,
            disable_rotations=not turns,
            depth_test=False,
            wxyz=wxyz(pose[:3, :3]),
            position=pose[:3, 3],
        )

        async def dragged(event: Any) -> None:
            self._moved = -np.inf if event.phase == "end" else monotonic()
            self._left = self._target  # until the target has gone where the handle is, that stays
            if event.phase != "start":
                moved(_pose(event.target.wxyz, event.target.position))

        handle.on_update(dragged)
        self._handle = handle

    def follow(self, target: FloatArray | None) -> None:
        """Let the handle go with the target, (4, 4), while nobody holds it."""
        handle, self._target = self._handle, target
        if handle is None or target is None or monotonic() - self._moved < LET_GO:
            return
        if self._left is not None and np.array_equal(target, self._left):
            return
        self._left = None
        turn, place = wxyz(target[:3, :3]), target[:3, 3]
        if np.abs(place - handle.position).max() > STILL or 1.0 - abs(float(turn @ handle.wxyz)) > STILL:
            handle.wxyz, handle.position = turn, place

    def release(self) -> None:
        """Take the handle away."""
        if self._handle is not None:
            self._handle.remove()
            self._handle = None

    def drag_marks(self, marks: Mapping[int, FloatArray], moved: Callable[[int, FloatArray], None]) -> None:
        """Put a handle at the target of each soft task that has a place, and at each thing around the arm.

        Args:
            marks: Where they are by their number in a frame, (3,) [m].
            moved: Told its number, and its position, (3,) [m], whenever somebody drags it.
        """
        self.release_marks()
        for k, position in marks.items():
            handle = self._server.scene.add_transform_controls(
                f"{self._name}/handle{k}",
                scale=0.13 * self._size,
                disable_rotations=True,
                depth_test=False,
                position=position,
            )

            async def dragged(event: Any, k: int = k) -> None:
                self._marks_moved[k] = monotonic()
                moved(k, np.array(event.target.position))

            handle.on_update(dragged)
            self._marks[k] = handle

    def follow_marks(self, marks: Mapping[int, FloatArray]) -> None:
        """Let the handles of tasks and things go with them while nobody holds them.

        Args:
            marks: Where they are by their number in a frame, (3,) [m].
        """
        for k, handle in self._marks.items():
            held = monotonic() - self._marks_moved.get(k, -np.inf) < HELD
            if not held and k in marks and np.abs(marks[k] - handle.position).max() > STILL:
                handle.position = marks[k]

    def release_marks(self) -> None:
        """Take the handles of tasks and things away."""
        for handle in self._marks.values():
            handle.remove()
        self._marks.clear()
        self._marks_moved.clear()


def wxyz(rotation: FloatArray) -> FloatArray:
    """The quaternion w, x, y, z of a rotation (3, 3)."""
    return np.roll(quaternions(rotation[None])[0], 1)


def _pose(turn: FloatArray, position: FloatArray) -> FloatArray:
    """A pose (4, 4) from a quaternion w, x, y, z and a position."""
    return transform(rotation_of(np.roll(turn, -1) / np.linalg.norm(turn)), np.asarray(position))
