"""Locks on the way past balls: how many arms hit one, with a scene and without.

An arm follows a line of 0.15 to 0.35 m; twelve balls of 5 cm stand around it, each of which the healthy
motion clears by 2 to 8 cm; it clears the arm itself by 2. One joint locks on the way and is reported at once.
The same episode is run by a planner that knows nothing of the balls and by one that was given them. Distances
are those of the arm's capsules.

    python studies/locks_among_balls.py                       350 episodes
    python studies/locks_among_balls.py --episodes 40 --seed 7
"""

import sys
from typing import NamedTuple

import numpy as np
from bench import study
from bench.tables import Table

import ftqp

ARMS = (("panda", 200), ("iiwa14", 150))
DT, SECONDS = 1e-3, 6.0
BALLS, RADIUS = 12, 0.05
KEEP, KEPT = 0.01, 2e-3
"""The clearance that is asked for [m], and how near to its target a tip has kept its task [m]."""
SETTLED = 0.6
"""A tip has so long after the lock until its error counts [s]."""


class Run(NamedTuple):
    """Joint positions, (K, nv); the largest error after the lock [m]; ticks by status."""

    q: np.ndarray
    error: float
    statuses: dict[str, int]


def run(robot, q0, line, joint=None, at=0, scene=None) -> Run:
    """Follows the line by the clock."""
    clearance = None if scene is None else ftqp.Clearance(keep=KEEP)
    planner = ftqp.Planner(robot, DT, scene=scene, clearance=clearance)
    planner.reset(q0)
    way = line.sample(np.arange(round(SECONDS / DT)) * DT)
    q, v, targets = q0, None, ftqp.Targets(way.pose, way.twist, way.acceleration)
    seen, error, statuses = [], 0.0, {}
    for k in range(len(targets)):
        if joint is not None and k == at:
            planner.report(ftqp.Locked(robot.joints[joint]))
        step = planner.step(q, v, targets.at(k))
        q, v = step.q.copy(), step.v.copy()
        seen.append(q)
        statuses[step.status.name] = statuses.get(step.status.name, 0) + 1
        if k > at + SETTLED / DT:
            error = max(error, step.position_error)
    return Run(np.array(seen), error, statuses)


def least(robot, q, centres) -> np.ndarray:
    """The least distance of the arm to each ball over a motion, (B,) [m]."""
    found = []
    for at in range(0, len(centres), 32):
        scene = ftqp.Scene()
        for k, centre in enumerate(centres[at : at + 32]):
            scene.add(f"{k}", ftqp.Sphere(RADIUS, centre))
        planner = ftqp.Planner(robot, DT, scene=scene, clearance=ftqp.Clearance(self_pairs=False))
        per = planner.distances(q)
        names = [str(k) for k in range(len(scene))]
        found += [min(d.min() for (_, ball), d in per.items() if ball == name) for name in names]
    return np.array(found)


def own(robot, q) -> float:
    """The least distance of the arm to itself over a motion [m]."""
    per = ftqp.Planner(robot, DT, clearance=ftqp.Clearance(keep=KEEP)).distances(q)
    return min((float(d.min()) for d in per.values()), default=np.inf)


def draw(robot, rng):
    """A start, a line, its healthy motion, balls, a joint and the tick of its lock; None where none fit."""
    limits = robot.limits
    q0 = limits.q_min + (limits.q_max - limits.q_min) * (0.15 + 0.7 * rng.random(robot.nv))
    T = robot.pose(q0)
    if not (0.25 < np.linalg.norm(T[:2, 3]) < 0.75 and T[2, 3] > 0.1):
        return None
    way = rng.normal(size=3)
    way *= rng.uniform(0.15, 0.35) / np.linalg.norm(way)
    line = ftqp.paths.Line(T, tuple(way), duration=5.0)
    healthy = run(robot, q0, line)
    if healthy.error > 1e-3:
        return None
    q = healthy.q[::50]
    if own(robot, q) < 2.0 * KEEP:
        return None
    points = np.array([[robot.pose(x, joint)[:3, 3] for joint in (*robot.joints, robot.tip)] for x in q[::4]])
    points = points.reshape(-1, 3)
    centres = points[rng.integers(len(points), size=384)] + rng.normal(size=(384, 3)) * 0.15
    centres = centres[(centres[:, 2] > 0.05) & (np.linalg.norm(centres[:, :2], axis=1) > 0.2)]
    gaps = least(robot, q, centres)
    fit = centres[(gaps > 0.02) & (gaps < 0.08)]
    if len(fit) < BALLS:
        return None
    joint, at = int(rng.integers(robot.nv)), int(rng.uniform(0.15, 0.6) * SECONDS / DT)
    return q0, line, fit[:BALLS], joint, at


