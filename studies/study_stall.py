"""Paths that stall: what frees an arm that is trapped, and how one that cannot go on comes to rest.

An arm that is exactly stretched has no gradient that tells it which way to fold, so a path along it stalls.
Each arm starts stretched, or with its joints off by +-offset in turn, and follows a line of 0.3 of its
characteristic length towards its base in 2 s of path time; a run ends when the path is finished, blocked, or
after 40 s.

Many other paths cannot be finished: lines of 3 s that leave the reach, lines on which a joint brakes after
1 s, one run a joint and direction, and lines from a start near a singularity. A stall begins where the mean
rate from there to the verdict BLOCKED is below 1 %. Speeds and accelerations are shares of the limits of the
joint that is nearest to its own. An arm moves on while any joint is faster than 1 % of its velocity limit; it
is watched for 2 s after the verdict.

    python studies/study_stall.py [--quick] [--out DIR] [--json]

The whole study takes half a minute. Tables go to the screen; report and numbers to ``--out``.
"""

import sys
from typing import Any

import numpy as np
from bench import command_line, results

import ftqp

ARMS = ("planar(3)", "planar(4)", "planar(6)")
LEVELS = ("velocity", "acceleration")
OFFSETS = (0.0, 1e-9, 1e-6, 1e-3)
"""Joint angles at the start, of alternating sign [rad]."""
DT = 0.01
DURATION = 2.0
LONGEST = 40.0
SHARE = 0.3
"""Length of the line over the arm's characteristic length."""
BLOCKED_ARMS = ("panda", "iiwa14", "xarm7", "planar(4)")
BLOCKED_DT = 0.002
BLOCKED_DURATION = 3.0
BLOCKED_LONGEST = 10.0
WATCHED = 2.0
"""How long an arm is watched after the verdict [s]."""
FAULT_AT = 1.0
STANDS = 0.01
"""Mean rate of a path that has stalled."""
AT_REST = 0.01
AT_LIMIT = 0.95
NEAR = 0.01
"""Joint angles of a start near a singularity, of alternating sign [rad]."""
LIMITATIONS = (
    "The trapped arms are planar, without gravity or locked joints, on one line; an ideal plant, no noise.",
    "The blocked paths are straight lines from one or two starts an arm; an ideal plant, no noise.",
    "An error of the start of 1e-9 rad already frees the arm: on a real arm noise does what the escape does. "
    "The escape is for exact starts, such as the zero configuration of a simulation, and for its verdict.",
    "The limits of a stalled path are those of the joints alone: torque limits are not among the cases.",
)


def followed(arm: str, level: str, offset: float, stall: ftqp.StallEscape | None) -> dict[str, Any]:
    """How one run ended, when, and how much of the path's time had been reached."""
    robot = ftqp.robots.load(arm)
    q = np.where(np.arange(robot.nv) % 2 == 0, offset, -offset)
    v = np.zeros(robot.nv)
    path = ftqp.paths.Line(robot.pose(q), (-SHARE * robot.length, 0.0, 0.0), duration=DURATION)
    task = ftqp.Task(mode="scaled", rows=("x", "y"), calm=stall is not None)
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
    """A row an arm, level and offset, without escape and calm and with both."""
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


