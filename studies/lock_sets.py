"""How many failures a path survives: every set of up to three locked joints of the 11-joint arm on one line.

The arm of Bedrossian (``modular11``) moves its tip 100 in along -x in 20 s with J2, J4, J7 and every other
set of at most three joints locked from the start, at 50 deg/s and the acceleration limits of the catalog. A
set is complete when the path is finished within 40 s, nowhere more than 0.5 in from the line and never turned
by 0.5 deg. Where the path may be left by 0.5 in the tip may turn by as much over the characteristic length,
1.7 deg, and there and with bridges it may take 120 s; on bridges alone the tip is not looked at.

    python studies/lock_sets.py [--quick] [--start N] [--out DIR] [--json]

Full study: some minutes on one core. Results go to ``studies/results`` unless --out says otherwise.
"""

from itertools import combinations
from typing import Any

import numpy as np
from bench import study
from bench.tables import Table

import ftqp

INCH = 0.0254
LENGTH = 100.0 * INCH
DURATION = 20.0
PATIENCE = 40.0
NOMINAL = np.deg2rad([0.0, -50.0, 0.0, -30.0, 0.0, 70.0, 0.0, 30.0, 0.0, 0.0, 0.0])
OFFSET = np.deg2rad([0.1, 0.0, 0.1, 0.0, -0.1, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0])
STARTS = {"N": NOMINAL, "R": NOMINAL + OFFSET}
"""N: every roll at zero, exactly symmetric. R: four rolls off by 0.1 deg."""
BRIDGED_PATIENCE = 120.0
SETTINGS = {
    "default": (ftqp.StallEscape(), True, 0.0),
    "may be left by 0.5 in": (ftqp.StallEscape(), True, 0.5 * INCH),
    "without escape": (None, True, 0.0),
    "without calm": (ftqp.StallEscape(), False, 0.0),
    "with bridges": (ftqp.StallEscape(), True, np.inf),
}
"""The escape, whether paths wait in calm, and by how much the tip may leave them for another posture [m]."""
LIMITS = {"off_path": 0.5 * INCH, "turned": float(np.deg2rad(0.5))}


def lock_sets(quick: bool) -> list[tuple[int, ...]]:
    """0-based joints of each set; quick: the sets of up to one joint and every tenth of the others."""
    sets = [chosen for size in range(4) for chosen in combinations(range(11), size)]
    return [chosen for k, chosen in enumerate(sets) if len(chosen) < 2 or k % 10 == 0] if quick else sets


def follow(start: str, locks: tuple[int, ...], setting: str, dt: float) -> dict[str, Any]:
    """One run: how far it came, how far off the line, and why it ended."""
    robot = ftqp.robots.load("modular11")
    stall, calm, leave = SETTINGS[setting]
    task = ftqp.Task(mode="scaled", kp=2.0, calm=calm, degrade=())
    planner = ftqp.Planner(robot, dt, level="velocity", task=task, emergency=None)
    q, v = STARTS[start].copy(), np.zeros(robot.nv)
    path = ftqp.paths.Line(robot.pose(q), (-LENGTH, 0.0, 0.0), duration=DURATION, law="constant")
    follower = ftqp.PathFollower(planner, path, stall=stall, leave=leave)
    for joint in locks:
        planner.report(ftqp.Locked(joint, mode="instant"))
    follower.reset(q)
    off = turned = fastest = 0.0
    ticks = 0
    top = robot.limits.v_max
    for _ in range(round((BRIDGED_PATIENCE if leave > 0.0 else PATIENCE) / dt)):
        step = follower.step(q, v)
        ticks += 1
        if follower.status is not ftqp.PathStatus.BRIDGING or np.isfinite(leave):
            x, y, z = step.task_error[:3] - follower.target.position + path.start[:3, 3]
            off = max(off, float(np.hypot(y, z)), x - LENGTH, -x)
            turned = max(turned, step.rotation_error)
        q, v = step.q.copy(), step.v.copy()
        fastest = max(fastest, float((np.abs(v) / top).max()))
        if follower.status in (ftqp.PathStatus.DONE, ftqp.PathStatus.BLOCKED):
            break
    ended = follower.progress > 0.995 * DURATION and follower.blocked is None
    may_turn = leave / robot.length if np.isfinite(leave) else 0.0
    complete = ended and off < LIMITS["off_path"] and turned < max(LIMITS["turned"], may_turn)
    return {
        "locked": [f"j{joint + 1}" for joint in locks],
        "complete": complete,
        "progress": follower.progress / DURATION,
        "off_path": off,
        "turned": turned,
        "fastest": fastest,
        "time": ticks * dt,
        "blocked": follower.blocked,
    }


def measured(starts: list[str], settings: list[str], dt: float, quick: bool) -> dict[str, Any]:
    """A table by start, setting and size of the set, and every run that was not complete."""
    sets, tables, runs = lock_sets(quick), [], {}
    for start in starts:
        for name in settings:
            done = [follow(start, locks, name, dt) for locks in sets]
            runs[f"{start}, {name}"] = [run for run in done if not run["complete"]]
            sizes = [[run for run in done if len(run["locked"]) == size] for size in range(4)]
            tables.append(
                {
                    "start": start,
                    "setting": name,
                    "sets": len(done),
                    "complete": sum(run["complete"] for run in done),
                    "by_size": [f"{sum(r['complete'] for r in some)}/{len(some)}" for some in sizes],
                    "blocked": sum(run["blocked"] is not None for run in done),
                    "worst_off_path": max(run["off_path"] for run in done),
                    "worst_turned": max(run["turned"] for run in done),
                    "fastest": max(run["fastest"] for run in done),
                    "latest": max(run["time"] for run in done if run["complete"]),
                }
            )
    return {"tables": tables, "incomplete": runs}


def tables(found: dict[str, Any]) -> list[Table]:
    """By start and setting."""
    lines = [
        (t["start"], t["setting"], f"{t['complete']} of {t['sets']}", ", ".join(t["by_size"]),
         str(t["blocked"]), f"{t['worst_off_path'] / INCH:.2f} in",
         f"{np.rad2deg(t['worst_turned']):.2f} deg",
         f"{t['latest']:.1f} s")
        for t in found["tables"]
    ]  # fmt: skip
    headings = (
        "start", "setting", "complete", "sizes 0/1/2/3", "blocked", "worst off line", "turned", "latest end",
    )  # fmt: skip
    return [Table(title="Sets of locked joints", headings=headings, rows=lines)]


LIMITATIONS = (
    "One arm, one line, one speed; sets that are locked from the start, at rest.",
    "`blocked` is no proof that the rest of the line is out of reach. Without the escape a stalled arm goes "
    "on trying until the 40 s are over; which of the last then get through depends on rounding.",
    "With bridges, what the tip does on a bridge is not counted; 120 s are given there and to 0.5 in.",
)


if __name__ == "__main__":
    parser = study.options(__doc__, "lock_sets", "a tenth of the sets")
    parser.add_argument("--start", choices=sorted(STARTS), action="append", help="N or R; both if left out")
    parser.add_argument("--setting", choices=sorted(SETTINGS), action="append", help="all if left out")
    parser.add_argument("--dt", type=float, default=0.02, help="control period [s]")
    study.on_record(
        parser.parse_args(), "Lock sets of the 11-joint arm",
        lambda given: measured(
            given.start or sorted(STARTS), given.setting or sorted(SETTINGS), given.dt, given.quick
        ),
        tables, LIMITATIONS,
    )  # fmt: skip
