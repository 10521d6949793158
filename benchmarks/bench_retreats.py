"""Retreats: joints lock on random motions, and the arm takes the first of its ways out.

    python benchmarks/bench_retreats.py           50 motions of each of three arms
    python benchmarks/bench_retreats.py --quick   8 of each
    python benchmarks/bench_retreats.py --only-mujoco 700   so many of each in MuJoCo, and nothing else

A tip goes along a line of 0.1 to 0.4 m and up to 0.6 rad from a random posture that is neither near a
singularity nor at limits; between a fifth and nine tenths of its time a random joint locks, is told at
once, and planner.ways_out() is asked in that tick, while the arm moves. It then follows what comes first.
Beside it, a good engineer's way: the tip straight back to where it began. The arm does what it is told, and
once more it is one in MuJoCo; this needs pip install "ftqp[sim]".
"""

import argparse
import os
import sys
from time import thread_time

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402
from bench import command_line, docs  # noqa: E402
from bench.tables import Table, quantity  # noqa: E402
from peers.motion_case import turn  # noqa: E402
from rich.console import Console  # noqa: E402

import ftqp  # noqa: E402
from ftqp.app.campaign.campaign_summary import share_interval  # noqa: E402

ARMS = ("panda", "iiwa14", "xarm7")
SEED, DT, LONGEST = 20261129, 2e-3, 30.0
ARRIVED, IN_PHYSICS, SIGMA = 2e-3, 5e-3, 1e-4
"""A joint so near to its place has arrived [rad], in MuJoCo, and the noise of encoders there [rad]."""
LIMITATIONS = (
    "No obstacles, and no contact of the arm with itself.",
    "In MuJoCo joints are behind servos, encoders have a noise of 1e-4 rad, the lock is a brake that closes.",
)


def motion(robot, generator):
    """A start, a path of the tip from there, the joint that locks, and when [s]."""
    low, high = robot.limits.q_min, robot.limits.q_max
    low, high = np.maximum(low, -np.pi), np.minimum(high, np.pi)
    while True:
        q = generator.uniform(low + 0.1 * (high - low), high - 0.1 * (high - low))
        J = robot.jacobian(q) * np.array([1.0, 1.0, 1.0, *3 * [robot.length]])[:, None]
        if np.linalg.svd(J, compute_uv=False)[-1] > 0.3 * robot.length:
            break
    goal = robot.pose(q).copy()
    way, spin = (generator.standard_normal(3) for _ in range(2))
    goal[:3, 3] += generator.uniform(0.1, 0.4) * way / np.linalg.norm(way)
    goal[:3, :3] = turn(generator.uniform(0.0, 0.6) * spin / np.linalg.norm(spin)) @ goal[:3, :3]
    path = ftqp.paths.PointToPoint(robot.pose(q), goal, duration=4.0)
    return q, path, int(generator.integers(robot.nv)), generator.uniform(0.2, 0.9) * path.duration


def locked(robot, q, path, joint: int, at: float):
    """A planner in the tick of the lock, and the arm there; None if the healthy arm was stopped before."""
    planner = ftqp.Planner(robot, DT, remember=20.0)
    planner.reset(q)
    samples = path.sample(np.arange(round(at / DT)) * DT)
    targets, v = ftqp.Targets(samples.pose, samples.twist, samples.acceleration), np.zeros(robot.nv)
    for k in range(len(targets)):
        step = planner.step(q, v, targets.at(k))
        q, v = step.q.copy(), step.v.copy()
    if planner.stopped_because is not None:
        return None
    planner.report(ftqp.Locked(joint))
    return planner, q, v


def gone(goto, q, v):
    """Where an arm ends that is led, and how long it takes [s]."""
    k = 0
    while not goto.done and k < LONGEST / DT:
        step = goto.step(q, v)
        q, v, k = step.q.copy(), step.v.copy(), k + 1
    return q, k * DT


def in_physics(robot, q, v, joint: int, way, seed: int) -> bool:
    """Whether the way ends where it was announced in MuJoCo, with a brake that closes and noisy encoders."""
    planner = ftqp.Planner(robot, DT, noise=ftqp.Noise(q=SIGMA))
    planner.reset(q, v)
    planner.report(ftqp.Locked(joint))
    plant, generator = ftqp.MujocoPlant(robot, DT, seed=seed), np.random.default_rng(seed)
    plant.reset(q, v)
    plant.fail(ftqp.Locked(joint))
    goto, k = ftqp.GoTo(planner, way=way), 0
    while not goto.done and k < LONGEST / DT:
        plant.advance(goto.step(plant.q + SIGMA * generator.standard_normal(len(q)), None))
        k += 1
    free = np.arange(robot.nv) != joint
    off = float(np.abs(plant.q - way.places[-1])[free].max())
    return (goto.status is ftqp.GoToStatus.REACHED and off < IN_PHYSICS) == way.clear


