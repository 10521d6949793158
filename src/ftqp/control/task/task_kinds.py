"""The kinds of tasks and constraints that a file can have, by the word for them."""

from collections.abc import Mapping
from typing import Any

from ftqp.control.task.keep import Keep
from ftqp.control.task.soft_tasks import (
    AxisTask,
    CentreOfMass,
    JointTask,
    PoseTask,
    PositionTask,
    PostureTask,
    RelativeTask,
    SoftTask,
)

KINDS: Mapping[str, type[SoftTask]] = {
    "pose": PoseTask,
    "relative": RelativeTask,
    "position": PositionTask,
    "axis": AxisTask,
    "centre_of_mass": CentreOfMass,
    "posture": PostureTask,
    "joints": JointTask,
}
"""Of tasks, ``[[tasks]]``; a function of one's own can only be given in Python."""

KEPT = "keep"
"""The kind of a constraint that does not say its kind."""

CONSTRAINT_KINDS: Mapping[str, type[Any]] = {KEPT: Keep}
"""Of constraints, ``[[constraints]]``."""
