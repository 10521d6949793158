"""Figures of study_dtrnn."""

from pathlib import Path
from typing import Any

import numpy as np
from comparison.dtrnn_study import JUMPING, METHODS, PRODUCT, SCALED, cells

from ftqp.viz.figures.canvas import Axes, Line2D, Patch, legend_below, paper, save, tidy
from ftqp.viz.figures.palette import BLUE, GREEN, GREY, ORANGE, PURPLE, RED, SKY, WINE  # fmt: skip

COLOURS = dict(zip(METHODS, (BLUE, SKY, ORANGE, GREEN, RED, WINE), strict=True))
DASHED = "e47"
"""Lies on 94lvi nearly everywhere and is drawn so that both are seen."""
LABELS = {PRODUCT: "product mode (a whole jump is one iteration)"}
MEASURES = {
    "residual": "residual |e| of the network [-]",
    "r_eq": "max |Ax - b| [rad/s² or m/s²]",
    "gap": "duality gap, bounds f(x) - f* [-]",
}
LEAST = 1e-16
"""What a smaller number is drawn as on a logarithmic axis."""
SWEPT = {"s": "objective scale s / rule", "q": "row scale q / rule", "gamma": "step size gamma"}
PALETTE = (BLUE, ORANGE, GREEN, RED, PURPLE, GREY)


def figures(result: dict[str, Any], folder: Path, stem: str) -> list[Path]:
    """Those of the parts that were measured."""
    made = {"traces": draw_traces, "conditions": draw_conditions, "scales": draw_scales, "loop": draw_loop}
    return [made[name](result, folder / f"{stem}-{name}.png") for name in result["figures"]]


def _handles() -> list[Any]:
    return [
        Line2D(
            [],
            [],
            color=COLOURS[method],
            linewidth=2.0,
            linestyle="--" if method == DASHED else "-",
            label=LABELS.get(method, method),
        )
        for method in METHODS
    ]


def draw_traces(result: dict[str, Any], path: Path) -> Path:
    """|e|, r_eq and gap against the iteration, a column a QP; jumps are marked."""
    traces = result["traces"]
    names = list(dict.fromkeys(trace["sequence"] for trace in traces))
    figure = paper(11.5, 10.0, "How the network converges on two recorded QPs, from zero")
    panels = figure.subplots(3, len(names), sharex="col", squeeze=False)
    for column, name in enumerate(names):
        for row, (measure, label) in enumerate(MEASURES.items()):
            axes: Axes = panels[row][column]
            for trace in traces:
                if trace["sequence"] == name:
                    _trace(axes, trace, measure)
            axes.set_xscale("log")
            axes.set_yscale("log")
            about = next(trace["about"] for trace in traces if trace["sequence"] == name)
            below = "iteration (the start is drawn at 0.5)" if row == 2 else ""
            title = f"{name}, tick {about['tick']}\n{about['text']}" if row == 0 else ""
            tidy(axes, below, label if column == 0 else "", title)
    for axes in panels[0]:
        axes.axhline(1e-5, color=GREY, linewidth=1.0, linestyle=":", zorder=0)
    legend_below(
        figure,
        [
            *_handles(),
            Line2D(
                [],
                [],
                color=GREY,
                marker="o",
                linestyle="",
                markersize=7,
                label="end of an accepted Newton jump",
            ),
            Line2D([], [], color=GREY, linestyle=":", label="|e| = 1e-5, where the paper stops"),
        ],
    )
    return save(figure, path)


def _trace(axes: Axes, trace: dict[str, Any], measure: str) -> None:
    """One line; a dot where a jump ended."""
    method = trace["method"]
    k = np.maximum(np.array(trace["iteration"], dtype=float), 0.5)
    y = np.array([np.nan if v is None else max(v, LEAST) for v in trace[measure]], dtype=float)
    colour, dashes = COLOURS[method], "--" if method == DASHED else "-"
    front = {JUMPING: 4, PRODUCT: 5}.get(method, 3)
    axes.plot(k, y, dashes, color=colour, linewidth=1.6, zorder=front)
    jumped = np.isin(trace["iteration"], np.array(trace["jumps"]) + 1)
    axes.plot(k[jumped], y[jumped], "o", color=colour, markersize=6, zorder=front)


def draw_conditions(result: dict[str, Any], path: Path) -> Path:
    """Iterations against condition, active bounds and tolerance, until it stops and until x is right."""
    figure = paper(13.0, 9.0, "Random QPs, 7 variables, 3 equalities, from zero: median iterations")
    panels = figure.subplots(2, 3)
    for row, key in enumerate(("stop", "right")):
        what = "until the variant stops" if key == "stop" else "until x is right to 1e-5"
        for column, (part, label, title) in enumerate(
            (
                ("condition", "condition of W [-]", "one active bound"),
                ("active", "active bounds (4 degrees of freedom)", "condition 1e3"),
            )
        ):
            axes = panels[row][column]
            for method in METHODS:
                found = cells(result, part, method=method)
                y = [cell["median"] if key == "stop" else cell["right"][0] for cell in found]
                _line(axes, [cell["at"] for cell in found], y, [cell["cap"] for cell in found], method)
            if part == "condition":
                axes.set_xscale("log")
            else:
                axes.set_xticks(range(5))
            axes.set_yscale("log")
            tidy(axes, label, f"iterations {what}" if column == 0 else "", title)
    for row, value in enumerate(("iterations until |e| <= tolerance", "median error max |x - x*| left [-]")):
        axes = panels[row][2]
        for method in METHODS:
            found = cells(result, "tolerance", method=method)
            y = [cell["median"] if row == 0 else max(cell["error"][0], LEAST) for cell in found]
            _line(axes, [cell["at"] for cell in found], y, [np.inf] * len(found), method)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.invert_xaxis()
        tidy(axes, "tolerance of |e| [-]", value, "condition 1e3, one active bound")
    cross = Line2D(
        [],
        [],
        color=GREY,
        marker="x",
        linestyle="",
        markersize=8,
        label="half or more took over 20000 (product: 2000)",
    )
    legend_below(figure, [*_handles(), cross])
    return save(figure, path)


