"""What ``ftqp coverage`` found, in words: for the terminal, for its own page, and for a report."""

from pathlib import Path
from typing import Any, Final

import numpy as np

from ftqp import __version__
from ftqp.app.output.console import Table, page_parts
from ftqp.app.run.runs import SUMMARY, summary_with, write
from ftqp.core.errors import reading
from ftqp.faults.kinds import KINDS
from ftqp.viz.pages.page import heading, page, picture

PAGE: Final = "report.html"
HEAT_MAP, MOTION = "coverage.png", "motion.png"
CAPTIONS: Final = {
    HEAT_MAP: "A row for each joint, the time of its failure from left to right. Green: survived.",
    MOTION: "The arm at five instants, the last one darkest, and the end effector's way in orange; below, "
    "each joint with its limits shaded.",
}
NEEDED: Final = ("scenario", "robot", "coverage", "per_joint", "pairs", "reasons", "best_effort")
"""What the summary of a coverage result has at least."""


def read_coverage(folder: Path) -> dict[str, Any] | None:
    """The facts of a coverage result; None where a folder holds none."""
    return summary_with(folder, NEEDED)


def coverage_summary(facts: dict[str, Any]) -> list[str | Table]:
    """What a mission planner reads before the mission."""
    kind, share = KINDS[facts["fault"]], 100.0 * facts["coverage"]
    what = "loses speed" if "v_max" in kind.shares else kind.happens
    return [
        f"{facts['scenario']}: the arm {facts['robot']} follows its path on {facts['motion']}. What if a "
        f"joint {what}? Of all {facts['pairs']} failures, each joint at {facts['instants']} instants, "
        f"{share:.1f} % are survived.",
        *_sentences(facts),
        _by_joint(facts),
        Table("Of the motion and its failures", ("figure", "value"), _figures(facts), ("value",)),
        "A failure counts as survived when the remaining joints follow the rest of the path within all "
        "limits of position and speed. It is computed, not measured: the arm's model is taken for exact, and "
        "the failure for known at once.",
    ]


def coverage_parts(label: str, facts: dict[str, Any], folder: Path) -> list[str]:
    """The section of a report, with the pictures that there are."""
    with reading(folder / SUMMARY, "as `ftqp coverage` writes it", "make it anew"):
        parts = [heading(f"{label}: which failures are survived"), *page_parts(coverage_summary(facts))]
    present = [(folder / name, caption) for name, caption in CAPTIONS.items() if (folder / name).is_file()]
    return [*parts, *(picture(file, caption) for file, caption in present)]


def write_page(folder: Path, facts: dict[str, Any]) -> None:
    """Write the page."""
    footer = (
        f"ftqp {__version__}; robot {facts['robot']}; rows {', '.join(facts['rows'])}; {facts['samples']} "
        f"samples; lock {facts['lock']}."
    )
    title, parts = f"What {facts['scenario']} survives", coverage_parts(facts["scenario"], facts, folder)
    write(folder / PAGE, page(title, parts, footer))


def _by_joint(facts: dict[str, Any]) -> Table:
    """What is survived, joint by joint."""
    heads = ("joint", "survived [%]", "off by at best where lost [mm]", "what most often ends the path")
    best, reasons = facts["best_effort"], facts["reasons"]
    rows = [
        (
            str(name),
            f"{100.0 * value:.1f}",
            "-" if best[name] is None else f"{1e3 * best[name]:.3g}",
            str(reasons[name] or "nothing does"),
        )
        for name, value in facts["per_joint"].items()
    ]
    return Table("Joint by joint", heads, rows, heads[1:3])


def _sentences(facts: dict[str, Any]) -> list[str]:
    """What else a mission planner should know, a sentence each."""
    said = []
    if facts["structural"]:
        said.append(
            f"{', '.join(facts['structural'])} can never be done without on this task, whatever the motion: "
            "that is the arm's structure, no fault of the motion."
        )
    if facts["first_safe"] == 0.0:
        said.append("Every failure is survived at every instant that was looked at.")
    elif facts["first_safe"] is not None:
        said.append(f"From {facts['first_safe']:.3g} s on every failure is survived.")
    else:
        said.append("Up to the last instant some failure is not survived.")
    near, turned = facts["worst_error"]
    if facts["coverage"] > 0.0:
        said.append(
            f"After a survived failure the end effector stays within {1e3 * near:.2g} mm and {turned:.2g} "
            "rad of its path."
        )
    led = [name for name, seconds in facts.get("way_round", {}).items() if seconds is not None]
    if led:
        said.append(
            f"Where {', '.join(led)} first cannot be done without, a way round off the path still leads to "
            f"its end, in {max(facts['way_round'][name] for name in led):.1f} s at most."
        )
    if facts["upper_bound"] is not None:
        least, joints = min(facts["upper_bound"]), len(facts["per_joint"])
        if least < joints:
            said.append(
                f"Somewhere on the path no posture that was found can do without more than {least} of "
                f"{joints} joints."
            )
    if "mission" in facts:
        mission = facts["mission"]
        said.append(
            f"With these failure rates a failure ends the task with a probability of "
            f"{1.0 - mission['high']:.2g} to {1.0 - mission['low']:.2g}; if none were survived, of "
            f"{1.0 - mission['without']:.2g}."
        )
    return said


def _figures(facts: dict[str, Any]) -> list[tuple[str, str]]:
    """Rows of the last table; what is infinite or not known is none in a summary."""
    near, turned = facts["worst_best_effort"] or (None, None)
    jump, high = facts["velocity_jump"]
    rows = {
        "least distance from a limit after a survived failure [rad or m]": (facts["least_margin"], 1.0),
        "least distance of bodies that are kept apart after a survived failure [mm]": (
            facts["least_clearance"],
            1e3,
        ),
        "jump of the joint velocities at a lock, median [rad/s]": (jump, 1.0),
        "the same, 95 % of locks are below [rad/s]": (high, 1.0),
        "sum of squared speeds times time [rad2/s]": (facts["energy"], 1.0),
        "largest error where a failure is lost [mm]": (near, 1e3),
        "the same of the tool's rotation [rad]": (turned, 1.0),
    }
    known = {what: (x, factor) for what, (x, factor) in rows.items() if x is not None and np.isfinite(x)}
    return [(what, f"{factor * x:.3g}") for what, (x, factor) in known.items()]
