"""What one posture is worth: distance from singularities and torques against gravity, for set-up."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.model.chain import frame_id
from ftqp.model.robot import Robot


def jacobian(robot: Robot, q: Any, rows: Sequence[str], tool_axes: FloatArray | None = None) -> FloatArray:
    """The task's Jacobian, its angular rows times the characteristic length, (m, nv) [m].

    Args:
        robot: The arm.
        q: The configuration, (nv,) or (nq,) [rad or m].
        rows: Rows of the task, of x, y, z, rx, ry, rz.
        tool_axes: Rotation from the tip frame to axes that the angular rows go along, (3, 3); None is W.
    """
    data = robot.model.createData()
    frame = frame_id(robot.model, robot.tip)
    J = pin.computeFrameJacobian(
        robot.model, data, robot.configuration(q), frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    )
    if tool_axes is not None:
        J[3:] = (data.oMf[frame].rotation @ tool_axes).T @ J[3:]
    J[3:] *= robot.length
    return np.array(J[[COMPONENTS.index(row) for row in rows]])


def gravity_torques(robot: Robot, q: Any) -> FloatArray:
    """The torques that hold the arm at rest at q, (nv,) [N m or N]; zeros without masses.

    Args:
        robot: The arm.
        q: The configuration, (nv,) or (nq,) [rad or m].
    """
    model = robot.model
    return np.array(pin.computeGeneralizedGravity(model, model.createData(), robot.configuration(q)))
