"""The figures of runs as drawings within a page."""

import re
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from ftqp.sim.log.log_arrays import Log
from ftqp.viz.figures import compared_runs
from ftqp.viz.figures.run_figures import drawings_of
from ftqp.viz.pages.page import drawing

CAPTIONS: Final = {
    "path.png": "The arm at a few instants, the path that its tip should take (grey) and took, and how far "
    "it was off, on a scale on which every line is ten times the one below.",
    "tasks.png": "How far every soft task was from its target, every point that is kept on its side of a "
    "plane from that, and the arm from what stands around it.",
    "joints.png": "Every joint's position. Each panel is scaled to the joint's motion; the bar beside it "
    "shows how much of its range that is.",
    "velocities.png": "Every joint's velocity; the bar shows how much of the speed limit was used.",
    "following.png": "How far every joint was from what had been sent to it.",
    "torques.png": "Every motor's torque, and what the brake of a locked joint carries in its place.",
    "status.png": "What the planner said of every step, what really failed, and what it believed.",
    "base.png": "How far the tip was off in space while its base moved.",
}
"""What is seen in each figure of a run, by the name of its file."""
ERRORS: Final = "How far the tip of each run was from its target."
STATUSES: Final = "What the planner of each run said of every step."
_NUMBERS = re.compile(r"-?\d+\.\d{2,}")
_PATHS = re.compile(r'(?<= )d="[^"]*"')
_NAMES = re.compile(r' xmlns(:\w+)?="[^"]*"')
_METADATA = re.compile(r"<metadata>.*?</metadata>", re.DOTALL)
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)


def figures_of(log: Log) -> list[str]:
    """The figures of a run, each with its caption."""
    found = drawings_of(log).items()
    return [drawing(inline(partial(draw, log)), CAPTIONS[name]) for name, draw in found]


def compared(logs: Mapping[str, Log], title: str) -> list[str]:
    """Figures of several runs of the same arm side by side."""
    return [
        drawing(inline(lambda path: compared_runs.draw_errors(logs, title, path)), ERRORS),
        drawing(inline(lambda path: compared_runs.draw_statuses(logs, title, path)), STATUSES),
    ]


def inline(draw: Callable[[Path], Path]) -> str:
    """The drawing that a function writes to a file."""
    with TemporaryDirectory() as folder:
        text = draw(Path(folder) / "figure.svg").read_text(encoding="utf-8")
    return cleaned(text)


def cleaned(svg: str) -> str:
    """The element of an SVG file: no outside address, lengths to a hundredth of a point."""
    element = _METADATA.sub("", _COMMENT.sub("", svg[svg.index("<svg") :]))
    head, rest = element.split(">", 1)
    short = _PATHS.sub(lambda path: _NUMBERS.sub(_rounded, path.group()), rest)
    return _NAMES.sub("", head) + ">" + short.replace("xlink:href=", "href=")


def _rounded(number: re.Match[str]) -> str:
    return f"{float(number.group()):.2f}".rstrip("0").rstrip(".")
