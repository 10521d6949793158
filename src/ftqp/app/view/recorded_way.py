"""The arm and the way of a recorded run, for its pictures."""

import tomllib

from ftqp.app.run.recorded_robot import recorded_robot
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.model.robot import Robot
from ftqp.sim.log.log_arrays import Log


def robot_of(log: Log) -> Robot:
    """The arm of a run.

    Raises:
        InputError: The arm cannot be made any more, or is another one than the log's.
    """
    robot, why = recorded_robot(log.rows)
    if robot is None:
        raise InputError(f"{why}; a run can be viewed while its arm can be made")
    return robot


def urdf_of(log: Log) -> str | None:
    """The URDF of a run's arm, for pictures; None of an arm without one."""
    resolved = log.metadata.get("resolved")
    urdf = tomllib.loads(resolved)["robot"].get("urdf") if isinstance(resolved, str) else None
    return urdf if isinstance(urdf, str) else None


def way_of(log: Log, count: int = 120) -> FloatArray | None:
    """Points of the path that was followed, (count + 1, 3) [m]; None on a base that moves, or without any."""
    if "base_status" in log or not len(log):
        return None
    at = [round(k * (len(log) - 1) / count) for k in range(count + 1)]
    points: FloatArray = log["target"][at, :3]
    return points
