"""Two pictures of a campaign: how far the tip was off under OK, and which drawn values broke laws."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ftqp.viz.figures.canvas import BLUE, GREY, RED, paper, save, tidy

BINS = 40
LEAST = 1e-9
"""Errors below this count as this [m]."""
ROW = 0.22
"""Height of a value [inches]."""
LONGEST = 34
"""Letters of a value that are shown."""

Shares = Mapping[str, Sequence[tuple[str, int, int, tuple[float, float]]]]
"""Of each key: value, episodes, broken ones, and the interval of their share."""


def draw_ok_errors(path: str | Path, errors: Sequence[float], title: str) -> Path:
    """Draw how many episodes had which largest error of the tip while OK was claimed.

    ``errors`` holds that of each episode [m].
    """
    logs = np.log10(np.maximum(np.array(errors, dtype=np.float64), LEAST)) + 3.0
    figure = paper(9.0, 3.2, title)
    axes = figure.add_subplot()
    low, high = np.floor(logs.min()), np.ceil(logs.max())
    axes.hist(logs, bins=np.linspace(low, max(high, low + 1.0), BINS + 1).tolist(), color=BLUE)
    ticks = np.arange(low, max(high, low + 1.0) + 0.5)
    axes.set_xticks(ticks.tolist(), [f"1e{int(tick)}" for tick in ticks])
    tidy(axes, "largest error of the tip under OK [mm]", "episodes")
    return save(figure, path)


def draw_shares(path: str | Path, shares: Shares, title: str) -> Path:
    """Draw the share of episodes that broke a law for each value of each key, with its interval."""
    count = sum(len(values) for values in shares.values())
    figure = paper(9.0, 1.3 + ROW * count + 0.45 * (len(shares) - 1), title)
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
