"""The median, the 99.9th percentile and the longest of every kind of step, called once a millisecond.

    python benchmarks/bench_kinds_of_step.py           5 s of each kind
    python benchmarks/bench_kinds_of_step.py --quick   0.5 s

A Panda follows a line of 0.2 m and back, and obeys exactly; between two steps the process sleeps. The tail of
a machine that others share is mostly theirs: compare with the step that does nothing.
"""

import argparse
import sys
from time import perf_counter, sleep

import numpy as np
from bench import command_line, docs
from bench.results import circumstances
from bench.tables import Table, quantity

import ftqp

DT, WARM = 1e-3, 100
PANDA = ftqp.robots.load("panda")
ELBOW = tuple(PANDA.pose(PANDA.neutral, "panda_joint4")[:3, 3])
RNG = np.random.default_rng(20261201)
LIMITATIONS = ("Threads of N-1 share the machine's cores with the loop that is measured.",)


def scene_of(balls: int) -> ftqp.Scene:
    """A wall and a post that the arm keeps clear of, and a cloud of so many balls."""
    scene = ftqp.Scene()
    scene.add("wall", ftqp.Box((0.1, 1.0, 1.0), (0.95, 0.0, 0.5)))
    scene.add("post", ftqp.Cylinder(0.05, 1.0, (0.2, 0.6, 0.5)))
    if balls:
        scene.update(
            np.column_stack([RNG.uniform((0.8, -1, 0), (1.0, 1, 1), (balls, 3)), np.full(balls, 0.02)])
        )
    return scene


KINDS = {
    "plain": {},
    "velocity level": {"level": "velocity"},
    "one joint locked": {},
    "a joint swings freely": {"drive": "torque"},
    "torque drive": {"drive": "torque"},
    "with a detector": {"detector": ftqp.Detector()},
    "two tasks": {"tasks": [ftqp.Task(), ftqp.PositionTask("panda_joint4", target=ELBOW, weight=0.1)]},
    "beside a scene": {"scene": 0},
    "among 1,000 balls": {"scene": 1000},
    "along a path by its progress": {"task": ftqp.Task(mode="scaled")},
    "N-1": {"n_minus_one": ftqp.NMinusOne()},
    "N-1, waits": {"n_minus_one": ftqp.NMinusOne(waits=True)},
}


def times_of(kind: str, steps: int) -> np.ndarray:
    """How long each step took, (steps,) [us]."""
    given = dict(KINDS.get(kind, {}))
    if "scene" in given:
        given["scene"] = scene_of(given["scene"])
    planner = ftqp.Planner(PANDA, DT, emergency=None, **given)
    start = PANDA.neutral
    line = ftqp.paths.Line(PANDA.pose(start), displacement=(0.0, 0.2, 0.0), duration=0.5 * DT * steps)
    leader = ftqp.PathFollower(planner, line) if kind.startswith("along") else planner
    leader.reset(start)
    planner.foresee(line)
    if kind == "one joint locked":
        planner.report(ftqp.Locked(2))
    if kind == "a joint swings freely":
        planner.report(ftqp.FreeSwinging(5))
    there = DT * np.arange(steps + WARM)
    sampled = line.sample(np.minimum(there, line.duration))
    targets = ftqp.Targets(sampled.pose, sampled.twist, sampled.acceleration)
    q, took = start.copy(), np.zeros(steps + WARM)
    for k in range(steps + WARM):
        began = perf_counter()
        if kind != "nothing":
            step = leader.step(q, None) if leader is not planner else leader.step(q, None, targets.at(k))
            q = step.q
        took[k] = perf_counter() - began
        q = q.copy()
        sleep(max(0.0, DT - (perf_counter() - began)))
    return 1e6 * took[WARM:]


def main() -> int:
    """Step, print, write; 0 when done, 2 for bad input."""
    parser = command_line.parser(__doc__)
    parser.add_argument("--quick", action="store_true", help="0.5 s of each kind")
    docs.options(parser)
    options: argparse.Namespace = parser.parse_args()
    steps = 500 if options.quick else 5000
    rows = []
    for kind in ("nothing", *KINDS):
        us = times_of(kind, steps)
        rows.append(
            {
                "kind": kind,
                "p50": float(np.median(us)),
                "p999": float(np.percentile(us, 99.9)),
                "max": float(us.max()),
            }
        )
    result = {
        **circumstances("bench_kinds_of_step", [], {"steps": steps, "dt": DT}),
        "rows": rows, "limitations": list(LIMITATIONS),
    }  # fmt: skip
    table = Table(
        title="Every kind of step of a Panda, once a millisecond [us]",
        headings=("kind", "p50", "p99.9", "longest"),
        rows=[(row["kind"], *(quantity(row[part]) for part in ("p50", "p999", "max"))) for row in rows],
        notes=("The longest of each is one step: what else the machine does at that instant counts.",),
    )
    docs.told(result, "Every kind of step", [table], options)
    return 0


if __name__ == "__main__":
    sys.exit(main())
