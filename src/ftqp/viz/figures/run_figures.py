"""Figures of one run: arm, path and error, joints, velocities, torques, and the ribbon of its statuses."""

from collections.abc import Callable, Mapping
from pathlib import Path
from textwrap import wrap

import numpy as np

from ftqp.control.planner.status import STATUSES
from ftqp.core.checks import IntArray
from ftqp.core.errors import InputError, unknown
from ftqp.core.picture import Picture
from ftqp.faults.kinds import KINDS
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.metrics import is_sensed
from ftqp.sim.log.signals import CONDITIONS, HEALTHY, refuse_unknown_conditions
from ftqp.viz.figures import error_figures as errors
from ftqp.viz.figures import events
from ftqp.viz.figures import joint_figures as joints
from ftqp.viz.figures.canvas import (
    BLUE,
    GREEN,
    GREY,
    LETTER,
    ORANGE,
    PURPLE,
    RED,
    SAMPLE,
    SKY,
    YELLOW,
    Axes,
    Patch,
    equal_runs,
    legend_below,
    made_folder,
    paper,
    picture_of,
    save,
    tidy,
)  # fmt: skip

WIDTH = 12.0
"""Of the figure [inches]."""
COLOURS = {
    "OK": GREEN,
    "RELAXED": YELLOW,
    "SCALED": SKY,
    "FALLBACK": PURPLE,
    "STOPPING": ORANGE,
    "STOPPED": "black",
    "INVALID_INPUT": RED,
    "HELD": BLUE,
}
STATUS_COLOURS = tuple(COLOURS.get(status.name, GREY) for status in STATUSES)
"""Colours of the statuses, in the order of their codes."""
CONDITION_COLOURS = {HEALTHY: "#DDEEE6", **{kind.number: kind.colour for kind in KINDS.values()}}
"""Colours of joints by the codes of their conditions."""
THINNEST = 0.002
"""Spells shorter than this share of the time are widened to it, so that a single step is seen."""


def draw_statuses(log: Log, path: str | Path) -> Path:
    """Draw the ribbon to a PNG file."""
    failing = sorted({fault["index"] for fault in events.faults(log)})
    seen = [int(code) for code in np.unique(log["status"])]
    ribbons: list[tuple[str, IntArray]] = []
    for i in failing:
        name, truth, belief = log.metadata["joints"][i], log["truth"][:, i], log["belief"][:, i]
        if np.array_equal(truth, belief):
            ribbons.append((f"{name}, really and as believed", truth))
        else:
            ribbons += [(f"{name}, really", truth), (f"{name}, as the planner believes", belief)]
    title = f"Status of every step: {events.heading(log)}"
    names = max((len(label) for label, _ in ribbons), default=0)
    room = int((WIDTH - SAMPLE) / LETTER) - names
    sentences = {code: wrap(f"{STATUSES[code].name}: {STATUSES[code].value}", room) for code in seen}
    lines = sum(len(words) for words in sentences.values())
    figure = paper(WIDTH, 2.6 + 0.45 * len(ribbons) + 0.25 * lines, title)
    axes = figure.add_subplot()
    spells(axes, log, log["status"], 0.0, dict(enumerate(STATUS_COLOURS)))
    labels, places = ["planner's status"], [0.0]
    for label, codes in ribbons:
        places.append(places[-1] + (1.3 if len(places) == 1 else 1.0))
        labels.append(label)
        spells(axes, log, codes, places[-1], CONDITION_COLOURS)
    tidy(axes, "time [s]", "")
    axes.set_yticks(places, labels)
    axes.set_ylim(max(places) + 0.6, -0.6)
    axes.set_xlim(*events.time_span(log))
    events.mark(axes, log)
    handles = [Patch(color=STATUS_COLOURS[code], label="\n".join(words)) for code, words in sentences.items()]
    axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False, fontsize=9)
    shown = sorted({int(code) for _, codes in ribbons for code in np.unique(codes)})
    meanings = [
        Patch(color=CONDITION_COLOURS.get(code, GREY), label=f"joint {CONDITIONS[code]}") for code in shown
    ]
    legend_below(figure, [*meanings, *events.handles(log)])
    return save(figure, path)


def spells(axes: Axes, log: Log, codes: IntArray, place: float, colours: Mapping[int, str]) -> None:
    """One bar for every spell of equal codes; rare ones on top and wide enough to be seen."""
    t = log["t"]
    edges = np.append(t, t[-1] + (t[1] - t[0] if len(t) > 1 else 1.0))
    thinnest = THINNEST * (float(t[-1] - t[0]) or 1.0)
    found = [(float(edges[first]), float(edges[last]), code) for first, last, code in equal_runs(codes)]
    for start, end, code in sorted(found, key=lambda spell: spell[0] - spell[1]):
        width = max(end - start, thinnest)
        axes.broken_barh([(start, width)], (place - 0.4, 0.8), facecolors=colours.get(code, GREY))


DRAWINGS = {
    "path.png": errors.draw_path,
    "tasks.png": errors.draw_further,
    "joints.png": joints.draw_positions,
    "velocities.png": joints.draw_velocities,
    "following.png": joints.draw_following,
    "torques.png": joints.draw_torques,
    "status.png": draw_statuses,
    "base.png": errors.draw_base,
}
"""The figures of a run by file name."""


def save_figures(log: Log, folder: str | Path) -> list[Path]:
    """Draw all figures of a run as PNG files into ``folder``, which is made if it is missing."""
    if not len(log):
        raise InputError(f"log {log.path} has no rows, expected at least one to draw")
    for name in ("truth", "belief"):
        refuse_unknown_conditions(log[name], log.title)
    place = made_folder(folder)
    return [draw(log, place / name) for name, draw in drawings_of(log).items()]


def drawings_of(log: Log) -> dict[str, Callable[[Log, Path], Path]]:
    """The figures that a run has, by file name."""
    absent = {"following.png": not is_sensed(log), "base.png": "base_status" not in log}
    absent["tasks.png"] = not errors.further_panels(log)
    absent["torques.png"] = not np.isfinite(log["tau"]).any()
    return {name: draw for name, draw in DRAWINGS.items() if not absent.get(name, False)}


def run_picture(log: Log, figure: str = "path") -> Picture:
    """One of the figures of a run."""
    if not len(log):
        raise InputError(f"log {log.title} has no rows, expected at least one to draw")
    drawings = {name.removesuffix(".png"): draw for name, draw in drawings_of(log).items()}
    if figure not in drawings:
        raise unknown("figure", figure, "this run", list(drawings))
    return picture_of(lambda file: drawings[figure](log, file), f"{figure} of {log.title}")
