"""After a lock: of the paths whose rest an independent search calls feasible, how many are finished.

    python benchmarks/bench_after_failures.py           30 paths for each of three arms
    python benchmarks/bench_after_failures.py --quick   4 of each

Panda, iiwa14 and xarm7 follow the lines of compare_peers.py, 0.1 to 0.4 m and up to 0.6 rad, in all six rows.
At a tenth to nine tenths of the line a random joint locks, and is told: it brakes, and from where it stands a
search is asked of what is left. It shares no formula with ftqp: damped least squares in numpy follow the line
from the joints as they are (straight on), or from another posture of that place within limits, of which 20
are looked for in 200 restarts (from another posture). Finished is a tip that was within 2 mm and 0.02 rad of
the line since the lock, but on bridges, and ends within 1 mm and 0.01 rad.
"""

import os
import sys
from itertools import pairwise
from math import sqrt

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402
from bench import docs  # noqa: E402
from bench.tables import Table  # noqa: E402
from compare_peers import ARMS, drawn  # noqa: E402
from peers.motion_case import vector_of  # noqa: E402

import ftqp  # noqa: E402

SEED, DT, LONGEST = 20261202, 4e-3, 40.0
OFF, TURNED, END, END_TURNED = 2e-3, 0.02, 1e-3, 0.01
SAMPLES, SEEDS, EACH = 200, 20, 10
JUMP = 0.2
"""A joint that would have to go so far between two of 200 samples cannot follow [rad]."""
SETTINGS = {"as it comes": {}, "leave=0.01": {"leave": 0.01}, "bridges=True": {"bridges": True}}
FEASIBLE = ("straight on", "from another posture", "not known")
LIMITATIONS = (
    "The search knows position limits, not how fast joints can be: a path led by its progress waits.",
    "From another posture says that the rest can be followed from there, not that there is a way to it.",
    "Locks are told at once; no obstacles; arms do what they are told.",
)


def locked_on_the_way(name: str, k: int):
    """What leads an arm to a lock until the joint stands; its line, independent arm, joint, and share."""
    case, arm = drawn(name, "path", 1000 + k)
    generator = np.random.default_rng([SEED, ARMS.index(name), k])
    joint, when = int(generator.integers(arm.n)), generator.uniform(0.1, 0.9)
    robot = ftqp.robots.load(name)
    line = ftqp.paths.PointToPoint(case.start, case.goal, duration=case.duration)

    def leader(**given):
        planner = ftqp.Planner(robot, DT, task=ftqp.Task(mode="scaled"), emergency=None)
        planner.reset(case.q)
        follower = ftqp.PathFollower(planner, line, **given)
        q, v, came = np.array(case.q), np.zeros(robot.nv), []
        for _ in range(round(LONGEST / DT)):
            if not planner.faults and follower.progress >= when * line.duration:
                planner.report(ftqp.Locked(joint))
            step = follower.step(q, v)
            q, v = step.q.copy(), step.v.copy()
            if planner.faults:
                came.append(q)
                if v[joint] == 0.0:
                    return follower, came, v
            elif follower.status is ftqp.PathStatus.BLOCKED:
                return None
        return None

    return leader, line, arm, joint, when


def follows(arm, q, joint: int, poses) -> bool:
    """Whether damped least squares from sample to sample stay on the poses and within limits."""
    free, q = np.setdiff1d(np.arange(arm.n), [joint]), q.copy()
    for target in poses:
        before = q.copy()
        for _ in range(25):
            e, J = arm.errors(q[None], target)
            if np.abs(e).max() < 1e-8:
                break
            A = J[0][:, free]
            damping = 1e-2 * float(e[0] @ e[0]) + 1e-12
            q[free] += A.T @ np.linalg.solve(A @ A.T + damping * np.eye(6), e[0])
        far = np.abs(arm.errors(q[None], target)[0]).max() > 1e-6 or np.abs(q - before).max() > JUMP
        if far or (q < arm.low)[free].any() or (q > arm.high)[free].any():
            return False
    return True


def searched(arm, q, joint: int, poses) -> str:
    """What the search says of the rest of a path."""
    if follows(arm, q, joint, poses):
        return FEASIBLE[0]
    seen, generator = [q], np.random.default_rng(SEED)
    for seed in range(SEEDS):
        near = generator.uniform(arm.low, arm.high)
        near[joint] = q[joint]
        found = arm.restarts(poses[0], near, [joint], count=EACH, seed=1 + seed)
        if found is None or min(np.abs(found - one).max() for one in seen) < 0.05:
            continue
        seen.append(found)
        if follows(arm, found, joint, poses):
            return FEASIBLE[1]
    return FEASIBLE[2]


