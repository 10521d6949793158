"""Draw the three figures of "How it works": the loop, one tick as a QP, and what the arm does in need.

    python docs/making/idea_figures.py

They are SVG with text of their own, legible on a phone. The points and ellipses of the QP are computed.
"""

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.patches import Ellipse, FancyArrowPatch, FancyBboxPatch, Rectangle

import ftqp

PICTURES = Path(__file__).parents[1] / "pictures"
INK, BLUE, RED, GREEN, GREY, PALE = "#1f2933", "#1f6feb", "#c62828", "#2e7d32", "#6b7280", "#eef2f7"
ROUND = "round,pad=0,rounding_size=0.08"
WEIGHTS, ROW, WANTED = np.array([1.0, 2.2]), np.array([0.75, 1.0]), 0.62
"""Of the QP that is drawn: the objective's weights, the task's row J, and the velocity that it asks for."""
LEAST, MOST = np.array([-0.9, -0.8]), np.array([1.0, 0.8])
"""... and the bounds of the two joint velocities [rad/s]."""


def box(axes: Any, at: tuple[float, float], size: tuple[float, float], text: str, colour: str = INK) -> None:
    """A box of a size about a place, with words in it."""
    x, y = at[0] - size[0] / 2, at[1] - size[1] / 2
    shape = FancyBboxPatch(
        (x, y), *size, boxstyle="round,pad=0,rounding_size=0.08", fc=PALE, ec=colour, lw=1.6
    )
    axes.add_patch(shape)
    head, _, rest = text.partition("\n")
    axes.text(
        at[0], at[1] + (0.14 if rest else 0.0), head, ha="center", va="center", weight="bold", color=colour
    )
    axes.text(at[0], at[1] - 0.2, rest, ha="center", va="center", color=INK, size=10.5)


def arrow(axes: Any, begin: tuple[float, float], end: tuple[float, float], **look: Any) -> None:
    """An arrow from one place to another."""
    look = {
        "color": INK,
        "lw": 1.5,
        "arrowstyle": "-|>",
        "mutation_scale": 14,
        "shrinkA": 0,
        "shrinkB": 0,
    } | look
    axes.add_patch(FancyArrowPatch(begin, end, **look))


def empty(width: float, height: float) -> tuple[Any, Any]:
    """A figure whose unit is an inch, and its axes."""
    figure = plt.figure(figsize=(width, height))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0.0, width), ylim=(0.0, height))
    axes.axis("off")
    return figure, axes


def loop() -> Any:
    """From the target to the arm and back."""
    figure, axes = empty(7.0, 6.3)
    left, right, size = 1.3, 5.6, (2.3, 0.88)
    box(axes, (left, 5.75), size, "your target\na pose, each cycle")
    box(axes, (left, 4.4), size, "planner\none QP: joint motion", BLUE)
    box(axes, (left, 3.05), size, "compensation\nof lag and sag", BLUE)
    box(axes, (left, 1.75), size, "gate\nfinite, within limits", BLUE)
    box(axes, (left, 0.5), size, "servos\nof your arm")
    box(axes, (right, 0.5), size, "arm\na joint may fail", RED)
    box(axes, (right, 2.5), size, "observer\nestimates each servo", BLUE)
    box(axes, (right, 4.4), size, "detector\nwhich joint has failed?", BLUE)
    box(axes, (right, 5.75), size, "your report\noptional")
    for above, below in ((5.31, 4.84), (3.96, 3.49), (2.61, 2.19), (1.31, 0.94)):
        arrow(axes, (left, above), (left, below))
    near, far = left + 1.15, right - 1.15
    arrow(axes, (near, 0.5), (far, 0.5))
    arrow(axes, (right, 0.94), (right, 2.06))
    axes.text(right + 0.1, 1.5, "encoders", va="center", size=11)
    arrow(axes, (right, 2.94), (right, 3.96))
    axes.text(right + 0.1, 3.45, "what servos do\nnot explain", va="center", size=11)
    arrow(axes, (far, 4.4), (near, 4.5), color=RED)
    axes.text(3.45, 4.6, "failed joint", ha="center", color=RED, size=11)
    arrow(axes, (far, 5.75), (near, 4.75), color=RED)
    arrow(axes, (far, 2.7), (near, 4.2))
    axes.text(4.05, 3.55, "where the\narm is", ha="center", va="center", size=11)
    arrow(axes, (far, 2.4), (near, 3.0))
    axes.text(3.3, 2.35, "lag, sag,\nfriction", ha="center", va="center", size=11)
    return figure


def answer(locked: bool) -> Any:
    """The joint velocities that the QP chooses, (2,) [rad/s]."""
    low, high = LEAST.copy(), MOST.copy()
    if locked:
        low[1] = high[1] = 0.0
    problem = ftqp.QP(np.diag(WEIGHTS), np.zeros(2), A=ROW[None], b=[WANTED], lb=low, ub=high)
    return ftqp.qp.solve(problem).x


