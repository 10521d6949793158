"""What a good engineer writes without ftqp, to be compared with."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, final

import numpy as np

from ftqp.control.paths import Path
from ftqp.core.checks import BoolArray, FloatArray, array, positive, seen
from ftqp.core.pose import rotation_vector
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.model.chain import Skeleton, frame_id
from ftqp.model.posture import scaled_jacobian
from ftqp.model.robot import Robot
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.plants.plant import Command, Plant
from ftqp.sim.schedule import Schedule
from ftqp.sim.sensors.joint_sensors import JointSensors

GAIN = 60.0
"""Feedback of the tip's error [1/s]: by `python studies/well_wired.py --gains` smaller ones stray and end
farther off when nobody tells of the lock, and larger ones gain little and leave no room for late samples."""
NEAR_SINGULAR = 0.02
"""Singular values below this are damped [m]: a quarter of 0.076 m, the demo's circle with six joints."""


@final
class ResolvedRates:
    """Damped resolved rates around measured joints, with all that such a loop is usually given.

    With the tip's pose by the measured q, e its error, and xdot the target's twist:

    * v = J+ (xdot + K e), the rotation's rows times the characteristic length; below ``NEAR_SINGULAR`` the
      smallest singular value s is damped by lambda^2 = NEAR_SINGULAR^2 - s^2 (Nakamura and Hanafusa's rule)
    * all speeds are scaled down together to the limits v_max, then all changes to a_max dt, then the integral
      q + dt v is kept within the range
    * a joint that is reported gets no column of J, and the speed 0

    It sends its integral and v, as ftqp does, so that position servos are led by the speed. It reads the
    model by pinocchio, and shares no formula with ftqp's planner.

    Source: Whitney 1969; Nakamura and Hanafusa 1986.
    """

    __slots__ = (
        "_at", "_data", "_dt", "_failed", "_gain", "_q", "_robot", "_rows", "_tip", "_v", "brakes",
        "tau",
    )  # fmt: skip

    brakes: BoolArray
    tau: FloatArray

    def __init__(
        self, robot: Robot, dt: float, *, rows: Sequence[str] = COMPONENTS, gain: float = GAIN
    ) -> None:
        robot.refuse_tree("resolved rates need")
        self._robot, self._dt, self._rows = robot, positive("dt", dt, "s"), tuple(rows)
        self._at = [COMPONENTS.index(row) for row in self._rows]
        self._data, self._tip = robot.model.createData(), frame_id(robot.model, robot.tip)
        self._gain = positive("gain", gain, "1/s")
        self._failed = np.zeros(robot.nv, dtype=np.bool_)
        self._q, self._v = robot.neutral.copy(), np.zeros(robot.nv)
        self.brakes, self.tau = np.zeros(robot.nv, dtype=np.bool_), np.zeros(robot.nv)

    @property
    def q(self) -> FloatArray:
        """Commanded positions, (nv,) [rad or m]; they belong to the controller."""
        return seen(self._q)

    @property
    def v(self) -> FloatArray:
        """Commanded velocities, (nv,) [rad/s or m/s]; they belong to the controller."""
        return seen(self._v)

    def reset(self, q: FloatArray, v: FloatArray | None = None) -> None:
        """Begin at (q, v), each (nv,) [rad or m, and per s], all joints believed healthy; None is at rest."""
        self._q[:] = self._robot.angles(q)
        self._v[:] = 0.0 if v is None else v
        self._failed[:] = False

    def tell(self, joint: str | int) -> None:
        """From now on that joint is known to be locked."""
        self._failed[self._robot.joint(joint)] = True

    def repair(self, joint: str | int, position: float) -> None:
        """From now on that joint works again."""
        i = self._robot.joint(joint)
        self._failed[i], self._q[i], self._v[i] = False, position, 0.0

    def step(self, q: FloatArray, pose: FloatArray, twist: FloatArray) -> "ResolvedRates":
        """One tick; the command is what the controller then holds."""
        robot, limits, dt = self._robot, self._robot.limits, self._dt
        q = array("q", q, (robot.nv,), "(nv,)")
        J = scaled_jacobian(
            robot.model, self._data, self._tip, robot.configuration(q), self._rows, robot.length
        )
        T = self._data.oMf[self._tip].homogeneous
        e = np.concatenate([pose[:3, 3] - T[:3, 3], rotation_vector(pose[:3, :3] @ T[:3, :3].T)])
        rate = twist + self._gain * e
        rate[3:] *= robot.length
        rate = rate[self._at]
        J[:, self._failed] = 0.0
        v = self._inverse(J, rate)
        v /= max(1.0, float(np.max(np.abs(v) / limits.v_max)))
        change = v - self._v
        change /= max(1.0, float(np.max(np.abs(change) / (limits.a_max * dt))))
        v = np.where(self._failed, 0.0, self._v + change)
        to = np.clip(self._q + dt * v, limits.q_min, limits.q_max)
        self._v[:] = (to - self._q) / dt
        self._q[:] = np.where(self._failed, q, to)
        return self

    def _inverse(self, J: FloatArray, rate: FloatArray) -> FloatArray:
        """v, (nv,), nearest to the rate, damped near singularities."""
        U, s, Vt = np.linalg.svd(J, full_matrices=False)
        damping = max(0.0, NEAR_SINGULAR**2 - float(s[-1]) ** 2)
        result: FloatArray = Vt.T @ (s / (s**2 + damping) * (U.T @ rate))
        return result


