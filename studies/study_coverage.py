"""Prediction against execution: do locks end as `coverage` says, in closed loop and in physics?

    python studies/study_coverage.py             200 random locks of each scenario, motion and world
    python studies/study_coverage.py --cases 20  a look
    python studies/study_coverage.py --keep DIR  keep the plans, which take longest

Every bundled scenario of this kind is taken with two motions: that of the scenario as it is, and its plan by
dynamic programming with a free start. A random joint locks at a random sample, at once, and the planner is
told. What becomes of it is predicted by the continuation of that pair, and then the planner is run in closed
loop on an arm that follows its commands, and, where the arm has masses, on MuJoCo's arm behind position
servos of 15 Hz. A run survives when the true tip, from 0.3 s after the lock to the end, stays within 2 mm and
0.02 rad of the path, 5 mm and 0.03 rad in physics, where servos lag.

A case is borderline, and listed apart, where the prediction has less than 0.01 rad to a limit or more than
0.95 of a speed limit, where the best that is left of a lost pair stays within twice the tolerance, or where
the run's own error is between half the tolerance and twice the tolerance.
"""

import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from bench import command_line, docs
from bench.tables import Table
from scipy.spatial.transform import Rotation

import ftqp
from ftqp.analysis.survival.continuing import continuation_study
from ftqp.app.commands.covering import healthy_motion
from ftqp.app.scenario.setup import load
from ftqp.kernel.layout.enums import SURVIVED, Survival

SCENARIOS = ("zhang7-path", "zhang7-short", "panda-y-line", "iiwa-x-line", "planar3-line")
OWN, PLANNED = "as it is", "plan"
MOTIONS = (OWN, PLANNED)
WORLDS = ("kinematic", "mujoco")
TOLERANCE = {"kinematic": (2e-3, 2e-2), "mujoco": (5e-3, 3e-2)}
"""Largest errors of a run that survives [m, rad]."""
SETTLED = 0.3
"""The error counts from so long after the lock [s]."""
BANDWIDTH = 2.0 * np.pi * 15.0
LIMITATIONS = (
    "In physics the planner's model of the arm is exact; servos, brakes and sampling are not.",
    "Plans are made with the defaults of `ftqp plan`.",
)


@dataclass(frozen=True)
class Subject:
    """A scenario with a motion, in a world.

    Attributes:
        scenario: Its name.
        motion: One of ``MOTIONS``.
        world: One of ``WORLDS``.
        plans: Where plans are kept.
    """

    scenario: str
    motion: str
    world: str
    plans: Path

    @cached_property
    def made(self) -> tuple[Any, Any, Any, Any]:
        """The setup, the task, the joints on it, and continuations."""
        servos = ["planner.drive.bandwidth=94.0"] if self.world == "mujoco" else []
        if self.motion == OWN:
            setup = load(self.scenario, ["faults=", *servos])
            task, q = healthy_motion(setup)
        else:
            setup = load(self.scenario, ["faults=", *servos], plan=self.file)
            found = setup.planner.plan
            task, q = found.task, found.q
        return setup, task, q, continuation_study(task)

    @property
    def file(self) -> Path:
        """Where the plan is kept that makes this motion."""
        return self.plans / f"{self.scenario}.npz"

    def case(self, joint: int, k: int) -> dict[str, Any]:
        """The row of one lock at sample k."""
        setup, task, q, study = self.made
        failed = np.array([joint])
        bounded = setup.robot.nv - 1 > task.m
        told = study.runs(q[k][None], [k], failed, bounded=bounded)
        left = study.runs(q[k][None], [k], failed, bounded=True, whole=True)
        error, turned, ended = self.ridden(joint, float(task.t[k]))
        return {
            "scenario": self.scenario, "motion": self.motion, "world": self.world, "joint": joint,
            "at": float(task.t[k]), "status": Survival(told.status[0]).name,
            "margin": float(min(told.margin[0], 1e9)), "hurry": float(told.hurry[0]),
            "left": float(left.position[0]), "turned_left": float(left.rotation[0]), "error": error,
            "turned": turned, "ended": ended,
        }  # fmt: skip

    def ridden(self, joint: int, at: float) -> tuple[float, float, str]:
        """The true tip's largest errors once it has settled [m, rad], and how the run ended."""
        setup, task, _, _ = self.made
        robot, planner, dt = setup.robot, setup.planner, setup.planner.dt
        for name in list(planner.faults):
            planner.withdraw(name)
        fault = ftqp.Locked(robot.joints[joint], mode="instant")
        physics = self.world == "mujoco"
        plant: Any = ftqp.KinematicPlant(robot, dt)
        if physics:
            plant = ftqp.MujocoPlant(robot, dt, ftqp.JointServo(robot, "position", bandwidth=BANDWIDTH))
        result = ftqp.Simulation(
            planner, setup.path, q=setup.q, plant=plant, schedule=ftqp.Schedule([ftqp.FaultEvent(at, fault)]),
            log="memory",
        ).run()  # fmt: skip
        log = result.log
        times = log["t"]
        if result.stopped_at is not None and times[-1] < setup.path.duration - dt:
            return np.inf, np.inf, "stopped"
        ticks = np.flatnonzero(times >= min(at + SETTLED, setup.path.duration))[::5]
        ticks = np.append(ticks, len(times) - 1)
        goals = setup.path.sample(times[ticks]).pose
        poses = np.stack([robot.pose(row) for row in log["q"][ticks]])
        counted = np.array([name in task.rows for name in ("x", "y", "z")])
        off = np.linalg.norm((goals[:, :3, 3] - poses[:, :3, 3])[:, counted], axis=1)
        turn = np.zeros(len(ticks))
        if any(name.startswith("r") for name in task.rows):
            apart = goals[:, :3, :3] @ np.swapaxes(poses[:, :3, :3], 1, 2)
            turn = np.linalg.norm(Rotation.from_matrix(apart).as_rotvec(), axis=1)
        return float(off.max()), float(turn.max()), result.final_status.name


