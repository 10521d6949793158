"""Targets of soft tasks, planes and boxes that points are kept to, and the scene, drawn and labelled."""

from collections.abc import Callable, Sequence
from html import escape
from typing import Any, final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.pose import rotation_to
from ftqp.sim.session.frame import FurtherFact, Solid
from ftqp.viz.live import colours
from ftqp.viz.live.drag_handles import wxyz
from ftqp.viz.live.meshes import Mesh, ball, box, capsule, cylinder, hull, joined

MARK, WIDE, THIN, ARROW = 0.018, 0.6, 0.002, 0.12
"""Radius of a mark, width and thickness of a plane, length of its arrow, as shares of the arm's size."""
SHADE = 0.15
"""Opacity of a plane, ..."""
SOLID = 0.75
"""... and of what stands around the arm."""
BEYOND = -2e-5
"""A point is beyond its plane from here on [m or rad]; less is rounding."""
_FROM = {
    "": "off",
    "plane": "from the plane",
    "box": "from the sides of the box",
    "cone": "from the cone",
    "body": "clear",
}
"""What stands behind an amount."""

Add = Callable[[str, Mesh, colours.Colour, float | None], Any]
"""Makes a node of triangles, of a name below the arm's, its mesh, colour and opacity."""


@final
class FurtherNodes:
    """The nodes of soft tasks, boxes, and planes near the middle of the arm; a cone is only in the table."""

    def __init__(
        self, shown: Sequence[FurtherFact], middle: FloatArray, size: float, mesh: Add, label: Any
    ) -> None:
        self._size = size
        self._moving: dict[int, Any] = {}
        self._labels: dict[int, Any] = {}
        self.nodes: list[Any] = []
        for k, one in enumerate(shown):
            if one.solid is not None:
                self._moving[k] = mesh(f"solid{k}", _triangles(one.solid, size), colours.OBSTACLE, SOLID)
                self._labels[k] = label(f"solid{k}_said", "")
            elif one.corners is not None:
                self._add_box(k, one, middle, mesh, label)
            elif one.place is not None:
                self._labels[k] = label(f"task{k}_said", "")
                if one.normal is None:
                    self._moving[k] = mesh(f"task{k}", ball(MARK * size), colours.MARK, None)
                else:
                    self._add_plane(k, one, middle, mesh)
        self.nodes += [*self._moving.values(), *self._labels.values()]
        self.show(shown)

    def show(self, shown: Sequence[FurtherFact]) -> None:
        """Move marks and things, and say how far everything is."""
        for k, node in self._moving.items():
            place, solid = shown[k].place, shown[k].solid
            if solid is not None:
                T = np.reshape(solid.pose, (4, 4))
                node.position, node.wxyz = T[:3, 3], wxyz(T[:3, :3])
                self._labels[k].position = _above(solid)
            elif place is not None:
                node.position = place
                self._labels[k].position = (place[0], place[1], place[2] + 2.0 * MARK * self._size)
        for k, label in self._labels.items():
            text = f"{shown[k].name}: {amount(shown[k])}"
            if label.text != text:
                label.text = text

    @property
    def marks(self) -> dict[int, FloatArray]:
        """Where targets of tasks and things around the arm are, by their numbers in a frame, (3,) [m]."""
        return {k: np.array(node.position) for k, node in self._moving.items()}

    def _add_plane(self, k: int, one: FurtherFact, middle: FloatArray, mesh: Add) -> None:
        """A translucent square nearest to the middle of the arm, and an arrow into the side that is free."""
        size, normal = self._size, np.array(one.normal)
        square = mesh(f"plane{k}", box(size * np.array([WIDE, WIDE, THIN])), colours.PLANE, SHADE)
        shaft = cylinder(0.006 * size, 0.0, 0.7 * ARROW * size)
        head = cylinder(0.016 * size, 0.7 * ARROW * size, ARROW * size, 0.0005 * size)
        arrow = mesh(f"plane{k}_normal", joined([shaft, head]), colours.PLANE, None)
        centre = middle - ((middle - np.array(one.place)) @ normal) * normal
        for node in (square, arrow):
            node.position, node.wxyz = centre, wxyz(rotation_to(normal))
        self._labels[k].position = centre + 1.25 * ARROW * size * normal
        self.nodes += [square, arrow]

    def _add_box(self, k: int, one: FurtherFact, middle: FloatArray, mesh: Add, label: Any) -> None:
        """A translucent box; a side that is left out is where it leaves the arm room."""
        room = 0.5 * WIDE * self._size
        low, high = np.array(one.corners).reshape(2, 3)
        low = np.where(np.isfinite(low), low, np.minimum(high, middle) - room)
        high = np.where(np.isfinite(high), high, np.maximum(low, middle) + room)
        node = mesh(f"box{k}", box(high - low), colours.PLANE, SHADE)
        node.position = 0.5 * (low + high)
        self.nodes.append(node)
        self._labels[k] = label(f"task{k}_said", "")
        self._labels[k].position = (*(0.5 * (low + high))[:2], high[2])


def _triangles(solid: Solid, size: float) -> Mesh:
    """Something of a scene in its own frame."""
    x, y, z = solid.extent
    match solid.kind:
        case "box":
            return box(2.0 * np.array([x, y, z]))
        case "hull":
            return hull(np.reshape(solid.corners, (-1, 3)))
        case "half_space":
            return box(size * np.array([3.0, 3.0, THIN]))
        case _:
            return capsule(y, x, round_ends=solid.kind != "cylinder")


def _above(solid: Solid) -> tuple[float, float, float]:
    """A place above something of a scene, for its name [m]."""
    T = np.reshape(solid.pose, (4, 4))
    edged = solid.kind in ("box", "hull")
    half = np.array(solid.extent if edged else (solid.extent[1],) * 2 + (sum(solid.extent[:2]),))
    high = float(np.abs(T[2, :3]) @ half) if solid.kind != "half_space" else 0.0
    return float(T[0, 3]), float(T[1, 3]), float(T[2, 3]) + high


def amount(one: FurtherFact) -> str:
    """How far something is, in words that a person can judge."""
    if not np.isfinite(one.value):
        return "unknown"
    if one.shape == "body" and one.value < 0.0:
        return f"{-1e3 * one.value:.3g} mm inside"
    if one.shape and one.value < BEYOND:
        away = f"{-1e3 * one.value:.3g} mm" if one.unit == "m" else f"{np.degrees(-one.value):.3g} deg"
        return f"{away} {'beyond' if one.shape == 'plane' else 'outside'} the {one.shape}"
    away = f"{one.value:.3g}"
    if one.unit in ("m", "rad"):
        value = max(one.value, 0.0)
        away = f"{1e3 * value:.1f} mm" if one.unit == "m" else f"{np.degrees(value):.1f} deg"
    return f"{away} {_FROM[one.shape]}"


def further_table(shown: Sequence[FurtherFact]) -> str:
    """How far every soft task is from its target, and what is kept from its plane, box or cone."""
    rows = "".join(
        f'<tr><td style="padding:0 8px 0 0">{escape(one.name)}</td>'
        f'<td style="{"color:#b00020;font-weight:600" if one.shape and one.value < BEYOND else ""}">'
        f"{escape(amount(one))}</td></tr>"
        for one in shown
    )
    return (
        '<div style="font:13px/1.45 system-ui,sans-serif;color:#222;padding:0 10px">'
        '<table id="ftqp-tasks" style="border-collapse:collapse;font-size:12px;width:100%">'
        f"{rows}</table></div>"
    )
