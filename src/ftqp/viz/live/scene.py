"""A frame as a 3-D scene: nodes made once, of which only pose, colour and points change after that."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, IntArray
from ftqp.core.pose import quaternions
from ftqp.model.robot import Robot
from ftqp.sim.log.signals import CONDITIONS, HEALTHY
from ftqp.sim.session.frame import Frame, Ghost, rotation_of
from ftqp.viz.live import colours
from ftqp.viz.live.drag_handles import DragHandles, wxyz
from ftqp.viz.live.further_nodes import FurtherNodes
from ftqp.viz.live.ghosts import GhostNodes
from ftqp.viz.live.meshes import BASE, Mesh, Part, arm_parts, ball, size_of

RIVAL = "rival"
"""The overlay of the same arm, led by damped resolved rates."""
NAMES = {False: "damped resolved rates, not reported", True: "damped resolved rates, reported"}
"""What the rival is, by whether what has failed was reported to it."""
FURTHER = "tasks and planes"
"""The overlay of targets of soft tasks and of planes, of arms that have any."""
OVERLAYS = ("target", "path", "trail", "ellipsoid", RIVAL, "labels", "grid")
"""What can be shown or left out, each with a check box."""
SEGMENTS = 300
"""Segments of a trail; always as many, so that no node is made anew."""
STEP = 0.003
"""A trail goes on when the tip has moved by this share of the arm's size."""
ELLIPSOID = 0.15
"""Size of the ellipsoid: metres for a tip speed of one metre a second at joint speeds of norm one."""
THINNEST = 2e-3
"""Least half-axis of the ellipsoid, as a share of the arm's size, so that a flat one is seen as a disc."""
SEEN = 1.2
"""A target of a soft task is in view at first within so many of the arm's sizes of its base."""
DISTANCE = 1.8
"""From the camera to the middle of what is shown, in its diagonals."""
SHADE = 0.32
"""Opacity of the rival."""
SHRUNK = 0.97
"""Size of the rival's parts, so that it is hidden where it is with the arm."""