def mujoco_row(name: str, count: int, seed: int) -> tuple[str, ...]:
    """Of so many motions of an arm, how many end in MuJoCo otherwise than announced, and an interval."""
    robot, runs, wrong, k = ftqp.robots.load(name), 0, 0, -1
    while runs < count:
        k += 1
        generator = np.random.default_rng([seed, ARMS.index(name), k])
        start, path, joint, at = motion(robot, generator)
        there = locked(robot, start, path, joint, at)
        if there is None:
            continue
        planner, q, v = there
        way = planner.ways_out()[0]
        runs += 1
        if not in_physics(robot, q, v, joint, way, k):
            wrong += 1
            sys.stderr.write(f"{name} {k} in MuJoCo: not so: {way.sentence}\n")
    low, high = share_interval(wrong, runs) or (0.0, 1.0)
    return name, str(runs), f"{wrong} ({100.0 * low:.2g} to {100.0 * high:.2g} %)"


def measured(name: str, count: int) -> dict[str, object]:
    """Counts of one arm."""
    robot = ftqp.robots.load(name)
    took, kinds, announced, as_said, began, straight, late, physics = [], {}, 0, 0, 0, 0, [], 0
    k = -1
    while len(took) < count:
        k += 1
        generator = np.random.default_rng([SEED, ARMS.index(name), k])
        start, path, joint, at = motion(robot, generator)
        there = locked(robot, start.copy(), path, joint, at)
        if there is None:
            continue
        planner, q, v = there
        first = thread_time()
        ways = planner.ways_out()
        took.append(1e3 * (thread_time() - first))
        way = ways[0]
        kinds[way.kind] = kinds.get(way.kind, 0) + 1
        announced += way.clear
        as_in_physics = in_physics(robot, q, v, joint, way, k)
        physics += as_in_physics
        if not as_in_physics:
            sys.stderr.write(f"{name} {k} in MuJoCo: not so: {way.sentence}\n")
        goto = ftqp.GoTo(planner, way=way)
        end, time = gone(goto, q, v)
        free = np.arange(robot.nv) != joint
        there = bool(np.abs(end - way.places[-1])[free].max() < ARRIVED)
        as_said += there == way.clear
        if there != way.clear:
            sys.stderr.write(f"{name} {k}: {way.sentence}, and then {goto.sentence}\n")
        late.append(abs(time - way.time))
        began += there and bool(np.abs(end - start)[free].max() < 0.05)
        planner, q, v = locked(robot, start.copy(), path, joint, at)
        goto = ftqp.GoTo(planner, pose=path.start, straight=True)
        gone(goto, q, v)
        straight += goto.status is ftqp.GoToStatus.REACHED
    return {
        "arm": name, "motions": count, "clear": announced, "as_said": as_said, "began": began,
        "straight": straight, "physics": physics,
        "kinds": kinds, "p50": float(np.median(took)), "p99": float(np.percentile(took, 99.0)),
        "late": float(np.median(late)),
    }  # fmt: skip


def main() -> int:
    """Measure, print, write; 0 when done, 2 for bad input."""
    options = _options()
    if options.only_mujoco:
        headings = ("arm", "motions", "not as announced in MuJoCo (95 %)")
        lines = [mujoco_row(name, options.only_mujoco, options.seed) for name in ARMS]
        table = Table(title="Ways out in MuJoCo", headings=headings, rows=lines)
        Console(highlight=False).print(table.rich())
        return 0
    count = 8 if options.quick else options.motions
    rows = [measured(name, count) for name in ARMS]
    result = docs.measured("bench_retreats", {"motions": count, "seed": SEED, "dt": DT}, rows, LIMITATIONS)
    headings = (
        "arm", "motions", "a way is clear", "it ends as announced", "in MuJoCo, too", "joints left are back",
        "tip straight back", "asking, p50 [ms]", "p99", "time off [s], p50",
    )  # fmt: skip
    keys = ("motions", "clear", "as_said", "physics", "began", "straight")
    lines = [
        (r["arm"], *(str(r[key]) for key in keys), *(quantity(r[key]) for key in ("p50", "p99", "late")))
        for r in rows
    ]
    notes = ("Asking is processor time; the last column is how far the announced time is off.",)
    table = Table(title="Ways out after a lock on the way", headings=headings, rows=lines, notes=notes)
    docs.told(result, "Retreats", [table], options)
    return 0


def _options() -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    told = "of each arm (default 50)"
    parser.add_argument("--motions", type=command_line.at_least_one, default=50, metavar="N", help=told)
    parser.add_argument("--quick", action="store_true", help="8 of each arm")
    told = "of each arm in MuJoCo and nothing else; prints only"
    parser.add_argument("--only-mujoco", type=command_line.at_least_one, metavar="N", help=told)
    parser.add_argument("--seed", type=int, default=SEED, help=f"of those (default {SEED})")
    docs.options(parser)
    options: argparse.Namespace = parser.parse_args()
    return options


if __name__ == "__main__":
    sys.exit(main())
