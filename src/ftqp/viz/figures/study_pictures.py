"""Pictures of studies: which failures a motion survives, and how episodes of a campaign went."""

from collections.abc import Mapping, Sequence
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


BINS = 40
LEAST = 1e-9
"""Errors below this count as this [m]."""
LONGEST = 34
"""Letters of a value that are shown."""

Shares = Mapping[str, Sequence[tuple[str, int, int, tuple[float, float]]]]
"""Of each key: value, episodes, broken ones, and the interval of their share."""


def draw_ok_errors(path: str | Path, errors: Sequence[float], title: str) -> Path:
    """Draw how many episodes had which largest error of the tip while OK was claimed."""
    logs = np.log10(np.maximum(np.array(errors, dtype=np.float64), LEAST)) + 3.0
    figure = paper(9.0, 3.2, title)
    axes = figure.add_subplot()
    low, high = np.floor(logs.min()), np.ceil(logs.max())
    axes.hist(logs, bins=np.linspace(low, max(high, low + 1.0), BINS + 1).tolist(), color=BLUE)
    ticks = np.arange(low, max(high, low + 1.0) + 0.5)
    axes.set_xticks(ticks.tolist(), [f"1e{int(tick)}" for tick in ticks])
    tidy(axes, "largest error of the end effector under OK [mm]", "episodes")
    return save(figure, path)


def draw_shares(path: str | Path, shares: Shares, title: str) -> Path:
    """Draw the share of episodes that broke a law for each value of each key, with its interval."""
    count = sum(len(values) for values in shares.values())
    figure = paper(9.0, 1.3 + VALUE * count + 0.45 * (len(shares) - 1), title)
    grid = figure.add_gridspec(len(shares), 1, height_ratios=[len(values) for values in shares.values()])
    widest = 100.0 * max((interval[1] for values in shares.values() for *_, interval in values), default=0.01)
    for at, (key, values) in enumerate(shares.items()):
        axes = figure.add_subplot(grid[at])
        for row, (_, episodes, broken, interval) in enumerate(values):
            share, (low, high) = 100.0 * broken / max(episodes, 1), (100.0 * end for end in interval)
            axes.plot([low, high], [row, row], color=RED if broken else GREY, linewidth=2.0, alpha=0.5)
            axes.plot([share], [row], marker="o", markersize=4.0, color=RED if broken else GREY)
        axes.set_yticks(range(len(values)), [_short(value) for value, *_ in values], fontsize=8)
        axes.set_ylim(len(values) - 0.5, -0.5)
        axes.set_xlim(0.0, 1.05 * widest)
        if at < len(shares) - 1:
            axes.tick_params(labelbottom=False)
        axes.set_title(key, loc="left", fontsize=10)
        tidy(axes, "broke a law [%]" if at == len(shares) - 1 else "", "")
    return save(figure, path)


def _short(value: str) -> str:
    return value if len(value) <= LONGEST else f"{value[: LONGEST - 3]}..."