class Scene:
    """An arm with its overlays on a server; ``show`` moves it.

    The camera is placed by the first frame. ``path`` is (k, 3) in the base's frame [m]. A scene that follows
    another on the same server needs a ``name`` of its own. Without ``parts`` the arm is what its chain gives.
    Overlays in ``hidden`` are left out at first, a trail has at most ``trail`` segments, and ``clock`` puts
    time and status beside the arm, for scenes without a page around them.
    """

    def __init__(
        self,
        server: Any,
        robot: Robot,
        frame: Frame,
        *,
        path: FloatArray | None = None,
        name: str = "arm-1",
        parts: Sequence[Part] | None = None,
        hidden: Sequence[str] = (),
        trail: int = SEGMENTS,
        clock: bool = False,
    ) -> None:
        self._server, self._robot, self._clock = server, robot, clock
        self.size = size_of(robot.chain)
        self._root = server.scene.add_frame(f"/{name}", show_axes=False, wxyz=_upright(robot.chain.gravity))
        self._name = self._root.name
        self._hidden = set(hidden)
        self.handles = DragHandles(server, self._name, self.size)
        self._further: FurtherNodes | None = None
        self._parts = tuple(parts) if parts is not None else arm_parts(robot)
        self.ghosts = GhostNodes(server, self._name, self.size, self._draw_ghost)
        with server.atomic():
            self._build(self._parts, path, trail)
            self._build_further(frame)
            self._look(frame, path)
            self.show(frame)

    @property
    def name(self) -> str:
        """The name of the root node."""
        return str(self._name)

    @property
    def overlays(self) -> tuple[str, ...]:
        """What can be shown or left out."""
        return tuple(self._overlays)

    @property
    def hidden(self) -> frozenset[str]:
        """The overlays that are left out."""
        return frozenset(self._hidden)

    def show(self, frame: Frame) -> None:
        """Move everything to where a frame says it is."""
        _place(self._joints, frame.joints, self._above)
        for i in range(len(self._joints)):
            colour = colours.joint_colour(
                int(frame.truth[i]), bool(frame.braking[i]), bool(frame.near_limit[i])
            )
            if colour != self._shown[i]:
                self._shown[i] = colour
                for mesh in self._barrels[i]:
                    mesh.color = colour
                for mesh in self._bodies[i]:
                    mesh.color = colours.LINK if colour == colours.CONDITION[HEALTHY] else colour
        self._show_target(frame)
        self._show_twin(frame)
        self._show_ellipsoid(frame)
        if self._further is not None:
            self._further.show(frame.further)
        self.handles.follow(frame.target, self.marks)
        self.ghosts.show(frame.ways)
        self._trail.follow(frame.tip[:3, 3], frame.tick, "trail" not in self._hidden)
        self._caption(frame)

    def choose(self, overlay: str, visible: bool) -> None:
        """Show or hide an overlay; naming another one than ``overlays`` has is a programmer's mistake."""
        (self._hidden.discard if visible else self._hidden.add)(overlay)
        for node in self._overlays[overlay]:
            node.visible = visible and self._present.get(overlay, True)

    @property
    def marks(self) -> Mapping[int, FloatArray]:
        """Where targets of soft tasks and things around the arm are, by their number in a frame, (3,) [m]."""
        return {} if self._further is None else self._further.marks

    def nodes(self) -> dict[str, Any]:
        """Names of what ``show`` moves, for a page that moves it without this program."""
        return {
            "frames": [node.name for node in self._joints],
            "rival_frames": [node.name for node in self._rival_frames],
            "barrels": [[mesh.name for mesh in meshes] for meshes in self._barrels],
            "bodies": [[mesh.name for mesh in meshes] for meshes in self._bodies],
            "target": self._target.name, "said": self._said.name, "named": self._named.name,
            "trail": self._trail.node.name, "rival_trail": self._rival_trail.node.name,
            "overlays": {name: [node.name for node in nodes] for name, nodes in self._overlays.items()},
        }  # fmt: skip

    def camera(self, client: Any) -> None:
        """Look at this arm in a browser that is connected already."""
        client.camera.position, client.camera.look_at = self._eye, self._middle

    def remove(self) -> None:
        """Take every node away."""
        self._root.remove()

    def _build(self, parts: Sequence[Part], path: FloatArray | None, trail: int) -> None:
        """Make every node."""
        add, n = self._server.scene, self._robot.nv
        self._above = self._robot.chain.parent
        homes, shadows = (frame_names(f"{self._name}{root}", self._above) for root in ("", "/twin"))
        self._joints = [add.add_frame(home, show_axes=False) for home in homes]
        self._barrels: list[list[Any]] = [[] for _ in range(n)]
        self._bodies: list[list[Any]] = [[] for _ in range(n)]
        self._shown: list[colours.Colour | None] = [None] * n
        self._present: dict[str, bool] = {}
        twin = add.add_frame(f"{self._name}/twin", show_axes=False)
        self._rival_frames = [add.add_frame(shadow, show_axes=False) for shadow in shadows]
        fills = {"link": colours.LINK, "body": colours.LINK, "base": colours.BASE}
        fills |= {"tip": colours.TRAIL, "joint": colours.UNKNOWN}
        for part in parts:
            home = self._name if part.frame == BASE else homes[part.frame]
            mesh = self._mesh(f"{home}/{part.name}", part.mesh, fills[part.kind], None)
            if part.kind == "joint":
                self._barrels[part.frame].append(mesh)
            if part.kind == "body":
                self._bodies[part.frame].append(mesh)
            if part.frame != BASE:
                thinner = Mesh(SHRUNK * part.mesh.vertices, part.mesh.faces)
                self._mesh(f"{shadows[part.frame]}/{part.name}", thinner, colours.RIVAL, SHADE)
        s = self.size
        self._target = add.add_frame(
            f"{self._name}/target", axes_length=0.07 * s, axes_radius=0.0028 * s, origin_radius=0.0
        )
        self._mesh(f"{self._name}/target/ball", ball(0.035 * s), colours.TARGET, 0.3)
        self._ellipsoid = self._mesh(f"{self._name}/ellipsoid", ball(1.0), colours.ELLIPSOID, 0.25)
        self._trail = _Trail(add, f"{self._name}/trail", colours.TRAIL, 0.0045 * s, STEP * s, trail)
        self._rival_trail = _Trail(add, f"{self._name}/twin/trail", colours.RIVAL, 0.003 * s, STEP * s, trail)
        ways = [self._way(path)] if path is not None and len(path) > 1 else []
        grid = add.add_grid(
            f"{self._name}/grid", width=3.0 * s, height=3.0 * s, cell_size=0.1 * s, section_size=0.5 * s,
            cell_color=(226, 228, 232), section_color=(198, 202, 208), fade_distance=4.0 * s,
            position=(0.0, 0.0, -0.02 * s),
        )  # fmt: skip
        self._said = self._label("said", "")
        self._named = self._label("twin/named", NAMES[False], anchor="top-center")
        nodes = ([self._target], ways, [self._trail.node], [self._ellipsoid], [twin])
        labels = [self._said, self._named]
        self._overlays: dict[str, list[Any]] = dict(zip(OVERLAYS, (*nodes, labels, [grid]), strict=True))
        for overlay in self._hidden:
            self.choose(overlay, False)

    def _build_further(self, frame: Frame) -> None:
        """The nodes of soft tasks and planes, where the arm has any."""
        if not frame.further:
            return
        middle = np.vstack([np.zeros(3), frame.joints[:, :3, 3]]).mean(axis=0)
        self._further = FurtherNodes(
            frame.further,
            middle,
            self.size,
            lambda name, mesh, colour, opacity: self._mesh(f"{self._name}/{name}", mesh, colour, opacity),
            self._label,
        )
        self._overlays[FURTHER] = self._further.nodes
        if FURTHER in self._hidden:
            self.choose(FURTHER, False)

    def _draw_ghost(self, name: str, ghost: Ghost, colour: colours.Colour, shade: float) -> list[Any]:
        """The arm once more where a way out ends; its meshes."""
        homes = frame_names(name, self._above)
        _place(
            [self._server.scene.add_frame(home, show_axes=False) for home in homes], ghost.joints, self._above
        )
        return [
            self._mesh(
                f"{homes[part.frame]}/{part.name}",
                Mesh(SHRUNK * part.mesh.vertices, part.mesh.faces),
                colour,
                shade,
            )
            for part in self._parts
            if part.frame != BASE
        ]

    def _mesh(self, name: str, mesh: Mesh, colour: colours.Colour, opacity: float | None) -> Any:
        """A node of triangles."""
        look = dict(color=colour, opacity=opacity, cast_shadow=opacity is None, receive_shadow=False)
        return self._server.scene.add_mesh_simple(name, mesh.vertices, mesh.faces, **look)

    def _label(self, name: str, text: str, anchor: str = "bottom-center") -> Any:
        """A text in the scene."""
        return self._server.scene.add_label(f"{self._name}/{name}", text, anchor=anchor)

    def _way(self, path: FloatArray) -> Any:
        """The path as a thin line."""
        pieces = np.stack([path[:-1], path[1:]], axis=1)
        return self._server.scene.add_line_segments(
            f"{self._name}/path", pieces, colours.PATH, thickness=0.003 * self.size
        )

    def _look(self, frame: Frame, path: FloatArray | None) -> None:
        """Place the camera so that base, arm and path fill the picture."""
        points = [np.zeros((1, 3)), frame.joints[:, :3, 3]]
        if path is not None and len(path):
            points.append(np.asarray(path))
        marks = [np.array([one.place]) for one in frame.further if one.place and not one.shape]
        points += [mark for mark in marks if np.linalg.norm(mark) < SEEN * self.size]
        cloud = np.vstack(points)
        middle = 0.5 * (cloud.min(axis=0) + cloud.max(axis=0))
        flat = np.ptp(cloud[:, 2]) < 0.05 * self.size
        side = np.array([0.15, -0.75, 1.0]) if flat else np.array([0.75, -1.0, 0.42])
        R = rotation_of(np.roll(_upright(self._robot.chain.gravity), -1))
        span = max(float(np.linalg.norm(np.ptp(cloud, axis=0))), 0.6 * self.size)
        self._middle = R @ middle
        self._eye = self._middle + DISTANCE * span * (R @ (side / np.linalg.norm(side)))
        self._said.position = [*middle[:2], cloud[:, 2].max() + 0.13 * self.size]
        camera = self._server.initial_camera
        camera.position, camera.look_at = self._eye, self._middle
        camera.fov, camera.near, camera.far = np.deg2rad(45.0), 0.01 * self.size, 100.0 * self.size

    def _show_target(self, frame: Frame) -> None:
        """The target's frame; nothing where there is none."""
        self._appear("target", frame.target is not None)
        if frame.target is not None:
            self._target.wxyz = wxyz(frame.target[:3, :3])
            self._target.position = frame.target[:3, 3]

    def _show_twin(self, frame: Frame) -> None:
        """The rival, once something has failed."""
        apart = frame.rival is not None and bool(frame.truth.any())
        self._appear(RIVAL, apart)
        if frame.rival is None or not apart:
            self._rival_trail.rest()
            return
        _place(self._rival_frames, frame.rival.joints, self._above)
        if self._named.text != NAMES[frame.rival.reported]:
            self._named.text = NAMES[frame.rival.reported]
        tip = frame.rival.joints[-1, :3, 3]
        self._named.position = tip - np.array([0.0, 0.0, 0.07 * self.size])
        self._rival_trail.follow(tip, frame.tick, RIVAL not in self._hidden)

    def _show_ellipsoid(self, frame: Frame) -> None:
        """How fast the healthy joints move the tip in each direction."""
        if "ellipsoid" in self._hidden:
            return
        axes = np.maximum(ELLIPSOID * frame.axes, THINNEST * self.size)
        self._ellipsoid.scale = tuple(float(a) for a in axes)
        self._ellipsoid.wxyz = wxyz(frame.axes_rotation)
        self._ellipsoid.position = frame.tip[:3, 3]

    def _appear(self, overlay: str, present: bool) -> None:
        """Show an overlay only while there is something to show."""
        if self._present.get(overlay, True) != present:
            self._present[overlay] = present
            self.choose(overlay, overlay not in self._hidden)

    def _caption(self, frame: Frame) -> None:
        """What has failed, in words beside the arm."""
        words = caption(frame, self._robot.joints, self._clock)
        if self._said.text != words:
            self._said.text = words


