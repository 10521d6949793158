"""A picture of an arm: from the side, from above, and each joint in its range."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.picture import Picture
from ftqp.model.chain import frame_id
from ftqp.model.posture import places
from ftqp.model.robot import Robot
from ftqp.viz.figures.canvas import BLUE, GREY, LIMIT, ORANGE, Axes, paper, picture_of, save

FLAT = 0.02
"""An arm whose extent along a direction is below this share of its size is flat there."""
CLOSE = 0.03
"""Joints nearer to each other than this share of the picture share one label."""
AXIS = 0.06
"""Length of a drawn axis, as a share of the arm's size."""
UP = np.array([0.0, 0.0, 1.0])
"""What is up where there is no gravity."""
TURN = np.pi
"""A range without limits is drawn as half a turn either way [rad or m]."""


def robot_picture(robot: Robot, q: Any = None) -> Picture:
    """An arm at a posture, (nv,) or (nq,) [rad or m]; at its neutral one without."""
    posture = robot.neutral if q is None else robot.angles(q)
    title = f"{robot.name}, tip {robot.tip}"
    return picture_of(lambda file: robot_figure(file, title, robot, posture), title)


def robot_figure(path: str | Path, title: str, robot: Robot, q: FloatArray) -> Path:
    """Draw a robot in the configuration q, (nv,) [rad or m], to a PNG file."""
    points, axes = places(robot.model, frame_id(robot.model, robot.tip), robot.configuration(q))
    gravity = np.array(robot.chain.gravity)
    up = -gravity / np.linalg.norm(gravity) if gravity.any() else UP
    ranges = np.column_stack([robot.limits.q_min, robot.limits.q_max])
    slides = robot.chain.prismatic
    joints = [f"{name} [{'m' if slides[k] else 'rad'}]" for k, name in enumerate(robot.joints)]
    return draw_arm(path, title, joints, points, axes, up, ranges, q, robot.chain.limbs)


def draw_arm(
    path: str | Path,
    title: str,
    joints: Sequence[str],
    points: FloatArray,
    axes: FloatArray,
    up: FloatArray,
    ranges: FloatArray,
    q: FloatArray,
    limbs: Sequence[Sequence[int]],
) -> Path:
    """Draw an arm at one posture to a PNG file."""
    whole = np.vstack([np.zeros(3), points])
    across = _widest(whole, up)
    views = [("from the side", across, up), ("from above", across, np.cross(up, across))]
    extent = float(np.ptp(whole, axis=0).max()) or 1.0
    views = [view for view in views if np.ptp(whole @ view[2]) > FLAT * extent] or views[1:]
    figure = paper(4.2 * len(views) + 4.2, 5.0, title)
    grid = figure.add_gridspec(1, len(views) + 1)
    for k, (name, right, above) in enumerate(views):
        _draw_view(figure.add_subplot(grid[0, k]), name, whole, axes, np.array([right, above]), extent, limbs)
    _draw_ranges(figure.add_subplot(grid[0, len(views)]), joints, ranges, q)
    return save(figure, path)


def _widest(points: FloatArray, up: FloatArray) -> FloatArray:
    """The horizontal direction along which the arm extends farthest, pointing to the tip's side."""
    flat = points - np.outer(points @ up, up)
    _, _, directions = np.linalg.svd(flat - flat.mean(axis=0))
    across: FloatArray = directions[0] - (directions[0] @ up) * up
    norm = float(np.linalg.norm(across))
    if norm < 1e-6:
        across, norm = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))]), 1.0
        norm = float(np.linalg.norm(across))
    across = across / norm
    return across if across @ (flat[-1] - flat[0]) >= 0.0 else -across


def _draw_view(
    panel: Axes,
    name: str,
    whole: FloatArray,
    axes: FloatArray,
    plane: FloatArray,
    extent: float,
    limbs: Sequence[Sequence[int]],
) -> None:
    """The arm projected to a plane, (2, 3): links, joints with their axes and numbers, base and tip."""
    at = whole @ plane.T
    for limb in limbs:
        panel.plot(*at[limb].T, color=GREY, linewidth=6.0, alpha=0.45, solid_capstyle="round", zorder=1)
    panel.plot(*at[0], marker="s", color="black", markersize=9, linestyle="none", zorder=2)
    for place, axis in zip(at[1:-1], axes @ plane.T, strict=True):
        ends = place + AXIS * extent * np.outer((-1.0, 1.0), axis)
        panel.plot(*ends.T, color=ORANGE, linewidth=1.8, zorder=3)
        panel.plot(*place, marker="o", color=BLUE, markersize=7, linestyle="none", zorder=4)
    panel.plot(*at[-1], marker="*", color=ORANGE, markersize=13, linestyle="none", zorder=5)
    for label, place in [*_labels(at[1:-1], extent), ("base", at[0]), ("tip", at[-1])]:
        below = label in ("base", "tip")
        panel.annotate(
            label, place, xytext=(9, -13 if below else 6), textcoords="offset points", fontsize=9, zorder=6,
            fontweight="normal" if below else "bold",
        )  # fmt: skip
    panel.set_aspect("equal", adjustable="datalim")
    panel.margins(0.18)
    panel.set_title(name, fontsize=10)
    panel.set_xlabel("[m]")
    panel.grid(alpha=0.25)


def _labels(at: FloatArray, extent: float) -> list[tuple[str, FloatArray]]:
    """Numbers of the joints, those that coincide in one label."""
    found: list[tuple[list[int], FloatArray]] = []
    for i, place in enumerate(at, 1):
        for numbers, other in found:
            if np.linalg.norm(place - other) < CLOSE * extent:
                numbers.append(i)
                break
        else:
            found.append(([i], place))
    return [(", ".join(map(str, numbers)), place) for numbers, place in found]


def _draw_ranges(panel: Axes, joints: Sequence[str], ranges: FloatArray, q: FloatArray) -> None:
    """Each joint's range as a bar from its limit to its limit, with the posture in it."""
    for k, (low, high) in enumerate(ranges):
        left, right = (low if np.isfinite(low) else q[k] - TURN), (high if np.isfinite(high) else q[k] + TURN)
        panel.barh(k, right - left, left=left, height=0.5, color=BLUE, alpha=0.25)
        for end, finite in ((left, np.isfinite(low)), (right, np.isfinite(high))):
            if finite:
                panel.plot([end, end], [k - 0.32, k + 0.32], color=LIMIT, linewidth=2.5)
    panel.plot(q, np.arange(len(q)), marker="o", color=ORANGE, markersize=7, linestyle="none")
    panel.set_yticks(
        np.arange(len(joints)), [f"{k + 1}  {name}" for k, name in enumerate(joints)], fontsize=9
    )
    panel.invert_yaxis()
    panel.use_sticky_edges = False
    panel.margins(x=0.06)
    panel.set_title("range of each joint, and where it is", fontsize=10)
    panel.grid(alpha=0.25, axis="x")
