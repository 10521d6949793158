"""A planner as a table, for the cells of notebooks."""

from typing import Any

from ftqp.core.html_table import html_table
from ftqp.model.robot_table import arm_svg


def planner_html(planner: Any) -> str:
    """What a planner was made with, its tasks and constraints, and what it believes now.

    Args:
        planner: The ``ftqp.Planner``.
    """
    robot, task = planner.robot, planner.task
    rows = [
        ("robot", f"{robot.name}, {robot.nv} joints"),
        ("tick", f"{1e3 * planner.dt:g} ms, {planner.level} level"),
        ("scheme, solver", f"{planner.scheme.name}, {planner.backend}"),
        (f"task of {robot.tip}", f"{', '.join(planner.task_rows)}; {task.mode}"),
    ]
    rows += [
        (f"task {name}", f"{type(one.given).__name__}, level {one.given.level}, weight {one.weight:g}")
        for name, one in planner.tasks.items()
    ]
    rows += [(f"constraint {name}", type(one.given).__name__) for name, one in planner.constraints.items()]
    believed = [f"{joint} {fault.happens}" for joint, fault in planner.faults.items()]
    note = f"It believes that {', '.join(believed)}." if believed else "It believes that every joint works."
    stopped = planner.stopped_because
    return html_table(
        f"Planner of {robot.name}",
        (),
        rows,
        f"{note} Stopped: {stopped}." if stopped else note,
        arm_svg(robot, robot.neutral),
    )
