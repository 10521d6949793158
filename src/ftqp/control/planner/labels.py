"""Names of the variables and rows of a planner's QP, as an external solver gets it."""

from ftqp.control.planner.constraint_list import asked_of
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.surroundings import clearance_rows
from ftqp.control.planner.task_list import held_rows
from ftqp.control.task.task import row_indices
from ftqp.kernel.layout.rows import CLEARANCE, COMPONENTS, HOLD, constraint_labels

SCALE = "scale"
SLACK = "slack "


def variable_labels(planner: Planner) -> tuple[str, ...]:
    """The joints, ``scale`` in mode scaled, and ``slack x``, ... in every mode but hard, (n,)."""
    mode = planner.task.mode
    scale = (SCALE,) if mode == "scaled" else ()
    slacks = () if mode == "hard" else tuple(SLACK + row for row in _task_rows(planner))
    return (*planner.robot.joints, *scale, *slacks)


def row_labels(planner: Planner) -> tuple[str, ...]:
    """The task rows ``x``, ``rz``, ... of A, then the rows of C, such as ``torque <joint>``."""
    robot = planner.robot
    held = held_rows([task.given for task in planner.tasks.values()])
    asked = {
        **asked_of([one.given for one in planner.constraints.values()]),
        HOLD.name: held,
        CLEARANCE.name: clearance_rows(planner.clearance is not None),
    }
    return (
        *_task_rows(planner),
        *constraint_labels(robot.joints, robot.has_inertia, asked),
    )


def _task_rows(planner: Planner) -> tuple[str, ...]:
    rows = planner.robot.default_rows if planner.task.rows is None else planner.task.rows
    return tuple(COMPONENTS[index] for index in row_indices(rows))
