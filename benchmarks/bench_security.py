"""N-1 on line: locks survived on random paths, with the null space led by what a lock would cost and without.

    python benchmarks/bench_security.py           40 paths for each of three arms
    python benchmarks/bench_security.py --quick   6

An arm (Panda, iiwa14, xarm7) follows a line of 0.1 to 0.4 m and up to 0.6 rad from a random posture, by the
clock, without a plan. At each eighth of the way each joint is locked, one at a time, and the rest of the path
is followed to its end: survived is a tip that is never farther off than 2 mm and 0.02 rad. Each path is
followed with the scheme mvn, with rmp, and with rmp led by ``NMinusOne``. What was foretold is compared with
what happens over the horizon: right is a lock that was survived where it was said to be, and lost where not.
"""

import os
import sys
from time import perf_counter

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402
from bench import command_line, docs  # noqa: E402
from bench.tables import Table, quantity  # noqa: E402

import ftqp  # noqa: E402
from ftqp.core.pose import rotation_exp  # noqa: E402

ARMS = ("panda", "iiwa14", "xarm7")
SEED, DT, EIGHTHS = 20261130, 2e-3, 8
ON, TURNED = 2e-3, 0.02
FASTEST, FASTEST_TURN = 0.25, 0.75
WAYS = ("mvn", "rmp", "N-1")
LIMITATIONS = (
    "Locks are reported at once and brake as the planner's default has it; no obstacles.",
    "Paths whose healthy motion leaves them are drawn again: what is asked is what a lock costs.",
    "Foretold is compared over the horizon only, with the same program that foretells.",
)


def drawn(arm: str, k: int):
    """A start and a path that the healthy arm follows."""
    robot = ftqp.robots.load(arm)
    low, high = robot.limits.q_min, robot.limits.q_max
    generator = np.random.default_rng([SEED, ARMS.index(arm), k])
    while True:
        q = generator.uniform(low + 0.1 * (high - low), high - 0.1 * (high - low))
        way, spin = (generator.standard_normal(3) for _ in range(2))
        goal = robot.pose(q)
        far, angle = generator.uniform(0.1, 0.4), generator.uniform(0.0, 0.6)
        goal[:3, 3] += far * way / np.linalg.norm(way)
        goal[:3, :3] = rotation_exp(angle * spin / np.linalg.norm(spin)) @ goal[:3, :3]
        duration = max(2.0, 1.875 * far / FASTEST, 1.875 * angle / FASTEST_TURN)
        path = ftqp.paths.PointToPoint(robot.pose(q), goal, duration=duration)
        J = robot.jacobian(q) * np.array([1.0, 1.0, 1.0, *3 * [robot.length]])[:, None]
        if np.linalg.svd(J, compute_uv=False)[-1] < 0.2 * robot.length:
            continue
        _, errors, _, _ = followed(robot, q, path, "mvn")
        if errors.max() <= 1.0:
            return robot, q, path


def planner_of(robot, way: str):
    """A planner that follows by the clock."""
    task = ftqp.Task(degrade=())
    more = {"n_minus_one": ftqp.NMinusOne(waits=True)} if way == "N-1" else {"scheme": way}
    return ftqp.Planner(robot, DT, task=task, emergency=None, **more)


def followed(robot, q, path, way: str):
    """Joints and speeds at every tick, errors in tolerances, what was foretold, and the median tick [us]."""
    planner = planner_of(robot, way)
    planner.reset(q)
    planner.foresee(path)
    samples = path.sample(np.minimum(DT * np.arange(round(path.duration / DT) + 1), path.duration))
    targets = ftqp.Targets(samples.pose, samples.twist, samples.acceleration)
    v, rows, errors, told, took = np.zeros(robot.nv), [(q, np.zeros(robot.nv))], [], {}, []
    for k in range(len(targets)):
        began = perf_counter()
        step = planner.step(q, v, targets.at(k))
        took.append(perf_counter() - began)
        errors.append(max(step.position_error / ON, step.rotation_error / TURNED))
        q, v = step.reference.q.copy(), step.reference.v.copy()
        rows.append((q, v))
        if planner.security is not None:
            told[planner.security.tick] = planner.security
    return rows, np.array(errors), told, 1e6 * float(np.median(took))


def locked(robot, rows, path, at: int):
    """Which joints may lock at a tick: within tolerances to the end, and within the horizon."""
    samples = path.sample(np.minimum(DT * np.arange(at, round(path.duration / DT) + 1), path.duration))
    targets = ftqp.Targets(samples.pose, samples.twist, samples.acceleration)
    planner = planner_of(robot, "rmp")
    q, v = rows[at]
    done = ftqp.batch.rollout(
        planner, q, v, targets, faults=[ftqp.Locked(joint) for joint in robot.joints], threads=1
    )
    return (done.position_error <= ON) & (done.rotation_error <= TURNED)


def study(arm: str, count: int) -> dict:
    """Shares of locks that are survived, by way, and how often what was foretold is right."""
    survived = {way: [] for way in WAYS}
    right, wrong, us = 0, 0, {way: [] for way in WAYS}
    for k in range(count):
        command_line.say(f"{arm}: path {k + 1} of {count}")
        robot, q, path = drawn(arm, k)
        for way in WAYS:
            rows, _, told, median = followed(robot, q, path, way)
            us[way].append(median)
            ticks = [round(j * (len(rows) - 1) / EIGHTHS) for j in range(EIGHTHS)]
            for at in ticks:
                survived[way].append(locked(robot, rows, path, at))
            if way == "N-1":
                for at in list(told)[:: max(1, len(told) // EIGHTHS)]:
                    left = path.duration - at * DT
                    if left > ftqp.NMinusOne().horizon:
                        continue  # the end of the path lies within the horizon: what is foretold is all of it
                    happens = locked(robot, rows, path, at)
                    said = np.array([loss.survived for loss in told[at].losses])
                    right += int((happens == said).sum())
                    wrong += int((happens != said).sum())
    return {
        "arm": arm, "paths": count,
        "survived": {way: float(np.mean(survived[way])) for way in WAYS},
        "right": right, "asked": right + wrong, "us": {way: float(np.median(us[way])) for way in WAYS},
    }  # fmt: skip


def main() -> int:
    """Follow, lock, print, write; 0 when done, 2 for bad input."""
    options = docs.asked(__doc__, "6 paths for each arm", paths=(40, "for each arm"))
    count = 6 if options.quick else options.paths
    rows = [study(arm, count) for arm in ARMS]
    result = docs.measured("bench_security", {"paths": count, "seed": SEED, "dt": DT}, rows, LIMITATIONS)
    lines = [
        (r["arm"], str(r["paths"]), *(f"{100.0 * r['survived'][way]:.1f} %" for way in WAYS),
         f"{r['right']} of {r['asked']}", *(quantity(r["us"][way]) for way in ("rmp", "N-1")))
        for r in rows
    ]  # fmt: skip
    table = Table(
        title="Locks survived to the end of random paths",
        headings=("arm", "paths", *WAYS, "foretold right", "tick of rmp, p50 [us]", "tick of N-1"),
        rows=lines,
        notes=("Every joint is locked at every eighth of each path, and the rest of it followed.",),
    )
    docs.publish(result, "Any one joint may lock", [table], options)
    return 0


if __name__ == "__main__":
    sys.exit(main())
