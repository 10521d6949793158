"""Goals after a lock: how many ftqp.GoTo reaches straight only, and how many with other postures.

    python benchmarks/bench_goals.py           45 random goals and 50 ordinary ones, in two minutes
    python benchmarks/bench_goals.py --quick   9 and 9

A random goal is the tip's pose at a random posture, and so is where the arm is; an ordinary one is within
0.3 m and 0.6 rad of the tip at the arm's neutral posture, from which it starts. One random joint is locked
there, told at once; Panda, iiwa14 and xarm7 take turns. A goal counts if an independent solver (damped least
squares in numpy, 1,000 restarts) finds a posture of it within limits with that joint locked. The arm does
what it is told; dt is 1 ms.
"""

import os
import sys
from time import thread_time_ns

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402
from bench import docs  # noqa: E402
from bench.tables import Table, quantity  # noqa: E402
from peers.independent_arm import IndependentArm  # noqa: E402

import ftqp  # noqa: E402

ARMS = ("panda", "iiwa14", "xarm7")
SEED = 20261127
KINDS = ("random", "ordinary")
DT, LONGEST = 1e-3, 60.0
LIMITATIONS = (
    "The oracle says that a goal has a posture, not that there is a way to it.",
    "No obstacles, and no contact of the arm with itself.",
)


def drawn(robot, kind: str, k: int):
    """Where the arm is, its goal, and the joint that is locked there."""
    generator = np.random.default_rng([SEED, KINDS.index(kind), k])
    low = np.where(np.isfinite(robot.limits.q_min), robot.limits.q_min, -np.pi)
    high = np.where(np.isfinite(robot.limits.q_max), robot.limits.q_max, np.pi)
    joint = int(generator.integers(robot.nv))
    if kind == "random":
        here, there = generator.uniform(low, high, (2, robot.nv))
        return here, robot.pose(there), joint
    here = robot.neutral
    goal = robot.pose(here)
    way, turn = (generator.standard_normal(3) for _ in range(2))
    goal[:3, 3] += generator.uniform(0.05, 0.3) * way / np.linalg.norm(way)
    goal[:3, :3] = rotation(generator.uniform(0.0, 0.6) * turn / np.linalg.norm(turn)) @ goal[:3, :3]
    return here, goal, joint


def rotation(w):
    """exp of a rotation vector, (3, 3)."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_rotvec(w).as_matrix()


def gone(robot, here, goal, joint: int, straight: bool) -> dict[str, object]:
    """A way to a goal: whether it was reached, in what time, and the times of the ticks [us]."""
    planner = ftqp.Planner(robot, DT)
    planner.reset(here)
    planner.report(ftqp.Locked(joint, mode="instant"))
    goto = ftqp.GoTo(planner, pose=goal, straight=straight)
    q, v = here.copy(), np.zeros(robot.nv)
    taken = []
    while not goto.done and len(taken) < LONGEST / DT:
        began = thread_time_ns()
        step = goto.step(q, v)
        taken.append(1e-3 * (thread_time_ns() - began))
        q, v = step.q.copy(), step.v.copy()
    T = robot.pose(q)
    near = np.linalg.norm(T[:3, 3] - goal[:3, 3]) < 1e-3
    if (goto.status is ftqp.GoToStatus.REACHED) and not near:
        raise SystemExit(
            f"{robot.name} says REACHED and is {np.linalg.norm(T[:3, 3] - goal[:3, 3]):.3g} m off"
        )
    return {
        "reached": goto.status is ftqp.GoToStatus.REACHED, "time": DT * len(taken), "taken": taken,
        "sentence": goto.sentence,
    }  # fmt: skip


def figures(ways) -> list[float]:
    """p50, p99 and p99.9 of all ticks [us]."""
    return [
        float(x) for x in np.percentile(np.concatenate([way["taken"] for way in ways]), (50.0, 99.0, 99.9))
    ]


def measured(kind: str, count: int, restarts: int) -> dict[str, object]:
    """Both ways of going to so many goals that have a posture."""
    robots = [ftqp.robots.load(name) for name in ARMS]
    arms = [IndependentArm(robot) for robot in robots]
    straight, ways, k = [], [], 0
    while len(ways) < count:
        robot, arm = robots[k % 3], arms[k % 3]
        here, goal, joint = drawn(robot, kind, k)
        k += 1
        if arm.restarts(goal, here, [joint], count=restarts, seed=k) is None:
            continue
        straight.append(gone(robot, here, goal, joint, True))
        ways.append(gone(robot, here, goal, joint, False))
        if not ways[-1]["reached"]:
            sys.stderr.write(f"{robot.name}, {kind} goal {k - 1}: {ways[-1]['sentence']}\n")
    times = [way["time"] for way in ways if way["reached"]]
    return {
        "kind": kind, "goals": count, "straight": sum(way["reached"] for way in straight),
        "ways": sum(way["reached"] for way in ways),
        "worse": sum(a["reached"] and not b["reached"] for a, b in zip(straight, ways, strict=True)),
        "time_p50": float(np.median(times)), "time_max": float(max(times)),
        "ticks": [figures(straight), figures(ways)],
    }  # fmt: skip


def main() -> int:
    """Measure, print, write; 0 when done, 2 for bad input."""
    options = docs.asked(__doc__, "9 goals of each kind")
    counts, restarts = ((9, 9), 500) if options.quick else ((45, 50), 1000)
    rows = [measured(kind, count, restarts) for kind, count in zip(KINDS, counts, strict=True)]
    result = docs.measured(
        "bench_goals", {"goals": counts, "restarts": restarts, "seed": SEED, "dt": DT}, rows, LIMITATIONS
    )
    headings = (
        "goals",
        "with a posture",
        "straight only",
        "with other ways",
        "lost by them",
        "p50 [s]",
        "longest [s]",
    )
    lines = [
        (r["kind"], str(r["goals"]), str(r["straight"]), str(r["ways"]), str(r["worse"]),
         quantity(r["time_p50"]), quantity(r["time_max"]))
        for r in rows
    ]  # fmt: skip
    reached = Table(title="Goals reached after a lock", headings=headings, rows=lines)
    headings = (
        "goals",
        *(f"{name}, {way}" for way in ("straight", "other ways") for name in ("p50", "p99", "p99.9")),
    )
    lines = [(r["kind"], *(quantity(x) for way in r["ticks"] for x in way)) for r in rows]
    ticks = Table(
        title="Whole ticks of GoTo, one a millisecond [us of the processor]", headings=headings, rows=lines
    )
    docs.told(result, "Goals after a lock", [reached, ticks], options)
    return 0


if __name__ == "__main__":
    sys.exit(main())