def verdicts(row: dict[str, Any]) -> tuple[bool, bool, bool]:
    """Whether a pair survives as predicted and as run, and whether either is borderline."""
    near, turned = TOLERANCE[row["world"]]
    predicted = row["status"] == Survival(SURVIVED).name
    ran = row["error"] <= near and row["turned"] <= turned
    share = max(row["error"] / near, row["turned"] / turned)
    if predicted:
        close = row["margin"] < 0.01 or row["hurry"] > 0.95
    else:
        close = max(row["left"] / near, row["turned_left"] / turned) < 2.0
    return predicted, ran, bool(close or 0.5 <= share <= 2.0)


def _summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Agreement by scenario, motion and world, and every case that disagrees."""
    groups: dict[tuple[str, str, str], list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault((row["scenario"], row["motion"], row["world"]), []).append(row)
    found, apart = [], []
    for (scenario, motion, world), some in groups.items():
        said = [verdicts(row) for row in some]
        clear = [(predicted, ran) for predicted, ran, close in said if not close]
        apart += [
            {**row, "borderline": close}
            for row, (predicted, ran, close) in zip(some, said, strict=True)
            if predicted != ran
        ]
        found.append(
            {
                "scenario": scenario, "motion": motion, "world": world, "cases": len(some),
                "predicted": sum(one[0] for one in said), "ran": sum(one[1] for one in said),
                "clear": len(clear), "agree": sum(predicted == ran for predicted, ran in clear),
            }
        )  # fmt: skip
    return {"groups": found, "apart": apart}


def main() -> int:
    """Run, print, write; 0 when done, 2 for bad input."""
    parser = command_line.parser(__doc__)
    add, whole = parser.add_argument, command_line.at_least_one
    add("--cases", type=whole, default=200, metavar="N", help="random locks each (default 200)")
    add("--seed", type=int, default=12, metavar="K", help="of all cases (default 12)")
    add("--keep", type=Path, metavar="DIR", help="folder in which plans are kept")
    docs.options(parser)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = options.keep or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        _plans(folder)
        subjects = [
            Subject(scenario, motion, world, folder)
            for world in WORLDS
            for scenario in SCENARIOS
            for motion in MOTIONS
            if world == "kinematic" or load(scenario).robot.has_inertia
        ]
        found = _summary(list(_locks(options.seed, options.cases, subjects)))
    settings = {"cases": options.cases, "seed": options.seed}
    result = docs.measured("study_coverage", settings, [], LIMITATIONS, **found)
    docs.publish(result, "Prediction against execution", _tables(found), options)
    return 0


def _locks(seed: int, cases: int, subjects: list[Subject]) -> Iterator[dict[str, Any]]:
    """A row for each random lock of each subject."""
    for item in range(cases * len(subjects)):
        subject, random = subjects[item // cases], np.random.default_rng([seed, item])
        task = subject.made[1]
        yield subject.case(int(random.integers(task.robot.nv)), int(random.integers(1, task.N)))


def _plans(folder: Path) -> None:
    """The plan of every scenario, made where it is not there."""
    for scenario in SCENARIOS:
        file = folder / f"{scenario}.npz"
        if not file.exists():
            setup = load(scenario, ["faults="])
            task, _ = healthy_motion(setup)
            ftqp.analysis.plan(setup.robot, task).save(file)


def _tables(found: dict[str, Any]) -> list[Table]:
    groups = [
        (
            row["scenario"], row["motion"], row["world"], *(str(row[name]) for name in
            ("cases", "predicted", "ran", "clear", "agree")),
        )
        for row in found["groups"]
    ]  # fmt: skip
    apart = [
        (
            row["scenario"], row["motion"], row["world"], str(row["joint"] + 1), f"{row['at']:.2f}",
            row["status"], "-" if row["margin"] > 1e3 else f"{row['margin']:.3f}",
            f"{row['hurry']:.2f}", f"{1e3 * row['left']:.3g}",
            f"{1e3 * row['error']:.3g}", f"{row['turned']:.3f}", "yes" if row["borderline"] else "no",
        )
        for row in found["apart"]
    ]  # fmt: skip
    return [
        Table(
            title="Locks that are survived, as predicted and as run",
            headings=(
                "scenario", "motion", "world", "cases", "predicted", "run", "clear cases", "of these agree"
            ),
            rows=groups,
        ),
        Table(
            title="Every case in which they differ",
            headings=(
                "scenario", "motion", "world", "joint", "at [s]", "predicted", "margin [rad]", "speed, share",
                "best left [mm]", "run off [mm]", "turned [rad]", "borderline",
            ),
            rows=apart,
        ),
    ]  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