def measured(counts, seed, verbose):
    """The rows of the table, an arm each."""
    found = []
    for name, count in counts:
        robot, rng, rows = ftqp.robots.load(name), np.random.default_rng(seed), []
        while len(rows) < count:
            drawn = draw(robot, rng)
            if drawn is None:
                continue
            q0, line, balls, joint, at = drawn
            scene = ftqp.Scene()
            for k, centre in enumerate(balls):
                scene.add(f"ball {k + 1}", ftqp.Sphere(RADIUS, centre))
            blind, seeing = (run(robot, q0, line, joint, at, world) for world in (None, scene))
            near = [float(least(robot, one.q[at::5], balls).min()) for one in (blind, seeing)]
            rows.append((*near, blind.error, seeing.error, own(robot, blind.q[at::20])))
            if verbose and near[1] < KEEP - 1e-3:
                print("near", len(rows), robot.joints[joint], at, np.round(rows[-1], 5), seeing.statuses)
            if verbose and min(near[0], rows[-1][4]) > 0.0 and blind.error < KEPT <= seeing.error:
                print("lost", len(rows), robot.joints[joint], at, np.round(rows[-1], 5), seeing.statuses)
        near0, near1, e0, e1, own0 = np.array(rows).T
        harmless = (np.minimum(near0, own0) > 0.0) & (e0 < KEPT)
        found.append(
            {
                "arm": name,
                "locks": count,
                "hits without": int((near0 < 0).sum()),
                "hits with": int((near1 < 0).sum()),
                "nearest with [mm]": round(1e3 * float(near1.min()), 2),
                "harmless": int(harmless.sum()),
                "kept with": int((harmless & (e1 < KEPT)).sum()),
            }
        )
    return found


def tables(found):
    """A row for each arm."""
    named = list(found["rows"][0])
    lines = [tuple(str(row[name]) for name in named) for row in found["rows"]]
    notes = (
        f"Lines of 0.15 to 0.35 m among {BALLS} balls of {1e3 * RADIUS:.0f} mm, `Clearance(keep={KEEP:g})`. "
        "A lock is harmless where the arm that knows of no ball touches nothing and keeps its task within "
        f"{1e3 * KEPT:g} mm.",
    )
    return [Table(title="Arms that hit a ball", headings=named, rows=lines, notes=notes)]


LIMITATIONS = (
    "Distances are those of capsules, which are larger than the links; the arm follows its commands; locks "
    "are reported at once and brake instantly; balls stand still.",
)


def main() -> int:
    """Writes a table: 0 when no arm with a scene came nearer than a millimetre below what it keeps."""
    parser = study.options(__doc__, "locks_among_balls", "20 of each arm")
    parser.add_argument("--episodes", type=int, default=0, help="of each arm, instead of 200 and 150")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--verbose", action="store_true", help="a line for every episode that is lost")
    given = parser.parse_args()
    count = 20 if given.quick else given.episodes
    found = study.on_record(
        given, "Locks on the way past balls",
        lambda given: {"rows": measured([(a, count or n) for a, n in ARMS], given.seed, given.verbose)},
        tables, LIMITATIONS, quick=bool(count),
    )  # fmt: skip
    return int(any(row["nearest with [mm]"] < 1e3 * KEEP - 1.0 for row in found["rows"]))


if __name__ == "__main__":
    sys.exit(main())
