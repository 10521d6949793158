"""Which posture leads after a lock, and which one draws an arm back that is off its plan?

    python studies/study_followed_plans.py            the two questions, some minutes
    python studies/study_followed_plans.py --cases 5  a look

With two joints to spare or more, one is left to choose after a lock. Random joints of a Panda lock at random
samples of three paths for position and tool axis, at once or braking. The planner is run in closed loop from
the plan's begin to the end, and its null space is led by the plan, by the continuation that was verified
(what `ftqp.Planner(plan=plan)` does), or by the posture at the lock.

With one joint to spare a plan has a corridor: postures beside it that survive what it survives. The Panda of
the scenario panda-y-line begins off its plan, by up to 0.6 rad along its self-motion, and is drawn to the
plan (what the planner does) or to the nearest posture of the corridor. What counts is the coverage of the
motion that comes of it.
"""

import argparse
import sys
from typing import Any

import numpy as np
from bench import command_line, docs
from bench.results import circumstances
from bench.tables import Table

import ftqp
from ftqp.analysis.planning.plan_settings import PlanSettings
from ftqp.analysis.survival.continuing import continuation_study
from ftqp.app.run.healthy_motion import task_of
from ftqp.app.scenario.setup import load
from ftqp.kernel.layout.survival import SURVIVED

PATHS = {
    "0.8 m across": ((0.5, -0.4, 0.3), (0.0, 0.8, 0.0)),
    "0.38 m outwards": ((0.3, 0.1, 0.3), (0.38, 0.0, 0.0)),
    "far across": ((0.62, -0.3, 0.2), (0.0, 0.6, 0.1)),
}
LEADERS = ("plan", "continuation", "posture at the lock")
DURATION, TICK, SAMPLE = 6.0, 4e-3, 4e-2
SETTLED = 0.3
NEAR, TURNED = 2e-3, 2e-2
"""A run survives within these errors, from so long after the lock on [s, m, rad]."""
OFFSETS = (-0.6, -0.4, -0.2, -0.1, 0.1, 0.2, 0.4, 0.6)
LIMITATIONS = (
    "The arm does exactly what it is told.",
    "Plans with two joints to spare are made with 120 nodes of 40 waypoints.",
)


class Led:
    """A plan whose postures after a lock are chosen here.

    Args:
        plan: The plan.
        leader: One of ``LEADERS``.
        rows: Postures in place of the plan's, (N + 1, nv) [rad or m].
    """

    def __init__(self, plan: Any, leader: str = "plan", rows: Any = None) -> None:
        self._plan, self._leader = plan, leader
        self.q, self.t = plan.q if rows is None else rows, plan.t

    def of(self, robot: Any) -> "Led":
        """This plan, which has its arm."""
        return self

    def remaining(self, q: Any, at: float, faults: Any) -> Any:
        """As of the plan."""
        return self._plan.remaining(q, at, faults)

    def continuation(self, q: Any, at: float, faults: Any) -> Any:
        """What leads after a lock."""
        if self._leader == "continuation":
            return self._plan.continuation(q, at, faults)
        if self._leader == "plan":
            return None
        first = int(at / (self.t[1] - self.t[0]) + 1e-9)
        return first, np.tile(q, (len(self.t) - first, 1))


def locks(cases: int, seed: int) -> list[dict[str, Any]]:
    """What leads after a lock: runs of every path, leader and way of locking."""
    arm, found = ftqp.robots.load("panda"), []
    for name, (begin, way) in PATHS.items():
        start = np.diag([1.0, -1.0, -1.0, 1.0])
        start[:3, 3] = begin
        path = ftqp.paths.Line(start, way, duration=DURATION)
        settings = PlanSettings(nodes=120, waypoints=40)
        plan = ftqp.analysis.plan(arm, path, rows="position_axis", dt=SAMPLE, settings=settings)
        study, random = continuation_study(plan.task), np.random.default_rng(seed)
        joints, samples = random.integers(arm.nv, size=cases), random.integers(1, plan.task.N, size=cases)
        told = study.runs(plan.q[samples], samples, joints, bounded=True)
        for mode in ("instant", "ramp"):
            for leader in LEADERS:
                planner = ftqp.Planner(
                    arm, dt=TICK, level="velocity", task=ftqp.Task(rows="position_axis"),
                    plan=Led(plan, leader),
                )  # fmt: skip
                faults = [ftqp.Locked(int(j), mode=mode) for j in joints]
                runs = [
                    ridden(planner, path, plan.q[0], fault, float(plan.t[k]))
                    for fault, k in zip(faults, samples, strict=True)
                ]
                off = np.array(runs)
                ran = (off[:, 0] <= NEAR) & (off[:, 1] <= TURNED)
                found.append(
                    {
                        "path": name, "lock": mode, "leader": leader, "cases": cases,
                        "coverage": plan.coverage, "predicted": int((told.status == SURVIVED).sum()),
                        "ran": int(ran.sum()), "braking": float(np.median(off[ran, 2])),
                        "worst_braking": float(off[ran, 2].max(initial=0.0)),
                    }
                )  # fmt: skip
    return found


