"""The section of a report on what ``ftqp coverage`` found."""

from pathlib import Path
from typing import Any

from ftqp.app.commands.coverage_page import joint_table, sentences
from ftqp.app.run.runs import SUMMARY, summary_with
from ftqp.core.errors import InputError
from ftqp.viz.pages.page import heading, paragraph, picture

HEAT_MAP, MOTION = "coverage.png", "motion.png"
NEEDED = ("scenario", "robot", "coverage", "per_joint", "pairs", "reasons", "best_effort")
"""What the summary of a coverage result has at least."""


def read_coverage(folder: Path) -> dict[str, Any] | None:
    """The facts of a coverage result; None where a folder holds none."""
    return summary_with(folder, NEEDED)


def coverage_parts(label: str, facts: dict[str, Any], folder: Path) -> list[str]:
    """The section."""
    try:
        share = 100.0 * facts["coverage"]
        parts = [
            heading(f"{label}: which failures are survived"),
            paragraph(
                f"The arm {facts['robot']} on the path of {facts['scenario']}: of {facts['pairs']} failures, "
                f"each joint at each instant, {share:.1f} % are survived."
            ),
            *(paragraph(line) for line in sentences(facts)),
            joint_table(facts),
        ]
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"{folder / SUMMARY} is not as `ftqp coverage` writes it ({error!s:.80}); make it anew"
        ) from error
    captions = {
        HEAT_MAP: "A row for each joint, the time of its failure from left to right. Green: survived.",
        MOTION: "The arm at five instants, the last one darkest, and each joint with its limits shaded.",
    }
    present = [(folder / name, caption) for name, caption in captions.items() if (folder / name).is_file()]
    return [*parts, *(picture(file, caption) for file, caption in present)]