def finished(follower, came, v, arm, line) -> bool:
    """Whether the tip goes the rest of its path."""
    places = line.sample(np.linspace(0.0, line.duration, 1001)).pose
    end, blocked, q = line.sample([line.duration]).pose[0], 0, came[-1]

    def is_off(q) -> bool:
        R, p, _ = arm.poses(q[None])
        at = int(np.argmin(np.linalg.norm(places[:, :3, 3] - p[0], axis=1)))
        turned = float(np.linalg.norm(vector_of(places[at, :3, :3] @ R[0].T)))
        return bool(np.linalg.norm(places[at, :3, 3] - p[0]) > OFF or turned > TURNED)

    if any(is_off(one) for one in came):
        return False
    for k in range(round(LONGEST / DT)):
        step = follower.step(q, v)
        q, v = step.q.copy(), step.v.copy()
        if k % 5 == 0 and follower.status is not ftqp.PathStatus.BRIDGING and is_off(q):
            return False
        blocked = blocked + 1 if follower.status is ftqp.PathStatus.BLOCKED else 0
        if follower.status is ftqp.PathStatus.DONE or blocked > 0.5 / DT:
            break
    e = arm.errors(q[None], end)[0][0]
    return bool(np.linalg.norm(e[:3]) <= END and np.linalg.norm(e[3:]) <= END_TURNED)


def interval(good: int, of: int) -> str:
    """A share with its 95 % interval, by Wilson's formula."""
    if not of:
        return "-"
    z, p = 1.96, good / of
    middle, half = p + z * z / (2 * of), z * sqrt(p * (1 - p) / of + z * z / (4 * of * of))
    low, high = (max(0.0, middle + sign * half) / (1 + z * z / of) for sign in (-1, 1))
    return f"{good} of {of} ({100 * low:.0f} to {100 * high:.0f} %)"


def main() -> int:
    """Draw, lock, search, follow, print, write; 0 when done, 2 for bad input."""
    options = docs.asked(__doc__, "4 of each", paths=(30, "for each arm"))
    count, runs = 4 if options.quick else options.paths, []
    for name in ARMS[:3]:
        k, done = -1, 0
        while done < count:
            k += 1
            leader, line, arm, joint, when = locked_on_the_way(name, k)
            there = leader()
            if there is None:
                continue
            follower, came, _ = there
            times = np.linspace(follower.progress, line.duration, SAMPLES)
            run = {"arm": name, "joint": joint, "when": when}
            run["feasible"] = searched(arm, came[-1], joint, line.sample(times).pose)
            for setting, given in SETTINGS.items():
                run[setting] = finished(*leader(**given), arm, line)
            runs.append(run)
            done += 1
            if run["feasible"] == FEASIBLE[0] and not run["as it comes"]:
                sys.stderr.write(f"{name} {k}: joint {joint + 1} at {100 * when:.0f} %: not finished\n")
    lines = _lines(runs)
    result = docs.measured(
        "bench_after_failures", {"paths": count, "seed": SEED, "dt": DT}, runs, LIMITATIONS
    )
    table = Table(
        title="Of the failures whose rest is feasible, how many are finished",
        headings=("", "the search says", *SETTINGS),
        rows=lines,
        notes=("Shares with 95 % intervals of Wilson; joints counted from the base.",),
    )
    docs.told(result, "After a lock on the way", [table], options)
    return 0


def _lines(runs):
    """Rows by arm, joint and instant."""
    parts = [("all", runs)]
    parts += [(name, [r for r in runs if r["arm"] == name]) for name in ARMS[:3]]
    parts += [(f"joint {j + 1}", [r for r in runs if r["joint"] == j]) for j in range(7)]
    ends = (0.1, 0.37, 0.63, 0.9)
    parts += [
        (f"at {100 * a:.0f} to {100 * b:.0f} %", [r for r in runs if a <= r["when"] < b])
        for a, b in pairwise(ends)
    ]
    lines = []
    for what, some in parts:
        for kind in FEASIBLE if what == "all" else FEASIBLE[:2]:
            of = [r for r in some if r["feasible"] == kind]
            if of:
                lines.append((what, kind, *(interval(sum(r[s] for r in of), len(of)) for s in SETTINGS)))
    return lines


if __name__ == "__main__":
    sys.exit(main())
