"""The page on coverage: what a mission planner reads before the mission, in one file."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from ftqp import __version__
from ftqp.app.run.runs import write
from ftqp.faults.kinds import KINDS
from ftqp.viz.pages.page import heading, page, paragraph, picture, table

PAGE: Final = "report.html"


def write_page(folder: Path, facts: dict[str, Any], figures: Sequence[Path]) -> None:
    """Write the page."""
    heat_map, motion = figures
    share = 100.0 * facts["coverage"]
    kind = KINDS[facts["fault"]]
    what = "loses speed" if "v_max" in kind.shares else kind.happens
    instants = f"{facts['instants']} instants"
    parts = [
        paragraph(
            f"The arm {facts['robot']} follows its path on {facts['motion']}. What if a joint {what}? Of all "
            f"{facts['pairs']} failures, each joint at {instants}, {share:.1f} % are survived."
        ),
        *(paragraph(line) for line in sentences(facts)),
        heading("Which failure, and when"),
        picture(
            heat_map, "A row for each joint, the time of its failure from left to right. Green: survived."
        ),
        joint_table(facts),
        heading("The motion"),
        picture(
            motion,
            "The arm at five instants, the last one darkest, and the tip's way in orange; below, each joint "
            "with its limits shaded.",
        ),
        heading("More figures"),
        table("Of the motion and its failures", ("figure", "value"), _figures(facts), numbers=("value",)),
        paragraph(
            "A failure counts as survived when the joints that are left follow the rest of the path within "
            "all limits of position and speed. It is computed, not measured: the arm's model is taken for "
            "exact, and the failure for known at once."
        ),
    ]
    write(folder / PAGE, page(f"What {facts['scenario']} survives", parts, _footer(facts)))


def joint_table(facts: dict[str, Any]) -> str:
    """The table of what is survived, joint by joint."""
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
    return table("Joint by joint", heads, rows, numbers=heads[1:3])


def sentences(facts: dict[str, Any]) -> list[str]:
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
            f"After a survived failure the tip stays within {1e3 * near:.2g} mm and {turned:.2g} rad of its "
            "path."
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
    """Rows of the last table."""
    jump, high = facts["velocity_jump"]
    rows = [
        ("least distance from a limit after a survived failure [rad or m]", f"{facts['least_margin']:.3g}"),
        *(
            []
            if facts["least_clearance"] is None
            else [
                (
                    "least distance of bodies that are kept apart after a survived failure [mm]",
                    f"{1e3 * facts['least_clearance']:.3g}",
                )
            ]
        ),
        ("jump of the joint velocities at a lock, median [rad/s]", f"{jump:.3g}"),
        ("the same, 95 % of locks are below [rad/s]", f"{high:.3g}"),
        ("sum of squared speeds times time [rad2/s]", f"{facts['energy']:.4g}"),
    ]
    if facts["worst_best_effort"] is not None:
        near, turned = facts["worst_best_effort"]
        rows.append(("largest error where a failure is lost [mm]", f"{1e3 * near:.3g}"))
        rows.append(("the same of the tool's rotation [rad]", f"{turned:.3g}"))
    return rows


def _footer(facts: dict[str, Any]) -> str:
    rows = ", ".join(facts["rows"])
    return (
        f"ftqp {__version__}; robot {facts['robot']}; rows {rows}; {facts['samples']} samples; lock "
        f"{facts['lock']}."
    )
