"""The sections of a report: one about several runs side by side, and one about each run, with figures."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np

from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.signals import HEALTHY
from ftqp.viz.figures import compared_runs
from ftqp.viz.figures.events import length
from ftqp.viz.figures.run_figures import drawings_of
from ftqp.viz.pages.page import drawing, folded, heading, paragraph, table

UNKNOWN: Final = "-"
Facts = Mapping[str, Any]


def numbers(facts: Mapping[str, Facts], logs: Mapping[str, Log]) -> str:
    """The table of what the sentences of the runs leave out, and of errors, side by side."""
    rows = [(what, *(value(facts[label], logs[label]) for label in facts)) for what, value in _VALUES.items()]
    shown = [row for row in rows if any(cell != UNKNOWN for cell in row[1:])]
    return table("Numbers", ("", *facts), shown, numbers=tuple(facts))


def _length(name: str) -> Callable[[Facts, Log], str]:
    def value(facts: Facts, log: Log) -> str:
        return UNKNOWN if facts[name] is None else length(facts[name])

    return value


def _time(name: str) -> Callable[[Facts, Log], str]:
    def value(facts: Facts, log: Log) -> str:
        return UNKNOWN if facts["step_time_us"][name] is None else f"{facts['step_time_us'][name]:.1f} us"

    return value


def _angle(facts: Facts, log: Log) -> str:
    turned = facts["max_rotation_error"]
    return UNKNOWN if not turned else f"{np.degrees(turned):.2g} deg"


def _share(signal: str, limit: str) -> Callable[[Facts, Log], str]:
    def value(facts: Facts, log: Log) -> str:
        top = np.array([np.inf if x is None else x for x in log.metadata["limits"][limit]])
        used = np.where(log["truth"] == HEALTHY, np.abs(log[signal]) / top, 0.0)
        if not np.isfinite(used).any() or not np.isfinite(top).any():
            return UNKNOWN
        joint = int(np.nanargmax(np.nanmax(used, axis=0)))
        return f"{100.0 * float(np.nanmax(used)):.0f} % ({log.metadata['joints'][joint]})"

    return value


def _moved(facts: Facts, log: Log) -> str:
    moved = facts["max_failed_joint_motion"]
    slides = dict(zip(log.metadata["joints"], log.metadata["prismatic"], strict=True))
    return ", ".join(f"{j} {x:.2g} {'m' if slides[j] else 'rad'}" for j, x in moved.items()) or UNKNOWN


def carried(log: Log) -> dict[str, float]:
    """The largest torque or force at every brake that was closed, by the arm's model, by joint."""
    brakes = np.abs(np.nan_to_num(log["tau_brake"])).max(axis=0)
    return {joint: float(top) for joint, top in zip(log.metadata["joints"], brakes, strict=True) if top > 0.0}


def _brakes(facts: Facts, log: Log) -> str:
    slides = dict(zip(log.metadata["joints"], log.metadata["prismatic"], strict=True))
    found = carried(log)
    return ", ".join(f"{j} {top:.3g} {'N' if slides[j] else 'N m'}" for j, top in found.items()) or UNKNOWN


def _statuses(facts: Facts, log: Log) -> str:
    return ", ".join(f"{name} {100.0 * n / len(log):.3g} %" for name, n in facts["status_counts"].items())


_VALUES: Final[dict[str, Callable[[Facts, Log], str]]] = {
    "time that was simulated": lambda facts, log: f"{float(log['t'][-1]):.4g} s in {len(log)} steps",
    "status of the steps": _statuses,
    "largest distance from the target": _length("max_position_error"),
    "the same, root of the mean square": _length("rms_position_error"),
    "largest angle to the target": _angle,
    "most of its speed that a working joint used": _share("v", "v_max"),
    "most of its torque that a working joint used": _share("tau", "tau_max"),
    "how far a failed joint moved": _moved,
    "most that a brake carried": _brakes,
    "time of a step, median": _time("p50"),
    "time of a step, 99 % are below": _time("p99"),
    "longest step": _time("max"),
    "steps whose QP was not solved": lambda facts, log: str(facts["qp"]["failures"]),
}
"""What is shown of a run, and how."""


CAPTIONS: Final = {
    "path.png": "The arm at a few instants, the path that its end effector should take (grey) and took, and "
    "how far it was off, on a scale on which every line is ten times the one below.",
    "tasks.png": "How far every soft task was from its target, every point that is kept on its side of a "
    "plane from that, and the arm from what stands around it.",
    "joints.png": "Every joint's position. Each panel is scaled to the joint's motion; the bar next to it "
    "shows how much of its range that is.",
    "velocities.png": "Every joint's velocity; the bar shows how much of the speed limit was used.",
    "following.png": "How far every joint was from what had been sent to it.",
    "torques.png": "Every motor's torque, and what the brake of a locked joint carries in its place.",
    "status.png": "What the planner said of every step, what really failed, and what it believed.",
    "base.png": "How far the end effector was off in space while its base moved.",
}
"""What is seen in each figure of a run, by the name of its file."""
ERRORS: Final = "How far the end effector of each run was from its target."
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


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportedRun:
    """A run as a report tells it: its log, with rows, its summary, and what happened, in plain words.

    The scenario has every default filled in, as TOML, and is empty where it is not known; the replay is what
    plays on the page, or a sentence that says why there is none.
    """

    label: str
    log: Log
    facts: Mapping[str, Any]
    sentences: Sequence[str]
    scenario: str
    replay: str
    plays: bool


def side_by_side(runs: Sequence[ReportedRun]) -> list[str]:
    """What several runs have in common: all their numbers, and figures where it is the same arm."""
    logs = {run.label: run.log for run in runs}
    parts = [numbers({run.label: run.facts for run in runs}, logs)]
    arms = {(run.log.metadata["robot"], tuple(run.log.metadata["joints"])) for run in runs}
    if len(runs) > 1 and len(arms) == 1:
        parts = [*compared(logs, runs[0].log.metadata["robot"]), *parts]
    return parts


def run_parts(run: ReportedRun, *, alone: bool) -> list[str]:
    """The section about a run."""
    parts = [heading("What happened" if alone else run.label)]
    parts += [paragraph(sentence) for sentence in run.sentences]
    if alone:
        parts += side_by_side([run])
    parts += [heading("Replay" if alone else f"{run.label}: replay")]
    parts += [run.replay if run.plays else paragraph(run.replay)]
    parts += [heading("Figures" if alone else f"{run.label}: figures"), *figures_of(run.log)]
    if run.scenario:
        parts.append(folded(f"Scenario of {run.label}, every default filled in", run.scenario))
    return parts


def versions_part(runs: Sequence[ReportedRun], here: Mapping[str, str]) -> str:
    """A table of what took part in the runs, and in the report."""
    columns = [(run.label, run.log.metadata.get("versions") or {}) for run in runs] + [("this report", here)]
    names = dict.fromkeys(name for _, found in columns for name in found)
    rows = [(str(name), *(str(found.get(name, "-")) for _, found in columns)) for name in names]
    return table("Versions", ("", *(label for label, _ in columns)), rows)
