"""From a planner's step to a row of the log."""

from typing import final

import numpy as np
from scipy.spatial.transform import Rotation

from ftqp.control.following.path_follower import PathFollower, PathStatus
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.step import Step
from ftqp.core.checks import FloatArray
from ftqp.faults.kinds import Degraded, Fault, FreeSwinging, Locked
from ftqp.qp.problem import SolveStatus
from ftqp.sim.base.moving_world import MovingWorld
from ftqp.sim.log.log_file import LogWriter
from ftqp.sim.plants.arm_model import Arm

CODES = {Locked: 1, FreeSwinging: 2, Degraded: 3}
"""Code of each kind of fault in the columns ``belief`` and ``truth``; 0 is healthy."""
QP_CODES = {status: code for code, status in enumerate(SolveStatus)}
"""Code of each outcome of a QP in the column ``qp_status``."""

PATH_CODES = {status: code + 1 for code, status in enumerate(PathStatus)}
"""Code of each status of a path in the column ``path_status``; 0 without a follower."""
AT_REST = 1e-9
"""Speed of the target below which a path has no direction [m/s]."""


def across(error: FloatArray, velocity: FloatArray) -> float:
    """Length of the part of an error, (3,), that is perpendicular to a velocity, (3,); all of it at rest."""
    speed = float(np.linalg.norm(velocity))
    if speed > AT_REST:
        error = error - (error @ velocity) / speed**2 * velocity
    return float(np.linalg.norm(error))


@final
class RowWriter:
    """Fills one row a tick, in the order of `ftqp.sim.log.signals.columns`.

    Args:
        log: where the rows go.
        planner: whose steps they hold.
        follower: what leads the planner along the path, if anything.
        world: the base, where it moves; the row then ends with `ftqp.sim.log.signals.base_columns`.
    """

    def __init__(
        self,
        log: LogWriter,
        planner: Planner,
        *,
        follower: PathFollower | None = None,
        world: MovingWorld | None = None,
    ) -> None:
        self._follower = follower
        self._log = log
        self._planner, self._world = planner, world
        self._arm = Arm(planner.robot)
        self._truth = np.zeros(planner.robot.nv)
        self._belief = np.zeros(planner.robot.nv)

    def fail(self, fault: Fault) -> None:
        """From this row on the joint has really failed."""
        self._truth[self._planner.robot.joint(fault.joint)] = CODES[type(fault)]

    def write(
        self,
        t: float,
        q: FloatArray,
        v: FloatArray,
        target: FloatArray,
        step: Step,
        elapsed: int,
        *,
        twist: FloatArray,
        progress: float,
    ) -> None:
        """Write the row of one tick.

        Args:
            t: time [s].
            q: measured positions, (nv,) [rad or m].
            v: measured velocities, (nv,) [rad/s or m/s].
            target: desired pose, (4, 4) [m].
            step: the planner's step.
            elapsed: wall time of the step [ns].
            twist: of the path at the target, (6,) [m/s, rad/s].
            progress: path time reached [s].
        """
        n, qp = len(q), step.qp
        row = self._log.row
        row[0] = t
        joints = row[1 : 1 + 9 * n].reshape(9, n)
        joints[0], joints[1] = q, v
        joints[2], joints[3], joints[4] = step.a, step.tau, step.tau_brake
        joints[5], joints[6] = step.lower, step.upper
        joints[7] = self._believed()
        joints[8] = self._truth
        rest = row[1 + 9 * n :]
        world = self._world
        tip = self._arm.tip(q) if world is None else world.tip_pose
        turns = Rotation.from_matrix([target[:3, :3], tip[:3, :3]]).as_quat(canonical=True)
        rest[0:3], rest[3:7] = target[:3, 3], turns[0]
        rest[7:10], rest[10:14] = tip[:3, 3], turns[1]
        follower = self._follower
        rest[14:30] = (
            step.position_error,
            step.rotation_error,
            np.linalg.norm(step.slack),
            step.scale,
            step.code,
            -1 if qp.status is None else QP_CODES[qp.status],
            qp.iterations,
            qp.residual,
            1e-3 * elapsed,
            *step.measures,
            step.kappa,
            across(target[:3, 3] - tip[:3, 3], twist[:3]),
            progress,
            0 if follower is None else PATH_CODES[follower.status],
        )
        if world is not None:
            count = len(world.eta)
            last = row[len(row) - count - 14 :]
            last[0:3] = world.base_pose[:3, 3]
            last[3:7] = Rotation.from_matrix(world.base_pose[:3, :3]).as_quat(canonical=True)
            last[7 : 7 + count] = world.eta
            last[7 + count : 13 + count] = world.error
            last[13 + count] = world.follower.code
        self._log.append()

    def _believed(self) -> FloatArray:
        """What the planner believes of each joint now."""
        self._belief[:] = 0.0
        for joint, fault in self._planner.faults.items():
            self._belief[self._planner.robot.joint(joint)] = CODES[type(fault)]
        return self._belief
