"""What never changes in a planner's life, written into its record once."""

from typing import Any

import numpy as np

from ftqp.control.task.bounds import Bounds, Jin
from ftqp.control.task.emergency import EmergencyStop
from ftqp.control.task.scheme import Criterion
from ftqp.control.task.task import MODES, PRIORITIES, Task, axis_frame, checked_gains, row_indices
from ftqp.kernel.layout import enums as codes
from ftqp.kernel.layout.record import load_chain, record
from ftqp.model.robot import Robot

LEVELS = {"velocity": codes.VELOCITY, "acceleration": codes.ACCELERATION}
PATIENCE = 0.1
"""Time [s] of fallback commands in a row after which the arm is stopped."""
TOLERANCE = 1e-10
"""Largest violation of a bound that the active set counts as none."""
ACCEPT = 1e-6
"""Largest scaled residual of a QP that counts as solved."""


def filled(
    robot: Robot,
    task: Task,
    criterion: Criterion,
    bounds: Bounds,
    emergency: EmergencyStop | None,
    *,
    level: str,
    dt: float,
) -> Any:
    """The record, (1,), of a healthy robot; what is believed of its joints is another's to write.

    Raises:
        InputError: unknown rows, or gains too high for dt.
    """
    W = record()
    load_chain(W, **robot.chain.constants())
    rows = row_indices(robot.default_rows if task.rows is None else task.rows)
    kp, kv = checked_gains(task, level, dt)
    length = robot.length if task.length is None else task.length
    W["dt"], W["level"], W["mode"] = dt, LEVELS[level], MODES[task.mode]
    W["kp"], W["kv"], W["slack_ratio"], W["length"] = kp, kv, task.slack, length
    W["m"] = len(rows)
    W["rows"][:, : len(rows)] = rows
    W["row_scale"] = [1.0, 1.0, 1.0, length, length, length]
    W["yielding"] = PRIORITIES[task.priority]
    W["uses_rotation"] = rows[-1] >= 3
    W["tool_rows"] = task.rows == "position_axis"
    W["axis"] = axis_frame(task.axis).ravel()
    c = criterion
    W["w_norm"], W["norm_v"], W["norm_q"] = c.norm, c.norm_v, c.norm_q
    W["w_inertia"], W["inertia_v"], W["inertia_h"] = c.inertia, c.inertia_v, c.inertia_h
    W["w_torque"], W["manipulability"] = c.torque, c.manipulability
    W["weight"] = 1.0
    if task.damping is not None:
        W["damping_threshold"], W["damping_factor"] = task.damping.threshold, task.damping.factor
    W["bounds"] = bounds.code
    if isinstance(bounds, Jin):
        W["jin_p"], W["jin_v"] = bounds.gamma_p, bounds.gamma_v
        W["jin_margin"], W["jin_upsilon"] = bounds.margin, bounds.upsilon
    W["stop_position"] = W["stop_rotation"] = np.inf
    if emergency is not None:
        W["stop_position"], W["stop_rotation"] = emergency.position, emergency.rotation
        W["stop_samples"] = emergency.samples
    W["fallback_limit"] = max(1, round(PATIENCE / dt))
    W["tolerance"], W["max_iterations"], W["accept"] = TOLERANCE, 50 * (robot.nv + 10), ACCEPT
    W["p"] = robot.nv if robot.has_inertia else 0
    return W
