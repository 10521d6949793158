"""Tables for the cells of notebooks, and small pictures for them, as SVG; they need no package."""

from collections.abc import Sequence
from html import escape

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray

WIDTH, HEIGHT, EDGE = 260, 110, 6
"""Size of a picture and of the margin around what is drawn [pixels]."""
POINTS = 150
"""A curve is thinned to about so many points: more are not seen at this size."""
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#888888")
FIELDS = ("#f0b0a0", "#bfe3d0")
"""Of a stretch that is not good, and of one that is."""
_CELL = 'style="text-align:{};padding:1px 8px"'


def html_table(
    title: str, headings: Sequence[str], rows: Sequence[Sequence[object]], note: str = "", picture: str = ""
) -> str:
    """A titled table; the first column is text, the others are numbers or short words."""

    def line(tag: str, cells: Sequence[object]) -> str:
        sides = ["left", *["right"] * (len(cells) - 1)]
        return "".join(
            f"<{tag} {_CELL.format(side)}>{escape(str(cell))}</{tag}>"
            for side, cell in zip(sides, cells, strict=True)
        )

    head = f"<tr>{line('th', headings)}</tr>" if headings else ""
    body = "".join(f"<tr>{line('td', row)}</tr>" for row in rows)
    below = f"<div>{escape(note)}</div>" if note else ""
    return f"<div><b>{escape(title)}</b></div><table>{head}{body}</table>{picture}{below}"


def curves_svg(
    curves: Sequence[tuple[FloatArray, FloatArray]], says: str, *, true_to_scale: bool = False
) -> str:
    """Curves in one frame.

    Args:
        curves: x and y of each, (K,); what is not finite is left out.
        says: What is seen and its extent; it stands below.
        true_to_scale: Whether x and y have one scale, as lengths in space need.
    """
    kept = []
    for x, y in curves:
        x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
        good = np.isfinite(x) & np.isfinite(y)
        step = max(1, int(good.sum()) // POINTS)
        kept.append(np.stack([x[good], y[good]])[:, ::step])
    every = np.concatenate(kept, axis=1) if kept else np.zeros((2, 0))
    if every.shape[1] == 0:
        return ""
    low, span = every.min(axis=1), np.maximum(np.ptp(every, axis=1), 1e-12)
    room = np.array([WIDTH - 2 * EDGE, HEIGHT - 2 * EDGE])
    scale = np.full(2, np.min(room / span)) if true_to_scale else room / span
    drawn = []
    for k, points in enumerate(kept):
        x, y = (points - low[:, None]) * scale[:, None]
        text = " ".join(f"{EDGE + a:.1f},{HEIGHT - EDGE - b:.1f}" for a, b in zip(x, y, strict=True))
        drawn.append(
            f'<polyline fill="none" stroke="{COLOURS[k % len(COLOURS)]}" stroke-width="1.5" points="{text}"/>'
        )
    return _framed("".join(drawn), HEIGHT, says)


def strips_svg(rows: BoolArray, says: str) -> str:
    """A strip a row, green where it is true, (rows, K), above what is seen."""
    rows = np.asarray(rows, dtype=np.bool_)
    if rows.size == 0:
        return ""
    high, wide = 12, (WIDTH - 2 * EDGE) / rows.shape[1]
    drawn = []
    for i, row in enumerate(rows):
        starts = np.flatnonzero(np.r_[True, row[1:] != row[:-1]])
        for at, end in zip(starts, np.r_[starts[1:], len(row)], strict=True):
            drawn.append(
                f'<rect x="{EDGE + at * wide:.1f}" y="{EDGE + i * high}" width="{(end - at) * wide:.1f}" '
                f'height="{high - 2}" fill="{FIELDS[int(row[at])]}"/>'
            )
    return _framed("".join(drawn), 2 * EDGE + high * len(rows), says)


def _framed(drawn: str, height: int, says: str) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height}" role="img" '
        f'aria-label="{escape(says)}" style="background:#fff;border:1px solid #ccc">{drawn}</svg>'
        f'<div style="color:#666;font-size:85%">{escape(says)}</div>'
    )