class _Trail:
    """Where a tip has been: a fixed number of segments, the oldest of which is used again."""

    def __init__(
        self, add: Any, name: str, colour: colours.Colour, thickness: float, step: float, segments: int
    ) -> None:
        self._points, self._step, self._next = np.zeros((segments, 2, 3)), step, 0
        self._last: FloatArray | None = None
        self._tick = -1
        self.node = add.add_line_segments(name, self._points, colour, thickness=thickness)

    def follow(self, tip: FloatArray, tick: int, seen: bool) -> None:
        """Go on to the tip, (3,) [m]; a tick before the last one begins the trail anew."""
        if self._last is None or tick < self._tick:
            self._points[:] = tip
            self._last, self._next = np.array(tip), 0
        elif np.linalg.norm(tip - self._last) >= self._step:
            self._points[self._next] = [self._last, tip]
            self._last = np.array(tip)
            self._next = (self._next + 1) % len(self._points)
        else:
            self._tick = tick
            return
        self._tick = tick
        if seen:
            self.node.points = self._points

    def rest(self) -> None:
        """Forget where the tip has been."""
        self._last = None


def caption(frame: Frame, joints: Sequence[str], clock: bool) -> str:
    """What has failed, for a label in the scene; with ``clock`` time and status, too."""
    failed = [f"{joints[i]} {CONDITIONS[int(frame.truth[i])]}" for i in frame.truth.nonzero()[0].tolist()]
    return ", ".join([f"{frame.t:.1f} s", frame.status, *failed] if clock else failed)


