"""Paths that a lock blocks: how many PathFollower finishes, by how far the tip may leave them.

    python benchmarks/bench_bridges.py           20 paths whose end has a posture and no way along the line
    python benchmarks/bench_bridges.py --quick   4 of them

Cases are those of compare_peers.py: Panda, iiwa14, xarm7 and random chains in turn, a random joint locked at
a random posture, a line of 0.1 to 0.4 m and up to 0.6 rad. Taken are those along which Newton steps of the
joints left leave the limits or the line, and whose end has a posture all the same (an independent solver with
1,000 restarts). The arm does what it is told.
"""

import os
import sys
from time import thread_time_ns

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402
from bench import docs  # noqa: E402
from bench.results import circumstances  # noqa: E402
from bench.tables import Table, quantity  # noqa: E402
from compare_peers import ARMS, drawn, feasible  # noqa: E402

import ftqp  # noqa: E402

LONGEST = 60.0
LEAVES = (0.0, 0.01, 0.05, np.inf)
"""How far the tip may leave its path [m]; the last is ``bridges=True``."""
LIMITATIONS = (
    "That the end has a posture does not say that the path can be followed anywhere near it.",
    "Finished is a path whose end is reached in all rows: with fewer rows, which a follower takes by itself, "
    "the median path is gone to its end and not finished.",
)


def followed(case, arm, leave: float) -> dict[str, object]:
    """What becomes of a path."""
    low, high, speed, acceleration = case.limits
    robot = ftqp.Robot.from_urdf(case.urdf, tip=case.tip)
    robot = robot.with_limits(q_min=low, q_max=high, v_max=speed, a_max=acceleration)
    planner = ftqp.Planner(robot, case.dt, task=ftqp.Task(mode="scaled"))
    planner.reset(case.q)
    planner.report(ftqp.Locked(case.locked, mode="instant"))
    line = ftqp.paths.PointToPoint(case.start, case.goal, duration=case.duration)
    follower = ftqp.PathFollower(planner, line, leave=leave)
    q, v, on_path, taken, over = np.array(case.q), np.zeros(robot.nv), 0.0, [], 0
    standing, left, samples = 0, 0.0, line.sample(np.linspace(0.0, line.duration, 2001)).pose[:, :3, 3]
    for _ in range(round(LONGEST / case.dt)):
        began = thread_time_ns()
        step = follower.step(q, v)
        taken.append(1e-3 * (thread_time_ns() - began))
        q, v = step.q.copy(), step.v.copy()
        if follower.status is ftqp.PathStatus.BRIDGING:
            over += 1
            left = max(left, float(np.linalg.norm(samples - robot.pose(q)[:3, 3], axis=1).min()))
        else:
            away = line.sample(np.array([follower.progress])).pose[0]
            on_path = max(on_path, float(np.linalg.norm(robot.pose(q)[:3, 3] - away[:3, 3])))
        standing = standing + 1 if follower.status is ftqp.PathStatus.BLOCKED else 0
        if follower.status is ftqp.PathStatus.DONE or standing > 1.0 / case.dt:
            break
    end = np.abs(arm.errors(q[None], np.array(case.goal))[0][0])
    done = follower.status is ftqp.PathStatus.DONE and bool(end.max() < 5e-3)
    return {
        "done": done, "progress": follower.progress / case.duration, "off": 1e3 * on_path, "taken": taken,
        "bridged": over > 0, "left": 1e3 * left, "blocked": follower.blocked,
    }  # fmt: skip


def main() -> int:
    """Measure, print, write; 0 when done, 2 for bad input."""
    options = docs.asked(__doc__, "4 of them", paths=(20, "how many"))
    wanted, restarts = (4, 500) if options.quick else (options.paths, 1000)
    found, k = {leave: [] for leave in LEAVES}, 0
    while len(found[0.0]) < wanted:
        case, arm = drawn(ARMS[k % 4], "path", k // 4)
        k += 1
        if feasible(case, arm, restarts) != "other posture":
            continue
        for leave in found:
            found[leave].append(followed(case, arm, leave))
            last = found[leave][-1]
            if leave > 0.0 and not last["done"]:
                how = f"{100.0 * last['progress']:.0f} %, {last['blocked']}"
                sys.stderr.write(f"{case.arm} {(k - 1) // 4}, {leave:g}: {how}\n")
    result = {
        **circumstances("bench_bridges", [], {"paths": wanted, "restarts": restarts}),
        "rows": [
            {key: [one[key] for one in rows] for key in ("done", "progress", "off", "left")}
            for rows in found.values()
        ],
        "drawn": k,
        "limitations": list(LIMITATIONS),
    }
    lines = []
    for leave, rows in found.items():
        taken = np.concatenate([one["taken"] for one in rows])
        progress = 100.0 * float(np.median([one["progress"] for one in rows]))
        lines.append(
            ("anywhere" if leave == np.inf else f"{1e3 * leave:g} mm",
             f"{sum(one['done'] for one in rows)} of {wanted}", f"{progress:.0f} %",
             *(quantity(max(one[key] for one in rows)) for key in ("off", "left")),
             *(quantity(x) for x in np.percentile(taken, (50.0, 99.0))))
        )  # fmt: skip
    headings = (
        "may leave the path by", "finished", "progress, p50", "off the path beside bridges [mm]",
        "off it on them [mm]", "tick, p50 [us]", "p99",
    )  # fmt: skip
    notes = (f"Found among {k} paths that were drawn; ticks are processor time.",)
    table = Table(
        title="Paths with a posture at their end and no way along the line",
        headings=headings,
        rows=lines,
        notes=notes,
    )
    docs.told(result, "Bridges after a lock", [table], options)
    return 0


if __name__ == "__main__":
    sys.exit(main())