def blocked_cases(arm: str) -> list[tuple[str, Any, Any, int | None]]:
    """Kind, start, way of the line [m] and the joint that brakes, of every blocked path of an arm."""
    robot = ftqp.robots.load(arm)
    planar = arm.startswith("planar")
    neutral, length = robot.neutral, robot.length
    ways = [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
    ways += [(0.7, 0.7, 0.0)] if planar else [(0.0, 0.0, 1.0), (0.6, 0.6, 0.5)]
    cases: list[tuple[str, Any, Any, int | None]] = [
        ("leaves the reach", neutral, 2.0 * length * np.array(way), None) for way in ways
    ]
    ways = [(0.25, 0.5, 0.0), (-0.3, 0.3, 0.0)] if planar else [(0.2, 0.4, 0.2), (-0.2, -0.3, -0.3)]
    for joint in range(robot.nv):
        cases += [("a joint locks", neutral, length * np.array(way), joint) for way in ways]
    q = np.where(np.arange(robot.nv) % 2 == 0, NEAR, -NEAR)
    q = np.clip(q, robot.limits.q_min + NEAR, robot.limits.q_max - NEAR)
    out = robot.pose(q)[:3, 3]
    out = SHARE * length * (np.array((0.0, 0.0, 1.0)) if arm == "panda" else out / np.linalg.norm(out))
    across = np.array((0.0, SHARE * length, 0.0))
    return cases + [("starts near singular", q, way, None) for way in (out, -out, across)]


def led_until_blocked(
    arm: str, level: str, calm: bool, case: tuple[str, Any, Any, int | None]
) -> dict[str, Any]:
    """How one run ended and, if it is blocked, what the arm did between stall and verdict and after it."""
    kind, q, way, joint = case
    robot = ftqp.robots.load(arm)
    task = ftqp.Task(mode="scaled", calm=calm)
    planner = ftqp.Planner(robot, BLOCKED_DT, level=level, task=task, emergency=None)
    path = ftqp.paths.Line(robot.pose(q), way, duration=BLOCKED_DURATION)
    follower = ftqp.PathFollower(planner, path)
    follower.reset(q)
    v = np.zeros(robot.nv)
    progress, speed, effort = [], [], []
    end: int | None = None
    for tick in range(round(BLOCKED_LONGEST / BLOCKED_DT)):
        if joint is not None and tick == round(FAULT_AT / BLOCKED_DT):
            planner.report(ftqp.Locked(joint))
        step = follower.step(q, v)
        q, v = step.q.copy(), step.v.copy()
        progress.append(follower.progress)
        speed.append(float(np.abs(v / robot.limits.v_max).max()))
        effort.append(float(np.abs(step.a / robot.limits.a_max).max()))
        if end is None and follower.status in (ftqp.PathStatus.DONE, ftqp.PathStatus.BLOCKED):
            end = tick
        if follower.status is ftqp.PathStatus.DONE or (
            end is not None and tick >= end + round(WATCHED / BLOCKED_DT)
        ):
            break
    run = {"arm": arm, "level": level, "calm": calm, "kind": kind, "status": follower.status.name}
    if follower.status is not ftqp.PathStatus.BLOCKED or end is None:
        return run
    left = BLOCKED_DT * (end - np.arange(end))
    slow = progress[end] - np.array(progress[:end]) <= STANDS * left
    start = int(np.argmax(slow)) if slow.any() else end
    moving = np.nonzero(np.array(speed[end:]) >= AT_REST)[0]
    return run | {
        "verdict": (end - start) * BLOCKED_DT,
        "speed": max(speed[start : end + 1]),
        "at_limit": BLOCKED_DT * sum(a >= AT_LIMIT for a in effort[start : end + 1]),
        "rest": BLOCKED_DT * (int(moving[-1]) + 1) if len(moving) else 0.0,
    }


def blocked_paths(arms: tuple[str, ...]) -> list[dict[str, Any]]:
    """Every run with calm and without."""
    return [
        led_until_blocked(arm, level, calm, case)
        for calm in (True, False)
        for arm in arms
        for level in LEVELS
        for case in blocked_cases(arm)
    ]


def _blocked_rows(runs: list[dict[str, Any]]) -> list[str]:
    """A line a kind of path, level and setting: medians and worst values."""
    lines = []
    for calm in (True, False):
        for kind in dict.fromkeys(run["kind"] for run in runs):
            for level in LEVELS:
                some = [r for r in runs if (r["kind"], r["level"], r["calm"]) == (kind, level, calm)]
                ends = [r for r in some if r["status"] == "BLOCKED"]
                if not ends:
                    continue
                done = sum(r["status"] == "DONE" for r in some)
                cells = [
                    f"{np.median([r[name] for r in ends]):.2f}, {max(r[name] for r in ends):.2f}"
                    for name in ("verdict", "speed", "at_limit", "rest")
                ]
                lines.append(
                    f"| {kind} | {level} | {'on' if calm else 'off'} | {done}, {len(ends)}, "
                    f"{len(some) - done - len(ends)} | {' | '.join(cells)} |"
                )
    return lines


def markdown(result: dict[str, Any]) -> str:
    """The table for a reader."""
    lines = [
        *results.preamble("Paths that stall", result),
        "## Arms that are trapped",
        "",
        "| arm | level | offset [rad] | without escape and calm | default |",
        "|---|---|---:|---|---|",
        *(
            f"| {row['arm']} | {row['level']} | {row['offset']:g} | {_words(row['without'])} "
            f"| {_words(row['with'])} |"
            for row in result["rows"]
        ),
        "",
        "## Paths that are blocked",
        "",
        "Median and worst value, of the runs that ended BLOCKED.",
        "",
        "| path | level | calm | done, blocked, neither | stall to verdict [s] | largest speed "
        "| at limit [s] | moves on for [s] |",
        "|---|---|---|---|---|---|---|---|",
        *_blocked_rows(result["blocked"]),
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
    parser = command_line.parser(__doc__)
    parser.add_argument("--quick", action="store_true", help="one arm")
    results.add_out(parser, "study_stall")
    parser.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    given = parser.parse_args()
    settings = {"quick": given.quick, "dt": DT, "longest": LONGEST}
    result = results.circumstances("study_stall", (), settings) | {
        "rows": study(ARMS[:1] if given.quick else ARMS),
        "blocked": blocked_paths(BLOCKED_ARMS[-1:] if given.quick else BLOCKED_ARMS),
        "left_out": {},
        "limitations": list(LIMITATIONS),
    }
    name = results.stem("study_stall", name=None, quick=given.quick)
    return results.told(result, markdown(result), given.out, name, as_json=given.json)


if __name__ == "__main__":
    sys.exit(main())
