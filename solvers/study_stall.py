"""What the stall escape is good for: stretched planar arms that are to draw their tip back along themselves.

An arm that is exactly stretched has no gradient that tells it which way to fold, so a path along it stalls.
Each arm starts stretched, or with its joints off by +-offset in turn, and follows a line of 0.3 of its
characteristic length towards its base in 2 s of path time; a run ends when the path is finished, blocked, or
after 40 s.

    python solvers/study_stall.py [--quick] [--out DIR] [--json]

The whole study takes a few seconds. Tables go to the screen; report and numbers to ``--out``.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from bench import results

import ftqp
from ftqp.core.errors import InputError

ARMS = ("planar(3)", "planar(4)", "planar(6)")
LEVELS = ("velocity", "acceleration")
OFFSETS = (0.0, 1e-9, 1e-6, 1e-3)
"""Joint angles at the start, of alternating sign [rad]."""
DT = 0.01
DURATION = 2.0
LONGEST = 40.0
SHARE = 0.3
"""Length of the line over the arm's characteristic length."""
LIMITATIONS = (
    "Planar arms without gravity or locked joints, one line, ideal plant, no measurement noise.",
    "An error of the start of 1e-9 rad already frees the arm: on a real arm noise does what the escape does. "
    "The escape is for exact starts, such as the zero configuration of a simulation, and for its verdict.",
    "On the 232 lock sets of lock_sets.md the escape completes no more than there are without it, and two "
    "fewer from start R, because it calls them blocked after 3 s instead of trying for 40 s.",
)


def followed(arm: str, level: str, offset: float, stall: ftqp.StallEscape | None) -> dict[str, Any]:
    """How one run ended, when, and how much of the path's time had been reached."""
    robot = ftqp.robots.load(arm)
    q = np.where(np.arange(robot.nv) % 2 == 0, offset, -offset)
    v = np.zeros(robot.nv)
    path = ftqp.paths.Line(robot.pose(q), (-SHARE * robot.length, 0.0, 0.0), duration=DURATION)
    task = ftqp.Task(mode="scaled", rows=("x", "y"))
    follower = ftqp.PathFollower(ftqp.Planner(robot, DT, level=level, task=task), path, stall=stall)
    follower.reset(q)
    ended = (ftqp.PathStatus.DONE, ftqp.PathStatus.BLOCKED)
    ticks = 0
    while ticks < round(LONGEST / DT) and follower.status not in ended:
        step = follower.step(q, v)
        q, v = step.q.copy(), step.v.copy()
        ticks += 1
    return {"status": follower.status.name, "time": ticks * DT, "progress": follower.progress / DURATION}


def study(arms: tuple[str, ...]) -> list[dict[str, Any]]:
    """A row an arm, level and offset, without and with the escape."""
    return [
        {
            "arm": arm,
            "level": level,
            "offset": offset,
            "without": followed(arm, level, offset, None),
            "with": followed(arm, level, offset, ftqp.StallEscape()),
        }
        for arm in arms
        for level in LEVELS
        for offset in OFFSETS
    ]


def markdown(result: dict[str, Any]) -> str:
    """The table for a reader."""
    lines = [
        *results.preamble("What the stall escape is good for", result),
        "| arm | level | offset [rad] | without escape | with escape |",
        "|---|---|---:|---|---|",
        *(
            f"| {row['arm']} | {row['level']} | {row['offset']:g} | {_words(row['without'])} "
            f"| {_words(row['with'])} |"
            for row in result["rows"]
        ),
        "",
        *results.appendix(result),
    ]
    return "\n".join(lines)


def _words(run: dict[str, Any]) -> str:
    if run["status"] == "DONE":
        return f"done in {run['time']:.2f} s"
    return f"{run['status'].lower()}, {100.0 * run['progress']:.1f} % after {run['time']:.0f} s"


def main() -> int:
    """Measures, prints, writes; 0 when done, 2 for bad input."""
    summary, usage = (__doc__ or "").split("\n\n", 1)
    parser = argparse.ArgumentParser(
        description=summary, epilog=usage, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="one arm")
    parser.add_argument("--out", type=Path, default=results.RESULTS, help="folder of the results")
    parser.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    given = parser.parse_args()
    settings = {"quick": given.quick, "dt": DT, "longest": LONGEST}
    result = results.circumstances("study_stall", (), settings) | {
        "rows": study(ARMS[:1] if given.quick else ARMS),
        "left_out": {},
        "limitations": list(LIMITATIONS),
    }
    try:
        name = results.stem("study_stall", name=None, quick=given.quick)
        results.written(result, markdown(result), given.out, name)
    except InputError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    sys.stdout.write((json.dumps(result) if given.json else markdown(result)) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