def _line(axes: Axes, x: Any, y: Any, cap: Any, method: str) -> None:
    """One variant; crosses where the median is the cap."""
    x, y, at_cap = np.array(x), np.array(y), np.array(y) >= np.array(cap)
    axes.plot(x, y, "--" if method == DASHED else "-", color=COLOURS[method], linewidth=1.8)
    axes.plot(x[~at_cap], y[~at_cap], "o", color=COLOURS[method], markersize=3.5)
    axes.plot(x[at_cap], y[at_cap], "x", color=COLOURS[method], markersize=8, markeredgewidth=2.0)


def draw_scales(result: dict[str, Any], path: Path) -> Path:
    """Iterations of ``implicit`` against s, q and gamma."""
    figure = paper(
        13.0, 5.2, "Method implicit on recorded QPs, from zero: median iterations until x is right to 1e-5"
    )
    names = list(dict.fromkeys(cell["sequence"] for cell in cells(result, "sweep")))
    for axes, (what, label) in zip(figure.subplots(1, 3, sharey=True), SWEPT.items(), strict=True):
        for name, colour in zip(names, PALETTE, strict=False):
            found = cells(result, "sweep", sequence=name, what=what)
            x, y = np.array([c["at"] for c in found]), np.array([c["median"] for c in found])
            at_cap = y >= np.array([c["cap"] for c in found])
            axes.plot(x, y, "-", color=colour, linewidth=1.8)
            axes.plot(x[~at_cap], y[~at_cap], "o", color=colour, markersize=3.5)
            axes.plot(x[at_cap], y[at_cap], "x", color=colour, markersize=8, markeredgewidth=2.0)
        axes.axvline(1.6 if what == "gamma" else 1.0, color=GREY, linestyle=":", linewidth=1.4, zorder=0)
        axes.set_xscale("linear" if what == "gamma" else "log")
        axes.set_yscale("log")
        tidy(axes, label, "iterations" if what == "s" else "")
    handles = [Line2D([], [], color=c, linewidth=2.0, label=n) for n, c in zip(names, PALETTE, strict=False)]
    handles.append(Line2D([], [], color=GREY, linestyle=":", label="the rule"))
    handles.append(Line2D([], [], color=GREY, marker="x", linestyle="", label="half or more took over 5000"))
    legend_below(figure, handles)
    return save(figure, path)


def draw_loop(result: dict[str, Any], path: Path) -> Path:
    """DLSM on the square: iterations over time, and boxes of every variant, warm beside cold."""
    figure = paper(13.0, 5.4, "The square of Jin et al. 2017 with DLSM, joint 1 locks at 15 s")
    left, right = figure.subplots(1, 2)
    shades = {"cold": BLUE, "warm": ORANGE}
    for start, colour in shades.items():
        (cell,) = cells(result, "square", objective="DLSM", method=SCALED, start=start)
        t = np.arange(len(cell["series"])) * 0.1
        left.plot(t, np.maximum(cell["series"], 1), "-", color=colour, linewidth=1.2)
    left.axvline(15.0, color=RED, linestyle="--", linewidth=1.2)
    left.text(15.2, 0.98, "joint 1 locks", color=RED, va="top", transform=left.get_xaxis_transform())
    left.set_yscale("log")
    tidy(left, "time [s]", "iterations", "implicit + scaling, |e| <= 1e-5, every tenth tick")
    for i, method in enumerate(METHODS):
        for start, shift in (("cold", -0.2), ("warm", 0.2)):
            (cell,) = cells(result, "square", objective="DLSM", method=method, start=start)
            low, q1, middle, q3, high = (max(value, 1.0) for value in cell["box"])
            box = {"med": middle, "q1": q1, "q3": q3, "whislo": low, "whishi": high}
            right.bxp(
                [box],
                positions=[i + shift],
                widths=0.32,
                showfliers=False,
                patch_artist=True,
                boxprops={"facecolor": shades[start], "alpha": 0.75},
                medianprops={"color": "black"},
            )
    right.set_yscale("log")
    right.set_xticks(range(len(METHODS)), [m.replace(" + ", "\n+ ") for m in METHODS], fontsize=9)
    right.set_xlim(-0.6, len(METHODS) - 0.4)
    tidy(right, "", "iterations", "box: half of all ticks; line: median; whiskers: least and largest")
    handles = [
        Patch(facecolor=BLUE, alpha=0.75, label="cold: every solve from zero"),
        Patch(facecolor=ORANGE, alpha=0.75, label="warm: from the answer of the tick before"),
    ]
    legend_below(figure, handles)
    return save(figure, path)
