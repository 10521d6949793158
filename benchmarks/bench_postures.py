"""Postures with a locked joint: how often ftqp.postures finds one where another solver does, and when.

    python benchmarks/bench_postures.py           100 goals for each of three arms, 2,000 restarts
    python benchmarks/bench_postures.py --quick   20 goals each, 500 restarts, in a quarter of a minute

A goal is the tip's pose at a random posture; then one random joint is locked at a random place, so that some
goals cannot be reached any more. The other solver is damped least squares in numpy on pinocchio's placements,
with limits, and shares no code with ftqp. One core; a first call that loads code is not counted.
"""

import os
import sys
from time import thread_time

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402
from bench import docs  # noqa: E402
from bench.tables import Table, quantity  # noqa: E402
from peers.independent_arm import IndependentArm  # noqa: E402

import ftqp  # noqa: E402

ARMS = ("panda", "iiwa14", "xarm7")
SEED = 20261126
TIMES = ("p50", "p99", "p50_found", "p50_nothing")
LIMITATIONS = (
    "The other solver may miss postures, too: its 2,000 restarts are no proof that there is none.",
    "Goals that neither finds count for the times only.",
)


def drawn(robot, k: int):
    """A goal, where the arm is, and the joint that is locked there."""
    generator = np.random.default_rng([SEED, k])
    low = np.where(np.isfinite(robot.limits.q_min), robot.limits.q_min, -np.pi)
    high = np.where(np.isfinite(robot.limits.q_max), robot.limits.q_max, np.pi)
    there, here = generator.uniform(low, high, (2, robot.nv))
    return robot.pose(there), here, int(generator.integers(robot.nv))


def measured(name: str, goals: int, restarts: int) -> dict[str, object]:
    """Counts and times of one arm."""
    robot = ftqp.robots.load(name)
    other = IndependentArm(robot)
    ftqp.postures(robot, robot.pose(robot.neutral), near=robot.neutral)
    both = only_ours = only_theirs = worst = 0
    found_in, nothing_in, starts = [], [], []
    for k in range(goals):
        goal, here, joint = drawn(robot, k)
        began = thread_time()
        found = ftqp.postures(robot, goal, faults=ftqp.Locked(joint), near=here)
        (found_in if found else nothing_in).append(1e3 * (thread_time() - began))
        starts.append(found.starts)
        for one in found:
            e, _ = other.errors(one.q[None], goal)
            worst = max(worst, float(np.abs(e).max()))
            inside = (one.q >= robot.limits.q_min) & (one.q <= robot.limits.q_max)
            if not np.delete(inside, joint).all() or one.q[joint] != here[joint]:
                raise SystemExit(f"{name}, goal {k}: a posture is outside its limits")
        theirs = other.restarts(goal, here, [joint], count=restarts, seed=k) is not None
        both += bool(found) and theirs
        only_ours += bool(found) and not theirs
        only_theirs += theirs and not found
    every = found_in + nothing_in
    return {
        "arm": name, "goals": goals, "both": both, "only_ours": only_ours, "only_theirs": only_theirs,
        "share": both / max(1, both + only_theirs), "worst": worst,
        "p50": float(np.median(every)), "p99": float(np.percentile(every, 99.0)),
        "p50_found": float(np.median(found_in)), "p50_nothing": float(np.median(nothing_in or [np.nan])),
    }  # fmt: skip


def main() -> int:
    """Measure, print, write; 0 when done, 2 for bad input."""
    options = docs.asked(__doc__, "20 goals of each arm, 500 restarts", goals=(100, "of each arm"))
    goals, restarts = (20, 500) if options.quick else (options.goals, 2000)
    rows = [measured(name, goals, restarts) for name in ARMS]
    result = docs.measured(
        "bench_postures", {"goals": goals, "restarts": restarts, "seed": SEED}, rows, LIMITATIONS
    )
    headings = (
        "arm", "goals", "both find one", "only ftqp", "only the other", "share of the other's", "p50", "p99",
        "p50, one found", "p50, none found",
    )  # fmt: skip
    lines = [
        (r["arm"], str(r["goals"]), str(r["both"]), str(r["only_ours"]), str(r["only_theirs"]),
         f"{100.0 * r['share']:.1f} %", *(quantity(r[key]) for key in TIMES))
        for r in rows
    ]  # fmt: skip
    notes = (
        f"Worst error of a posture by the other's kinematics: {max(r['worst'] for r in rows):.2g} m or rad.",
    )
    table = Table(
        title="Goals with a posture, and the times of ftqp.postures [ms of the processor]",
        headings=headings,
        rows=lines,
        notes=notes,
    )
    docs.told(result, "Postures after a lock", [table], options)
    return 0


if __name__ == "__main__":
    sys.exit(main())