def ridden(planner: Any, path: Any, start: Any, fault: Any, at: float) -> tuple[float, float, float]:
    """Largest errors of position and axis once settled, and of position from the lock on [m, rad, m]."""
    for name in list(planner.faults):
        planner.withdraw(name)
    planner.reset(start)
    robot = planner.robot
    result = ftqp.Simulation(
        planner, path, q=start, plant=ftqp.KinematicPlant(robot, TICK),
        schedule=ftqp.Schedule([ftqp.FaultEvent(fault, at)]), log="memory",
    ).run()  # fmt: skip
    log = result.log
    times = log["t"]
    if times[-1] < DURATION - 2.0 * TICK:
        return np.inf, np.inf, np.inf
    ticks = np.append(np.flatnonzero(times >= at)[::5], len(times) - 1)
    goals = path.sample(times[ticks]).pose
    poses = np.stack([robot.pose(row) for row in log["q"][ticks]])
    off = np.linalg.norm(goals[:, :3, 3] - poses[:, :3, 3], axis=1)
    axis = np.arccos(np.clip((goals[:, :3, 2] * poses[:, :3, 2]).sum(axis=1), -1.0, 1.0))
    late = times[ticks] >= min(at + SETTLED, times[-1])
    return float(off[late].max()), float(axis[late].max()), float(off.max())


def offsets() -> list[dict[str, Any]]:
    """What becomes of a start off the plan that is drawn to the plan, and to its corridor."""
    setup = load("panda-y-line", ["faults="])
    robot, task = setup.robot, task_of(setup)
    plan = ftqp.analysis.plan(robot, task)
    corridor = plan.corridor(stride=5, widest=1.0)
    found = []
    for offset in OFFSETS:
        start = beside(task, plan.q[0], offset)
        if start is None:
            continue
        edge = corridor.q_high if offset > 0.0 else corridor.q_low
        reach = corridor.high if offset > 0.0 else corridor.low
        nearest = start[None] if abs(offset) <= reach[0] else edge[:1]
        rows = np.stack(
            [
                np.interp(plan.t, plan.t[corridor.samples], column)
                for column in np.vstack([nearest, edge[1:]]).T
            ],
            axis=1,
        )
        row = {"offset": offset, "reach": float(reach[0]), "planned": plan.coverage}
        for name, led in (("plan", Led(plan)), ("corridor", Led(plan, rows=rows))):
            planner = ftqp.Planner(robot, dt=setup.planner.dt, level="velocity", plan=led)
            planner.reset(start)
            log = ftqp.Simulation(
                planner, setup.path, q=start, plant=ftqp.KinematicPlant(robot, planner.dt),
                schedule=ftqp.Schedule([]), log="memory",
            ).run().log  # fmt: skip
            at = np.minimum(np.searchsorted(log["t"], task.t - 0.5 * planner.dt), len(log["t"]) - 1)
            row[name] = ftqp.analysis.coverage(robot, task, log["q"][at]).coverage
        found.append(row)
    return found


def beside(task: Any, q: Any, offset: float) -> Any:
    """A posture of the same pose along the self-motion; None outside the limits."""
    robot = task.robot
    for _ in range(60):
        q = q + offset / 60.0 * ftqp.analysis.null_vector(robot.jacobian(q))
        for _ in range(3):
            now, goal = robot.pose(q), task.goals[0]
            turn = 0.5 * sum(np.cross(now[:3, i], goal[:3, i]) for i in range(3))
            q = q + np.linalg.pinv(robot.jacobian(q)) @ np.r_[goal[:3, 3] - now[:3, 3], turn]
    inside = (q >= robot.limits.q_min).all() and (q <= robot.limits.q_max).all()
    return q if inside else None


def main() -> int:
    """Run, print, write; 0 when done, 2 for bad input."""
    options = _options()
    led, drawn = locks(options.cases, options.seed), offsets()
    result = {
        **circumstances("study_followed_plans", [], {"cases": options.cases, "seed": options.seed}),
        "locks": led,
        "offsets": drawn,
        "left_out": {},
        "limitations": list(LIMITATIONS),
    }
    docs.told(result, "What leads an arm that is off its plan", _tables(led, drawn), options)
    return 0


def _tables(led: list[dict[str, Any]], drawn: list[dict[str, Any]]) -> list[Table]:
    return [
        Table(
            title="Panda, position and tool axis: locks survived, by what leads the null space after them",
            headings=(
                "path", "lock", "leader", "locks", "predicted", "run", "tip off after the lock, median [mm]",
                "worst [mm]",
            ),
            rows=[
                (
                    row["path"], row["lock"], row["leader"], str(row["cases"]), str(row["predicted"]),
                    str(row["ran"]), f"{1e3 * row['braking']:.2g}", f"{1e3 * row['worst_braking']:.2g}",
                )
                for row in led
            ],
        ),
        Table(
            title="panda-y-line, begun off its plan: coverage of the motion, by where it is drawn to",
            headings=("off by [rad]", "corridor [rad]", "plan itself", "to the plan", "to the corridor"),
            rows=[
                (
                    f"{row['offset']:+.1f}", f"{row['reach']:.2f}", f"{row['planned']:.3f}",
                    f"{row['plan']:.3f}", f"{row['corridor']:.3f}",
                )
                for row in drawn
            ],
        ),
    ]  # fmt: skip


def _options() -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    parser.add_argument(
        "--cases", type=command_line.at_least_one, default=60, metavar="N", help="locks each (default 60)"
    )
    parser.add_argument("--seed", type=int, default=12, metavar="K", help="of the locks (default 12)")
    docs.options(parser)
    options: argparse.Namespace = parser.parse_args()
    return options


if __name__ == "__main__":
    sys.exit(main())
