"""A picture of a loop of your own: the arm at a few instants, and curves of what you kept of its steps."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from ftqp.model.chain import frame_id
from ftqp.model.posture import places
from ftqp.model.robot import Robot
from ftqp.viz.figures.canvas import BLUE, GREY, ORANGE, RED, Axes, Figure, paper, save, tidy
from ftqp.viz.figures.events import look

INSTANTS = 6
"""So often the arm is drawn."""
FEW = 3
"""Up to so many curves are explained within the first panel that has them, more below the last one."""
WIDTH, ARM, PANEL, ALONE = 5.6, 3.0, 2.1, 3.0
"""Width, and heights of the arm, of a panel and of one alone [inches]: letters can be read on a phone."""
LETTERS = 46
"""So many of a title stand in a line."""
BARS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0)
"""Lengths of the bar that says how large the arm is [m]."""
OBLIQUE = np.array([[0.5, 0.87, 0.0], [-0.3, 0.17, 0.94]])
"""What is to the right and what is up in a view from the front, the left and above, in axes of the base."""


def draw_loop(
    path: str | Path,
    title: str,
    panels: Mapping[str, Mapping[str, tuple[Any, Any]]],
    *,
    x_label: str = "time [s]",
    logarithmic: Sequence[str] = (),
    styles: Mapping[str, str] | None = None,
    arm: tuple[Robot, Any] | None = None,
    fault: tuple[float, str] | None = None,
    edges: Any = None,
) -> Path:
    """Draw a motion that a loop of yours has made to a PNG file.

    Args:
        path: The file to write.
        title: Stands above the picture.
        panels: By the label of its axis, with the unit, the curves of each panel: by name, (x, y), each (K,).
        x_label: What x is, with its unit.
        logarithmic: Labels of panels whose axis is logarithmic.
        styles: Lines by the name of the curve, ``"-"``, ``"--"``, ``":"`` or ``"-."``, where readers expect
            certain ones; curves of a panel that begin with the same two words share a colour. None: by order.
        arm: The robot and its configurations, (K, nv): it is drawn at six instants. None: no arm.
        fault: When a joint failed, and how that is called; a line in every panel. None: no line.
        edges: Of what stands around the arm, their ends in the base's frame, (K, 2, 3) [m]. None: nothing.

    Raises:
        InputError: The file cannot be written.
    """
    many = max(map(len, panels.values())) > FEW
    height = 0.6 + (ALONE if len(panels) == 1 else PANEL * len(panels)) + (0.5 if many else 0.0)
    figure = paper(WIDTH, height + (0.0 if arm is None else ARM), fill(title, LETTERS))
    below: Any = figure
    if arm is not None:
        parts: Any = figure.subfigures(2, 1, height_ratios=[ARM, height])
        above, below = parts
        _draw_arm(above, *arm, np.zeros((0, 2, 3)) if edges is None else np.asarray(edges))
    axes = np.atleast_1d(below.subplots(len(panels), 1, sharex=True))
    named = dict[str, Any]()
    for panel, (label, lines) in zip(axes, panels.items(), strict=True):
        _draw_curves(panel, lines, fault, styles)
        tidy(panel, x_label if panel is axes[-1] else "", label)
        if label in logarithmic:
            panel.set_yscale("log")
        handles, names = panel.get_legend_handles_labels()
        new = {name: handle for name, handle in zip(names, handles, strict=True) if name not in named}
        if len(lines) > FEW:
            place = {"loc": "outside lower center", "ncols": 4}
            below.legend(handles, names, frameon=False, fontsize=9, **place)
        elif len(names) > 1 and new:
            named |= new
            panel.legend(new.values(), new.keys(), frameon=False, fontsize=9)
    return save(figure, path)


def _draw_curves(
    panel: Axes,
    lines: Mapping[str, tuple[Any, Any]],
    fault: tuple[float, str] | None,
    styles: Mapping[str, str] | None,
) -> None:
    """Curves, of a few the first ones wider so that later ones do not hide them."""
    few = len(lines) <= FEW
    families = list(dict.fromkeys(_family(name) for name in lines))
    for index, (name, (x, y)) in enumerate(lines.items()):
        colour, style = look(index)
        width = 1.6 + (1.6 * (len(lines) - 1 - index) if few else 0.0)
        if styles is not None:
            colour, style, width = look(families.index(_family(name)))[0], styles.get(name, "-"), 1.8
        panel.plot(x, y, color=colour, linestyle=style, linewidth=width, label=name)
    if fault is not None:
        panel.axvline(fault[0], color=RED, linewidth=1.2, linestyle="--", label=fault[1])


def _family(name: str) -> str:
    """The two words that curves of one joint share: ``"joint 4, locked"`` goes with ``"joint 4"``."""
    return " ".join(name.replace(",", " ").split()[:2])


def _draw_arm(figure: Figure, robot: Robot, q: Any, edges: Any) -> None:
    """The arm at its instants, the first faint, with the way of its tip; obliquely where it is not flat."""
    motion = np.asarray(q, dtype=np.float64)
    frame = frame_id(robot.model, robot.tip)
    few = motion[np.linspace(0, len(motion) - 1, INSTANTS).astype(int)]
    arms = [np.vstack([np.zeros(3), places(robot.model, frame, robot.configuration(one))[0]]) for one in few]
    way = np.array([robot.pose(one)[:3, 3] for one in motion[:: max(1, len(motion) // 400)]])
    flat = np.ptp(np.vstack([*arms, way])[:, 2]) < 1e-6
    view = np.eye(3)[:2] if flat else OBLIQUE
    panel = figure.subplots()
    for edge in edges:
        panel.plot(*(edge @ view.T).T, color=RED, linewidth=1.0)
    for k, points in enumerate(arms):
        share, at = (k + 1) / INSTANTS, points @ view.T
        for limb in robot.chain.limbs:
            panel.plot(*at[limb].T, color=GREY, linewidth=3.5, alpha=0.2 + 0.6 * share)
        panel.plot(*at[1:-1].T, "o", color=BLUE, markersize=4.5, alpha=share)
    last = arms[-1] @ view.T
    panel.plot(*last[0], marker="s", color="black", markersize=8)
    panel.plot(*(way @ view.T).T, color=ORANGE, linewidth=2.2)
    panel.plot(*last[-1], marker="*", color=ORANGE, markersize=13)
    panel.set_aspect("equal", adjustable="datalim")
    panel.margins(0.12)
    panel.set_axis_off()
    _draw_scale(panel)


def _draw_scale(panel: Axes) -> None:
    """A bar of 0.1 m, 0.2 m, 0.5 m or 1 m below the arm, at most a third as long as that is wide."""
    (left, right), (bottom, top) = panel.get_xlim(), panel.get_ylim()
    length = max((one for one in BARS if one <= 0.3 * (right - left)), default=BARS[0])
    height = bottom - 0.12 * (top - bottom)
    start = right - 0.05 * (right - left) - length
    panel.plot([start, start + length], [height, height], color="black", linewidth=2.0)
    panel.annotate(
        f"{length:g} m", (start + length / 2, height), (0, 4), textcoords="offset points", ha="center"
    )