def frame_names(root: str, parent: IntArray) -> list[str]:
    """Names of the nodes of the joints' frames, each below its parent's, so that a locked joint stands."""
    names = [root]
    for i, above in enumerate(parent):
        names.append(f"{names[above + 1]}/frame{i}")
    return names[1:]


def _place(nodes: Sequence[Any], poses: FloatArray, parent: IntArray) -> None:
    """Move the nodes of the joints to where poses in the base's frame, (nv + 1, 4, 4), say that they are."""
    turns, origins = poses[: len(nodes), :3, :3], poses[: len(nodes), :3, 3]
    before = np.concatenate([np.eye(3)[None], turns])[parent + 1]
    steps = origins - np.concatenate([np.zeros((1, 3)), origins])[parent + 1]
    turned = quaternions(np.einsum("kji,kjl->kil", before, turns))[:, [3, 0, 1, 2]]
    moved = np.einsum("kji,kj->ki", before, steps)
    for i, node in enumerate(nodes):
        node.wxyz, node.position = turned[i], moved[i]


def _upright(gravity: FloatArray) -> FloatArray:
    """The rotation as w, x, y, z that turns the direction against gravity, (3,), to the scene's z axis."""
    strength = float(np.linalg.norm(gravity))
    if strength == 0.0:
        return np.array([1.0, 0.0, 0.0, 0.0])
    up = -np.asarray(gravity) / strength
    if up[2] < -1.0 + 1e-9:
        return np.array([0.0, 1.0, 0.0, 0.0])
    turn = np.array([1.0 + up[2], up[1], -up[0], 0.0])
    return np.asarray(turn / np.linalg.norm(turn))
