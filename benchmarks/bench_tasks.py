"""Several tasks at once, beside placo with the same ones.

    python benchmarks/bench_tasks.py              prints the table, and writes it to benchmarks/results
    python benchmarks/bench_tasks.py --quick      a few steps, to see that it runs; nothing is written

A Panda follows poses, keeps its elbow at a height and has an axis look at a place, on level 3 and once more
on level 2; two Pandas on one base carry a bar along poses, the grip a hard relative task. Both programs are
called as their READMEs say, with fresh arrays in every tick, follow the same targets in closed loop, and take
turns, a chunk at a time. At torque level placo has no task for an axis, and keeps an orientation instead. No
figure is a pass or a fail.
"""

import platform
import sys
import tempfile
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
from bench import cases, command_line, results
from bench.urdf import TIP, Arm, text
from bench.worker import Case
from steps import environments
from steps.measure import Settings, Worker, WorkerFailed, last_core
from steps.own_tasks import HANDS

import ftqp

RESULTS = Path(__file__).resolve().parent / "results" / "bench_tasks.md"
FULL = Settings(steps=6_000, chunk=500, warm=1000)
QUICK = Settings(steps=100, chunk=50, warm=50)
PLACO = next(peer for peer in environments.PEERS if peer.name == "placo")


def targets(robot: Any, q: Any) -> Any:
    """Poses of the tip, one a step: forth and back by a tenth of a metre and a few degrees."""
    rise = (1.0 - np.cos(2.0 * np.pi * np.arange(cases.PERIOD) / cases.PERIOD)) / 2.0
    start = robot.pose(q)
    poses = np.repeat(start[None], cases.PERIOD, axis=0)
    poses[:, :3, 3] += rise[:, None] * np.array([-0.05, 0.02, 0.06])
    return poses


def of(name: str, level: str) -> Case:
    """One robot and its tip's targets at a level."""
    robot = ftqp.robots.load(name)
    if name == "panda":
        urdf, tip = text(name, Arm.of(robot)), TIP
    else:
        urdf, tip = robot.to_urdf(), HANDS[0]
    limits, q = robot.limits, robot.neutral
    poses = targets(robot, q)
    return Case(
        robot=name, level=level, locked=None, dt=cases.DT, urdf=urdf, tip=tip, joints=robot.joints,
        kp=cases.KP, kv=cases.KV, gain=cases.GAIN, q=q, poses=poses, twists=np.zeros((len(poses), 6)),
        q_min=limits.q_min, q_max=limits.q_max, v_max=limits.v_max, a_max=limits.a_max,
        tau_max=limits.tau_max,
    )  # fmt: skip


def measured(case: Case, workers: list[Worker], settings: Settings, file: Path) -> dict[str, Any]:
    """Medians [us] and what each program says of its steps, by variant."""
    case.save(file)
    turns, found = [], {}
    for worker in workers:
        answer = worker.ask(open=str(file), way="readme")
        for name in answer["variants"]:
            counts = worker.ask(warm=name, steps=settings.warm)["counts"]
            turns.append((worker, name))
            found[name] = {"ns": [], "said": counts}
    for _ in range(settings.steps // settings.chunk):
        for worker, name in turns:
            read = worker.ask(chunk=name, steps=settings.chunk, discard=settings.discard)
            found[name]["ns"] += read["ns"]
    return {
        name: {"us": float(np.median(one["ns"])) / 1e3, "said": one["said"]} for name, one in found.items()
    }


def table(rows: list[tuple[str, str, dict[str, Any]]]) -> str:
    """The report."""
    versions = ", ".join(map(" ".join, results.packages(("ftqp", "numpy", "numba", "pin")).items()))
    lines = [
        "# Several tasks at once",
        "",
        f"`python benchmarks/bench_tasks.py`, {date.today()}, Python {platform.python_version()},",
        f"{versions}:",
        "medians of whole steps in microseconds, all in one run.",
        "",
        "| robot | level | ftqp | placo | ftqp / placo | tip alone | all / tip alone | level 2 / tip alone |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for robot, level, found in rows:
        ours, theirs = found["ftqp"]["us"], found.get("placo", {}).get("us", float("nan"))
        alone = found.get("ftqp, tip alone", {}).get("us")
        strict = found.get("ftqp, level 2", {}).get("us")
        more = "| | | |" if alone is None else f"| {alone:.2f} | {ours / alone:.2f} | {strict / alone:.2f} |"
        lines.append(f"| {robot} | {level} | {ours:.2f} | {theirs:.1f} | {ours / theirs:.2f} {more}")
    return "\n".join([*lines, ""])


def main() -> int:
    """The command line."""
    parser = command_line.parser(__doc__)
    parser.add_argument("--quick", action="store_true", help="a few steps; nothing is written")
    parser.add_argument("--environments", type=Path, default=environments.DEFAULT, help="where placo's is")
    given = parser.parse_args()
    settings = QUICK if given.quick else FULL
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        try:
            python = environments.python_of(PLACO, given.environments)
        except environments.NotInstalled as error:
            print(f"{error}: nothing was measured", file=sys.stderr)
            return 2
        core = last_core()
        workers = [
            Worker("ftqp", Path(sys.executable), "steps.own_tasks", log=place / "own.log", core=core),
            Worker("placo", python, "steps.peer_placo_tasks", log=place / "placo.log", core=core),
        ]
        try:
            for robot in ("panda", "dual_panda"):
                for level in cases.LEVELS:
                    rows.append(
                        (robot, level, measured(of(robot, level), workers, settings, place / "case.npz"))
                    )
        except WorkerFailed as error:
            print(error, file=sys.stderr)
            return 1
        finally:
            for worker in workers:
                worker.close()
    report = table(rows)
    print(report)
    for robot, level, found in rows:
        print(robot, level, {name: one["said"] for name, one in found.items()})
    if not given.quick:
        results.written({"rows": rows}, report, RESULTS.parent, RESULTS.stem)
    return 0


if __name__ == "__main__":
    sys.exit(main())
