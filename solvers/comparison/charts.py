"""Figures of the comparisons."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from bench.tables import exponent
from comparison.accuracy import INFEASIBLE, PARTS, SOLVABLE, Outcome

from ftqp.qp.answer_check import ACCEPTANCE
from ftqp.viz.figures.canvas import paper, save, tidy
from ftqp.viz.figures.palette import BLUE, GREEN, GREY, ORANGE, PURPLE, RED, SKY, YELLOW

LEAST = 1e-17
"""Where a residual of zero is drawn on a logarithmic axis."""
PALE = 0.6
"""Opacity of a coloured table, so that figures can be read on it."""
COLOURS = dict(
    zip((*SOLVABLE, *INFEASIBLE), (GREEN, YELLOW, RED, SKY, GREY, PURPLE, GREEN, GREY, RED), strict=True)
)
"""Green is right, red is a wrong claim."""


def draw_claims(names: Sequence[str], counts: dict[Outcome, list[int]], path: Path) -> Path:
    """Bars: what each contender said of solvable QPs and of infeasible ones."""
    figure = paper(12.0, 1.6 + 0.34 * len(names), "Claims against the truth, cold and warm starts together")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, group, title in zip(
        panels, (SOLVABLE, INFEASIBLE), ("QPs proven solvable", "QPs proven infeasible"), strict=True
    ):
        left = np.zeros(len(names))
        total = np.sum([counts[kind] for kind in group], axis=0)
        for kind in group:
            part = 100.0 * np.array(counts[kind]) / np.maximum(total, 1)
            axes.barh(names, part, left=left, color=COLOURS[kind], label=kind.value, height=0.72)
            left += part
        most = int(total.max(initial=0))
        tidy(
            axes, "share of answers [%]", "", f"{title} ({most} answers each)" if most else f"{title} (none)"
        )
        axes.set_xlim(0.0, 100.0)
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3, frameon=False, fontsize=9)
    panels[0].invert_yaxis()
    return save(figure, path)


def draw_residuals(names: Sequence[str], cells: list[dict[str, Any]], path: Path) -> Path:
    """Ranges from median to largest: each residual and the error of x, over answers claimed solved."""
    parts = (*PARTS, "error of x")
    figure = paper(
        15.0, 1.7 + 0.32 * len(names), "Answers claimed solved: median to largest, all solvable QPs"
    )
    for axes, part in zip(figure.subplots(1, len(parts), sharey=True), parts, strict=True):
        for row, name in enumerate(names):
            found = [
                spread
                for cell in cells
                if cell["contender"] == name
                and (spread := cell["error"] if part == "error of x" else cell["residuals"][part])
            ]
            if not found:
                continue
            middle = max(float(np.median([spread[0] for spread in found])), LEAST)
            worst = max(*(spread[1] for spread in found), LEAST)
            axes.plot([middle, worst], [row, row], color=BLUE, linewidth=2.0)
            axes.plot(middle, row, "o", color=BLUE, markersize=5)
            axes.plot(worst, row, "|", color=RED, markersize=11, markeredgewidth=2.2)
        axes.set_xscale("log")
        if part in PARTS:
            axes.axvline(ACCEPTANCE, color=ORANGE, linewidth=1.2, linestyle="--", zorder=0)
        axes.set_yticks(range(len(names)), names)
        tidy(axes, "relative, no unit", "", part)
    axes.invert_yaxis()
    handles = [
        axes.plot([], [], "o", color=BLUE, label="median")[0],
        axes.plot([], [], "|", color=RED, markersize=11, markeredgewidth=2.2, label="largest")[0],
        axes.plot([], [], "--", color=ORANGE, label=f"what counts as right, {exponent(ACCEPTANCE)}")[0],
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)
    return save(figure, path)


def draw_map(
    names: Sequence[str],
    sequences: Sequence[str],
    values: Sequence[Sequence[float | None]],
    title: str,
    path: Path,
    *,
    ratios: bool = False,
) -> Path:
    """A coloured table, contenders by sequences.

    Args:
        names: One a row.
        sequences: One a column.
        values: Percent, or ratios of times; None where there is none.
        title: What the figures are, with the unit.
        path: The file to write.
        ratios: The values are ratios and the colours logarithmic, green for small ones.
    """
    figure = paper(max(8.5, 2.6 + 0.62 * len(sequences)), 2.2 + 0.33 * len(names), title)
    axes = figure.subplots()
    table = np.array([[np.nan if value is None else value for value in row] for row in values], dtype=float)
    if ratios:
        with np.errstate(divide="ignore", invalid="ignore"):
            shown = np.log10(table)
        axes.imshow(shown, cmap="RdYlGn_r", aspect="auto", vmin=-1.0, vmax=3.0, alpha=PALE)
    else:
        axes.imshow(table, cmap="RdYlGn", aspect="auto", vmin=0.0, vmax=100.0, alpha=PALE)
    for i, row in enumerate(table):
        for j, value in enumerate(row):
            text = "" if np.isnan(value) else _cell(value, ratios)
            axes.text(j, i, text, ha="center", va="center", fontsize=8)
    axes.set_xticks(range(len(sequences)), sequences, rotation=40, ha="right", fontsize=9)
    axes.set_yticks(range(len(names)), names, fontsize=9)
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)
    return save(figure, path)


def _cell(value: float, ratio: bool) -> str:
    if ratio:
        return f"{value:.1f}" if value < 9.95 else f"{value:.0f}" if value < 999.5 else f"{value / 1e3:.0f}k"
    return f"{value:.0f}" if value in (0.0, 100.0) else f"{min(max(value, 1.0), 99.0):.0f}"


def draw_times(
    names: Sequence[str], sequences: Sequence[str], cells: list[dict[str, Any]], path: Path
) -> Path:
    """Median, 99 % and worst time of a solve, cold above warm, on a logarithmic axis."""
    figure = paper(10.5, 1.9 + 0.42 * len(names), "Time of one solve, sequences without infeasible QPs")
    axes = figure.subplots()
    for row, name in enumerate(names):
        for start, shift, colour in (("cold", -0.16, BLUE), ("warm", 0.16, ORANGE)):
            found = [
                cell
                for cell in cells
                if (cell["contender"], cell["start"]) == (name, start) and cell["sequence"] in sequences
            ]
            if not found:
                continue
            p50 = float(np.exp(np.mean(np.log([cell["p50"] for cell in found]))))
            p99 = max((cell["p99"] for cell in found if cell["p99"] is not None), default=None)
            worst = max(cell["worst"] for cell in found)
            axes.plot([p50, worst], [row + shift] * 2, color=colour, linewidth=0.8, alpha=0.7)
            if p99 is not None:
                axes.plot([p50, p99], [row + shift] * 2, color=colour, linewidth=3.5, alpha=0.55)
            axes.plot(p50, row + shift, "o", color=colour, markersize=5)
            axes.plot(worst, row + shift, "x", color=colour, markersize=5)
    axes.set_xscale("log")
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    tidy(axes, "time of one solve [us], logarithmic", "")
    handles = [
        axes.plot([], [], "s", color=BLUE, label="cold")[0],
        axes.plot([], [], "s", color=ORANGE, label="warm")[0],
        axes.plot([], [], "o", color=GREY, label="p50, geometric mean over sequences")[0],
        axes.plot([], [], "-", color=GREY, linewidth=3.5, label="to the largest p99")[0],
        axes.plot([], [], "x", color=GREY, label="worst")[0],
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=5, frameon=False)
    return save(figure, path)
