"""Pictures of studies: which failures a motion survives, and what survives a lock that nobody knows of."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.kernel.layout.enums import Survival
from ftqp.viz.figures.canvas import (
    BLUE,
    GREY,
    ORANGE,
    PURPLE,
    RED,
    SKY,
    WINE,
    YELLOW,
    Axes,
    Patch,
    legend_below,
    paper,
    save,
    tidy,
)

LOOKS = {
    Survival.SURVIVED: ("#DCEFE6", "survived"),
    Survival.LIMIT: (ORANGE, "position limit"),
    Survival.VELOCITY: (YELLOW, "too fast"),
    Survival.SINGULAR: (RED, "singular"),
    Survival.SINGULAR_VELOCITY: (PURPLE, "singular, speed limit first"),
    Survival.NOT_CONVERGED: (WINE, "no solution"),
    Survival.NOMINAL: (GREY, "motion outside limits"),
    Survival.ERROR: (BLUE, "error out of tolerance"),
    Survival.STRUCTURAL: ("#333333", "never tolerable"),
    Survival.TOO_NEAR: ("#7A5230", "too near to something"),
}
"""A colour and a few words for each verdict."""
JOINT = 0.36
"""Height of a joint [inches]."""


def draw_coverage(path: str | Path, report: Any) -> Path:
    """Draw a report on coverage to a PNG file: a row for each failure, its verdict over time as colour."""
    names = report.names
    edges = np.append(report.t, report.task.t[-1])
    title = f"{report.task.robot.name}: {100.0 * report.coverage:.1f} % of failures survived"
    figure = paper(9.0, 1.7 + JOINT * len(names), title)
    axes = figure.add_subplot()
    for row, verdicts in enumerate(report.status):
        for verdict in np.unique(verdicts):
            spans = [(edges[k], edges[k + 1] - edges[k]) for k in np.flatnonzero(verdicts == verdict)]
            axes.broken_barh(spans, (row - 0.42, 0.84), color=LOOKS[Survival(int(verdict))][0], linewidth=0.0)
    labels = [
        f"{name}  {100.0 * share:.0f} %" for name, share in zip(names, report.per_joint.values(), strict=True)
    ]
    axes.set_yticks(range(len(names)), labels)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_xlim(0.0, edges[-1])
    tidy(axes, "time of the failure [s]", "")
    axes.grid(False)
    if report.first_safe is not None and report.first_safe > 0.0:
        axes.axvline(report.first_safe, color=SKY, linewidth=2.0)
        early = report.first_safe < 0.5 * edges[-1]
        axes.annotate(
            "every failure is survived from here on", (report.first_safe, -0.5), fontsize=9, color="#3A8FC0",
            xytext=(4 if early else -4, 3), textcoords="offset points", ha="left" if early else "right",
        )  # fmt: skip
    found = [verdict for verdict in Survival if (report.status == verdict).any()]
    handles = [Patch(color=LOOKS[verdict][0], label=LOOKS[verdict][1]) for verdict in found]
    legend_below(figure, handles)
    return save(figure, path)


LETTERS = {
    "R": "share of the way on which the goal stays within reach",
    "F": "share of that from which the end effector gets there",
    "C": "share of the whole way from which the end effector gets there",
}
"""What each letter of a measure means."""
KINDS = {
    "100": "configurations\nwith all of it",
    "avg": "mean over\nconfigurations",
    "sens": "best minus worst\nconfiguration",
}
"""What each kind of measure means."""
PANEL = 2.5
"""Size of a panel [inches]."""


def save_maps(
    folder: Path,
    title: str,
    joints: Sequence[str],
    goal: FloatArray,
    arm: FloatArray | None,
    found: Mapping[str, FloatArray],
) -> list[Path]:
    """Draw one picture a letter: a row for each kind of measure, a column for each joint and for any.

    The last column of a measure is that of any joint. ``goal`` is (2,) or (3,) [m], ``arm`` the arm with its
    tip there, base to tip, (k, 2) or (k, 3) [m], None where it is not known. ``found`` has ``places`` on a
    grid, (P, 2) or in one plane (P, 3) [m], and measures like ``R100``, (P, n + 1) [percent].

    Source: Goel, Maciejewski and Balakrishnan 2005, Fig. 10.
    """
    shown = np.flatnonzero(np.ptp(found["places"], axis=0) > 0.0)[:2]
    flat = {**found, "places": found["places"][:, shown]}
    around = None if arm is None else arm[:, shown]
    about = (joints, ["xyz"[k] for k in shown], goal[shown], around, flat)
    return [
        _draw(folder / f"{letter}.png", f"{title}: {letter}, {meaning}", letter, *about)
        for letter, meaning in LETTERS.items()
        if f"{letter}100" in found
    ]


def _draw(
    path: Path, title: str, letter: str, joints: Sequence[str], axes: Sequence[str], goal: FloatArray,
    arm: FloatArray | None, found: Mapping[str, FloatArray],
) -> Path:  # fmt: skip
    """The picture of a letter."""
    rows = [kind for kind in KINDS if f"{letter}{kind}" in found]
    columns = [*(f"{joint} locks" for joint in joints), "any joint locks"]
    figure = paper(PANEL * len(columns) + 1.6, PANEL * len(rows) + 0.9, title)
    panels = figure.subplots(len(rows), len(columns), squeeze=False, sharex=True, sharey=True)
    image: Any = None
    for row, kind in enumerate(rows):
        for column, name in enumerate(columns):
            panel = panels[row, column]
            image = _panel(panel, found["places"], found[f"{letter}{kind}"][:, column], goal, arm)
            if row == 0:
                panel.set_title(name, fontsize=10)
            if row == len(rows) - 1:
                panel.set_xlabel(f"{axes[0]} of the start [m]")
            if column == 0:
                panel.set_ylabel(f"{letter}{kind}: {KINDS[kind]}\n\n{axes[1]} of the start [m]", fontsize=9)
    bar = figure.colorbar(image, ax=panels, shrink=0.9, pad=0.01)
    bar.set_label("percent; grey: no way to say")
    return save(figure, path)


def _panel(
    panel: Axes, places: FloatArray, values: FloatArray, goal: FloatArray, arm: FloatArray | None
) -> Any:
    """One measure over the grid, with the arm at its goal."""
    x, y = np.unique(places[:, 0]), np.unique(places[:, 1])
    image = np.full((len(y), len(x)), np.nan)
    at = np.searchsorted(y, places[:, 1]), np.searchsorted(x, places[:, 0])
    image[at] = values
    out = np.full(image.shape, np.nan)
    out[at] = 1.0
    panel.pcolormesh(x, y, out, cmap="Greys", vmin=0.0, vmax=4.0, shading="nearest")
    mesh = panel.pcolormesh(x, y, image, cmap="viridis", vmin=0.0, vmax=100.0, shading="nearest")
    if arm is not None:
        panel.plot(*arm.T, color="white", linewidth=4.5, solid_capstyle="round")
        panel.plot(*arm.T, color=GREY, linewidth=2.5, solid_capstyle="round", marker="o", markersize=4)
        panel.plot(*arm[0], marker="s", color="black", markersize=6, linestyle="none")
    panel.plot(*goal, marker="*", color=ORANGE, markeredgecolor="white", markersize=12, linestyle="none")
    panel.set_aspect("equal")
    return mesh