def tick() -> Any:
    """One tick as a QP of two joints, before and after the second one locks."""
    figure, parts = plt.subplots(1, 2, figsize=(7.2, 4.3), sharey=True)
    for axes, locked in zip(parts, (False, True), strict=True):
        x = answer(locked)
        level = np.sqrt(x @ (WEIGHTS * x))
        for share in (0.45, 1.0, 1.6):
            across = 2.0 * share * level / np.sqrt(WEIGHTS)
            dense = share == 1.0
            axes.add_patch(Ellipse((0, 0), *across, fc="none", ec=GREY, lw=1.4 if dense else 0.8, alpha=0.9))
        if locked:
            axes.add_patch(Rectangle(LEAST, *(MOST - LEAST), fc="none", ec=GREY, ls=":", lw=1.2))
            axes.plot([LEAST[0], MOST[0]], [0.0, 0.0], color=RED, lw=5.0, solid_capstyle="round", alpha=0.75)
        else:
            axes.add_patch(Rectangle(LEAST, *(MOST - LEAST), fc=BLUE, ec=BLUE, alpha=0.13))
            axes.add_patch(Rectangle(LEAST, *(MOST - LEAST), fc="none", ec=BLUE, lw=1.8))
        along = np.array([-1.3, 1.4])
        axes.plot(along, (WANTED - ROW[0] * along) / ROW[1], color=GREEN, lw=2.2)
        axes.plot(*x, "o", color=INK, ms=10, zorder=5)
        axes.set(xlim=(-1.25, 1.45), ylim=(-1.15, 1.3), xlabel="velocity of joint 1", aspect="equal")
        axes.set_title("joint 2 has locked" if locked else "every joint works", weight="bold", size=13)
        axes.set_xticks([])
        axes.set_yticks([])
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    parts[0].set_ylabel("velocity of joint 2")
    parts[0].text(-0.12, 1.02, "task: J v = b", color=GREEN)
    parts[0].text(-0.85, -0.74, "limits", color=BLUE)
    parts[0].text(0.0, -0.545, "effort", color=GREY, ha="center", va="center")
    parts[1].text(-1.1, -1.05, "limits: only this segment", color=RED)
    parts[1].text(answer(True)[0] - 0.04, -0.2, "command", color=INK, ha="right")
    arrow(parts[1], (-0.55, -0.93), (-0.55, -0.06), color=RED)
    parts[0].text(answer(False)[0] + 0.08, answer(False)[1] + 0.06, "command", color=INK)
    figure.tight_layout()
    return figure


CASCADE = (
    ("OK", "the task is met", "follows it", GREEN),
    ("SCALED", "the path is too fast", "goes along it more slowly", BLUE),
    ("RELAXED", "a limit is in the way", "makes the nearest motion", BLUE),
    ("LAGGING", "the arm is behind", "the path waits", BLUE),
    ("HELD", "all joints stand", "waits to be released", BLUE),
    ("FALLBACK", "the solver has no answer", "comes to rest, within the box", RED),
    ("INVALID_INPUT", "an impossible measurement", "goes on by what is expected", RED),
    ("STOPPING", "an error grew too large", "brakes within its limits", RED),
    ("STOPPED", "at rest", "holds, until you resume", RED),
)
"""Status, what has happened, and what the arm does, from the task as asked to the stop."""


def cascade() -> Any:
    """What the arm does when less and less is possible."""
    height = 0.62 * len(CASCADE) + 0.55
    figure, axes = empty(7.0, height)
    for x, head in ((0.15, "what has happened"), (2.5, "status"), (4.25, "what the arm does")):
        axes.text(x, height - 0.25, head, color=GREY, va="center")
    for k, (status, why, then, colour) in enumerate(CASCADE):
        y = height - 0.75 - 0.62 * k
        shape = FancyBboxPatch((2.45, y - 0.2), 1.6, 0.4, boxstyle=ROUND, fc=PALE, ec=colour, lw=1.6)
        axes.add_patch(shape)
        axes.text(3.25, y, status, ha="center", va="center", weight="bold", color=colour, size=11)
        axes.text(0.15, y, why, va="center", size=11)
        axes.text(4.25, y, then, va="center", size=11)
        if k:
            arrow(axes, (3.25, y + 0.42), (3.25, y + 0.21), color=GREY, lw=1.2)
    return figure


FIGURES = {"how-it-works-loop": loop, "how-it-works-tick": tick, "how-it-works-cascade": cascade}


def main() -> None:
    """Draw all of them."""
    mpl.rcParams.update({"svg.fonttype": "none", "font.family": "sans-serif", "font.size": 12.0})
    mpl.rcParams.update({"svg.hashsalt": "ftqp", "axes.edgecolor": GREY, "axes.labelcolor": INK})
    mpl.rcParams["font.sans-serif"] = ["DejaVu Sans", "Verdana", "Arial"]
    for name, draw in FIGURES.items():
        figure = draw()
        figure.savefig(PICTURES / f"{name}.svg", metadata={"Date": None})
        plt.close(figure)


if __name__ == "__main__":
    main()
