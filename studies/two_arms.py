"""Two arms carry a bar, and a joint of either locks on the way: does the grip slip, and does the load arrive?

Each of the 14 joints of ``dual_panda`` locks once on each of 100 random ways, at a random moment before the
end. The load goes along a straight line of up to 0.25 m in 3 s, led by its progress, so that it may slow
down; the grip is a relative pose on level 0. Ways that the healthy arms do not finish are drawn anew. Poses
are pinocchio's, of the configurations that the planner sends.

    python studies/two_arms.py [--quick] [--out DIR] [--json]

Full study: about ten minutes on one core. Results go to ``studies/results`` unless --out says otherwise.
"""

from typing import Any

import numpy as np
from bench import study
from bench.tables import Table

import ftqp

ROBOT = ftqp.robots.load("dual_panda")
LEFT, RIGHT = ROBOT.tips
DT, DURATION, PATIENCE = 0.002, 3.0, 9.0
WAYS, QUICK_WAYS = 100, 6
SLIP, ARRIVED = 1e-3, 1e-3
"""The grip holds up to this relative position error, and the load is on its way up to this one [m]."""
LEVELS = ("velocity", "acceleration")
SEED = 20261125


def held(q: Any) -> Any:
    """Pose of the right hand in the left one."""
    return np.linalg.solve(ROBOT.pose(q, LEFT), ROBOT.pose(q, RIGHT))


def carry(way: Any, level: str, lock: int | None, at: float) -> dict[str, Any]:
    """One run: how far the grip slipped, how far the load left its line, and what is left to its end."""
    grip = ftqp.RelativeTask(RIGHT, LEFT, level=0, name="grip")
    tasks = [ftqp.Task("pose", mode="scaled"), grip]
    planner = ftqp.Planner(ROBOT, DT, level=level, tasks=tasks, emergency=ftqp.EmergencyStop())
    q = ROBOT.neutral.copy()
    follower = ftqp.PathFollower(planner, ftqp.paths.Line(ROBOT.pose(q), way, duration=DURATION))
    follower.reset(q)
    begin, bar, along = ROBOT.pose(q)[:3, 3], held(q), way / np.linalg.norm(way)
    slip = off = 0.0
    stopped = False
    limits = ROBOT.limits
    kept = True
    for k in range(int(PATIENCE / DT)):
        if lock is not None and k == int(at / DT):
            planner.report(ftqp.Locked(lock))
        step = follower.step(q, None)
        q = step.q.copy()
        stopped |= step.status in (ftqp.StepStatus.STOPPING, ftqp.StepStatus.STOPPED)
        kept &= bool((q >= limits.q_min - 1e-9).all() and (q <= limits.q_max + 1e-9).all())
        kept &= bool((np.abs(step.v) <= limits.v_max + 1e-9).all())
        done = follower.status in (ftqp.PathStatus.DONE, ftqp.PathStatus.BLOCKED)
        if k % 10 == 0 or done:
            slip = max(slip, float(np.linalg.norm((held(q) - bar)[:3, 3])))
            gone = ROBOT.pose(q)[:3, 3] - begin
            off = max(off, float(np.linalg.norm(gone - (gone @ along) * along)))
        if done:
            break
    left = float(np.linalg.norm(ROBOT.pose(q)[:3, 3] - begin - way))
    return {
        "slip": slip, "off": off, "left": left, "end": follower.status.name, "stopped": stopped,
        "seconds": (k + 1) * DT, "kept": kept,
    }  # fmt: skip


def ways(count: int) -> list[tuple[Any, float]]:
    """Ways that the healthy arms finish at both levels, and when a joint locks on each."""
    rng, found = np.random.default_rng(SEED), []
    while len(found) < count:
        way = rng.normal(size=3)
        way *= rng.uniform(0.05, 0.25) / np.linalg.norm(way)
        at = rng.uniform(0.1, 0.9) * DURATION
        healthy = [carry(way, level, None, at) for level in LEVELS]
        if all(one["end"] == "DONE" and one["left"] < ARRIVED for one in healthy):
            found.append((way, at))
    return found


def measured(count: int) -> list[dict[str, Any]]:
    """All runs, joint by joint and level by level."""
    drawn = ways(count)
    return [
        {"level": level, "joint": ROBOT.joints[joint], **carry(way, level, joint, at)}
        for level in LEVELS
        for joint in range(ROBOT.nv)
        for way, at in drawn
    ]


def tables(found: dict[str, Any]) -> list[Table]:
    """By level and joint."""
    lines = []
    for level in LEVELS:
        of_level = [run for run in found["runs"] if run["level"] == level]
        for name in (*ROBOT.joints, "all"):
            rows = [run for run in of_level if name in (run["joint"], "all")]
            counts = (
                len(rows), sum(run["slip"] < SLIP for run in rows), sum(run["off"] < ARRIVED for run in rows),
                sum(run["left"] < ARRIVED for run in rows), sum(run["end"] == "BLOCKED" for run in rows),
                sum(run["stopped"] for run in rows),
            )  # fmt: skip
            slip, kept = 1e3 * max(run["slip"] for run in rows), sum(run["kept"] for run in rows)
            lines.append((level, name, *map(str, counts), f"{slip:.3f} mm", str(kept)))
    headings = (
        "level", "joint that locks", "runs", "grip within 1 mm", "load on its line within 1 mm",
        "load at its end", "blocked", "stopped", "largest slip", "limits kept",
    )  # fmt: skip
    return [Table(title="Every joint locks once on each way", headings=headings, rows=lines)]


if __name__ == "__main__":
    study.on_record(
        study.options(__doc__, "two_arms", f"{QUICK_WAYS} ways").parse_args(),
        "Two arms carry a bar, and a joint locks",
        lambda given: {"runs": measured(QUICK_WAYS if given.quick else WAYS)}, tables,
        ("One pair of arms, straight ways from one posture, joints that lock at once, arms that do what they "
         "are told.", "That a way cannot be finished is no proof that no planner could."),
    )  # fmt: skip