class Rival(Protocol):
    """Who leads an arm without ftqp: begins at q, gets the report of a lock, and gives a command a tick."""

    def reset(self, q: FloatArray) -> None: ...
    def tell(self, joint: str | int) -> None: ...
    def step(self, q: FloatArray, pose: FloatArray, twist: FloatArray) -> Command: ...


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ride:
    """What an arm did, each row a tick."""

    t: FloatArray  # Time, (K,) [s]
    q: FloatArray  # Where its joints truly were, (K, nv) [rad or m]
    v: FloatArray  # Their true velocities, (K, nv) [rad/s or m/s]
    tip: FloatArray  # Where its tip truly was, (K, 3) [m]
    target: FloatArray  # Where it should have been, (K, 3) [m]

    @property
    def error(self) -> FloatArray:
        """The tip's distance from its target, (K,) [m]."""
        return np.asarray(np.linalg.norm(self.tip - self.target, axis=1))


def strayed(log: Log) -> FloatArray:
    """How far the tip of a run truly was from its target, (K,) [m]."""
    return np.asarray(np.linalg.norm(log["tip"][:, :3] - log["target"][:, :3], axis=1))


def ride(
    rival: Rival,
    robot: Robot,
    path: Path,
    q: FloatArray,
    *,
    dt: float,
    plant: Plant,
    sensors: JointSensors | None = None,
    schedule: Schedule | None = None,
    reported: bool = False,
    duration: float | None = None,
) -> Ride:
    """Let a rival lead an arm from q along the path; the plant and the sensors begin anew."""
    count = round((path.duration if duration is None else duration) / dt) + 1
    t: FloatArray = np.asarray(dt * np.arange(count), dtype=np.float64)
    sample = path.sample(t)
    failing = {} if schedule is None else schedule.failing(dt)
    plant.reset(q, np.zeros(robot.nv))
    rival.reset(q)
    if sensors is not None:
        sensors.reset()
    qs, vs = np.empty((2, count, robot.nv))
    last = q
    for k in range(count):
        for event in failing.get(k, ()):
            plant.fail(event.fault)
            if reported:
                rival.tell(event.fault.joint)
        measured = plant.q
        if sensors is not None:
            sensors.measure(plant.q, plant.v)
            measured = np.where(np.isfinite(sensors.q), sensors.q, last)
            last = measured
        qs[k], vs[k] = plant.q, plant.v
        plant.advance(rival.step(measured, sample.pose[k], sample.twist[k]))
    tips = Skeleton.of(robot.chain).frames(qs)[:, -1, :3, 3]
    return Ride(t=t, q=qs, v=vs, tip=tips, target=sample.pose[:, :3, 3].copy())
