"""Pictures of studies: which failures a motion survives, and how episodes of a campaign went."""

from pathlib import Path
from typing import Any

import numpy as np

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
JOINT, VALUE = 0.36, 0.22
"""Height of a joint and of a value [inches]."""


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
