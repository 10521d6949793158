"""Upper bodies of published robots reach with both hands, and each of their joints locks once on the way.

Baxter, TIAGo Pro, Talos and G1, read from their URDFs in one line with both hands as tips. Each hand goes
to a place of its own, 0.1 m away in a random direction, in 2 s, the first by its task, the other by a
task on level 0. Every joint locks once on each of 10 pairs of ways that the healthy robot finishes.
Places, limits and what is said are judged from outside: by pinocchio, by the URDF's limits, and OK at
last only where both hands are there.

    python studies/two_hands.py [--quick] [--out DIR] [--json]     needs pip install -e ".[robots]"

Full study: about five minutes on one core. Results go to ``studies/results`` unless --out says otherwise.
"""

import argparse
import json
import platform
import sys
from datetime import date
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from bench import results

import ftqp

FILES = {
    "Baxter": ("baxter_description/urdf/baxter.urdf", ("left_gripper_base_link", "right_gripper_base_link")),
    "TIAGo Pro": (
        "tiago_pro_description/robots/tiago_pro.urdf", ("gripper_left_base_link", "gripper_right_base_link")
    ),
    "Talos": ("talos_data/robots/talos_reduced.urdf", ("gripper_left_base_link", "gripper_right_base_link")),
    "G1": ("g1_description/urdf/g1_29dof_rev_1_0.urdf", ("left_rubber_hand", "right_rubber_hand")),
}  # fmt: skip
DT, TICKS, WAY = 0.002, 1500, 0.1
PAIRS, QUICK_PAIRS = 10, 1
THERE = 1e-3
"""A hand has arrived within this distance of its place [m]."""
SEED = 20261125
PACKAGES = ("ftqp", "numpy", "numba", "pin", "example-robot-data")


def folder() -> Path:
    """Where the URDFs are."""
    found = next(Path(sys.prefix).glob("**/share/example-robot-data/robots"), None)
    if found is None:
        raise SystemExit('example-robot-data is not installed: pip install -e ".[robots]"')
    return found


def reach(robot: Any, ways: Any, level: str, lock: int | None) -> dict[str, Any]:
    """One run: what is left for each hand, whether limits were kept, and whether OK was said wrongly."""
    tasks = [ftqp.Task("position"), ftqp.PoseTask(robot.tips[1], rows="position", level=0)]
    planner = ftqp.Planner(robot, DT, level=level, tasks=tasks)
    q, limits, kept = robot.neutral.copy(), robot.limits, True
    planner.reset(q)
    paths = [
        ftqp.paths.Line(robot.pose(q, tip), way, duration=0.7 * TICKS * DT)
        for tip, way in zip(robot.tips, ways, strict=True)
    ]
    samples = [path.sample(DT * np.arange(TICKS)) for path in paths]
    targets = [ftqp.Targets(one.pose, one.twist, one.acceleration) for one in samples]
    for k in range(TICKS):
        if lock is not None and k == TICKS // 4:
            planner.report(ftqp.Locked(lock))
        step = planner.step(q, None, {"tip": targets[0].at(k), robot.tips[1]: targets[1].at(k)})
        q = step.q.copy()
        kept &= bool((q >= limits.q_min - 1e-9).all() and (q <= limits.q_max + 1e-9).all())
        kept &= bool((np.abs(step.v) <= limits.v_max + 1e-9).all())
    left = distances(robot, q, samples, -1)
    wrong = step.status is ftqp.StepStatus.OK and max(left) > THERE
    return {"left": left, "kept": kept, "wrong": wrong, "end": step.status.name}


def distances(robot: Any, q: Any, samples: Any, k: int) -> list[float]:
    """How far each tip is from its place at a tick [m]."""
    places = zip(robot.tips, samples, strict=True)
    return [float(np.linalg.norm(robot.pose(q, tip)[:3, 3] - one.pose[k][:3, 3])) for tip, one in places]


def study(pairs: int) -> list[dict[str, Any]]:
    """All robots, levels and joints."""
    runs = []
    for name, (file, tips) in FILES.items():
        robot = ftqp.Robot.from_urdf(folder() / file, tips=tips)
        rng, drawn = np.random.default_rng(SEED), []
        for _ in range(20 * pairs):
            ways = rng.normal(size=(2, 3))
            ways *= WAY / np.linalg.norm(ways, axis=1, keepdims=True)
            healthy = [reach(robot, ways, level, None) for level in ("velocity", "acceleration")]
            if max(left for one in healthy for left in one["left"]) < THERE:
                drawn.append(ways)
            if len(drawn) == pairs:
                break
        for level in ("velocity", "acceleration"):
            for lock, joint in enumerate(robot.joints):
                runs += [
                    {"robot": name, "joints": robot.nv, "level": level, "joint": joint,
                     **reach(robot, ways, level, lock)}
                    for ways in drawn
                ]  # fmt: skip
    return runs


def table(runs: list[dict[str, Any]], seconds: float) -> str:
    """The report."""
    versions = ", ".join(map(" ".join, results.packages(PACKAGES).items()))
    lines = [
        "# Upper bodies reach with both hands, and a joint locks",
        "",
        f"`python studies/two_hands.py`, {date.today()}, {platform.machine()} {platform.system()}, Python "
        f"{platform.python_version()}, {versions}; dt {DT} s, {seconds:.0f} s on one core.",
        "",
        "| robot | joints | level | runs | both hands there | second hand there | limits kept | "
        "OK at last though not there | joints whose lock one hand never survives |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name in FILES:
        for level in ("velocity", "acceleration"):
            rows = [run for run in runs if run["robot"] == name and run["level"] == level]
            joints = dict.fromkeys(run["joint"] for run in rows)
            fatal = [
                joint
                for joint in joints
                if not any(max(run["left"]) < THERE for run in rows if run["joint"] == joint)
            ]
            lines.append(
                f"| {name} | {rows[0]['joints']} | {level} | {len(rows)} | "
                f"{sum(max(run['left']) < THERE for run in rows)} | "
                f"{sum(run['left'][1] < THERE for run in rows)} | {sum(run['kept'] for run in rows)} | "
                f"{sum(run['wrong'] for run in rows)} | {', '.join(fatal) or 'none'} |"
            )
    lines += [
        "",
        "What this does not say: one posture of each robot, places 0.1 m away, joints that lock at once,",
        "robots that do what they are told; hands that have to keep clear of each other and of the body.",
        "",
    ]
    return "\n".join(lines)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help=f"{QUICK_PAIRS} pair of ways")
    results.add_out(parser, "two_hands")
    parser.add_argument("--json", action="store_true", help="print every run as JSON and write nothing")
    given = parser.parse_args()
    began = perf_counter()
    runs = study(QUICK_PAIRS if given.quick else PAIRS)
    if given.json:
        print(json.dumps(runs))
        return
    report = table(runs, perf_counter() - began)
    stem = results.stem("two_hands", name=None, quick=given.quick)
    results.written({"runs": runs}, report, given.out, stem)
    print(report)


if __name__ == "__main__":
    main()
