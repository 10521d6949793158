"""The task of a scenario on an even time grid, and the motion of its arm while nothing fails."""

import numpy as np

from ftqp.analysis.survival.task_path import TaskPath, task_path
from ftqp.app.output.console import progress
from ftqp.app.scenario.setup import Setup
from ftqp.control.planner.running_task import rows_of
from ftqp.control.task.soft_tasks import PoseTask, PositionTask, RelativeTask
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError, ScenarioError
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.model.frames import way_to
from ftqp.sim.loop import MEMORY, Simulation
from ftqp.sim.plants.kinematic_plant import KinematicPlant
from ftqp.sim.schedule import Schedule

SAMPLES = 400
"""A path is looked at so often, about."""
ALONG_TOOL = (0.0, 0.0, 1.0)
"""The only tool axis that coverage knows."""


def task_of(setup: Setup) -> TaskPath:
    """The scenario's path and rows, sampled at ticks of its planner, some 400 times."""
    planner, task, robot = setup.planner, setup.planner.task, setup.robot
    refuse_what_moves(setup)
    rows: str | list[str] = list(planner.task_rows)
    if task.rows == "position_axis":
        if task.axis != ALONG_TOOL:
            raise ScenarioError(
                f"{setup.name} has the tool axis {list(task.axis)}, expected [0, 0, 1]: turn the end "
                "effector by [robot.tool]"
            )
        rows = "position_axis"
    return task_path(
        robot if robot.is_serial else robot.arm_to(robot.tip), setup.path, rows=rows,
        dt=planner.dt * _ticks_per_sample(setup),
        scene=planner.scene, clearance=planner.clearance,
    )  # fmt: skip


def refuse_what_moves(setup: Setup) -> None:
    """Refuse a path that is repeated, and a base that moves."""
    if setup.tables.path.laps is not None:
        raise ScenarioError(
            f"{setup.name} repeats its path, and it is looked at once: take path.laps out, for example by "
            "--set path.laps="
        )
    if setup.world is not None:
        raise ScenarioError(
            f"{setup.name} has a base that moves; which failures a path survives is known for a base that "
            "stands, so take [base] out"
        )


def motion_of_task(setup: Setup, name: str) -> tuple[TaskPath, FloatArray]:
    """The way of a task's frame in a run in which nothing fails, and the joints on the way to it."""
    planner, robot = setup.planner, setup.robot
    if planner.scene is not None:
        raise ScenarioError(
            f"{setup.name} has a scene, which coverage by task does not look at; leave it out by "
            "--set scene=[] --set clearance="
        )
    frame, rows = robot.tip, list(planner.task_rows)
    if name != robot.tip:
        given = planner.tasks[name].given
        if not isinstance(given, PoseTask | PositionTask | RelativeTask):
            raise InputError(
                f"task {name!r} is a {type(given).__name__}, which leads no frame along a path; expected a "
                "PoseTask, PositionTask or RelativeTask, or leave --task out"
            )
        frame = given.frame
        rows = [row for k, row in enumerate(COMPONENTS) if rows_of(given) & (1 << k)]
    refuse_what_moves(setup)
    dt = planner.dt * _ticks_per_sample(setup)
    q = _healthy_run(setup, np.array([dt * k for k in range(round(setup.path.duration / dt) + 1)]))
    arm = robot.arm_to(frame)
    goals = np.array([robot.pose(row, frame) for row in q])
    on_way = np.ascontiguousarray(q[:, way_to(robot, frame)])
    return task_path(arm, goals, rows=rows, dt=dt), on_way


def healthy_motion(setup: Setup) -> tuple[TaskPath, FloatArray]:
    """The task, and the joints on it in a run in which nothing fails, (N + 1, nv) [rad or m]."""
    task = task_of(setup)
    return task, _healthy_run(setup, task.t)


def _healthy_run(setup: Setup, times: FloatArray) -> FloatArray:
    """The joints at times of the path in a run in which nothing fails, (K, nv) [rad or m]."""
    planner = setup.planner
    with progress(f"{setup.name}, healthy", 1.0) as notify:
        ended = Simulation(
            planner, setup.path, q=setup.q, v=setup.v, schedule=Schedule([]),
            plant=KinematicPlant(setup.robot, planner.dt), follower=setup.follower,
            feed_forward=setup.tables.simulation.feed_forward, log=MEMORY,
            progress=lambda done, total: notify(done / total),
        ).run()  # fmt: skip
    if ended.interrupted:
        raise KeyboardInterrupt
    log = ended.log
    if log is None or not ended.completed:
        raise ScenarioError(
            f"{setup.name} does not get to the end of its path even while nothing fails"
            + (f": it stopped at {ended.stopped_at:.3g} s" if ended.stopped_at is not None else "")
            + "; run it with --set faults= to see why"
        )
    reached = log["progress"] if "progress" in log else planner.dt * np.arange(len(log))
    ticks = np.minimum(np.searchsorted(reached, times - 0.5 * planner.dt), len(reached) - 1)
    q: FloatArray = np.ascontiguousarray(log["q"][ticks])
    return q


def _ticks_per_sample(setup: Setup) -> int:
    """Ticks of the planner from sample to sample."""
    ticks = setup.path.duration / setup.planner.dt
    if ticks < 1.0:
        raise InputError(f"the path lasts {setup.path.duration:g} s, less than one tick")
    return max(1, round(ticks / SAMPLES))
