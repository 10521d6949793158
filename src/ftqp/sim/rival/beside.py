"""A rival leads the arm of a run along its path, with the same servos, sensors, noise and failures.

Both are judged by where the tip truly was.
"""

from dataclasses import dataclass
from typing import Protocol, final

import numpy as np

from ftqp.control.paths import Path
from ftqp.core.checks import FloatArray
from ftqp.model.robot import Robot
from ftqp.model.skeleton import Skeleton
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.plants.plant import Command, Plant
from ftqp.sim.schedule import Schedule
from ftqp.sim.sensors.joint_sensors import JointSensors


class Rival(Protocol):
    """Who leads an arm without ftqp: begins at q, is told of a lock, and gives a command a tick."""

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

    def most_speed(self, robot: Robot) -> float:
        """The largest share of its speed limit that a joint truly used, without unit."""
        return float(np.max(np.abs(self.v) / robot.limits.v_max))


def strayed(log: Log) -> FloatArray:
    """How far the tip of a run truly was from its target, (K,) [m].

    The run's own ``position_error`` is what its planner saw, with the noise of its sensors.
    """
    return np.asarray(np.linalg.norm(log["tip"][:, :3] - log["target"][:, :3], axis=1))


def turned(robot: Robot, q: FloatArray, poses: FloatArray) -> FloatArray:
    """How far the tip of an arm was turned away from where it should have been, (K,) [rad]."""
    tips = Skeleton.of(robot.chain).frames(q)[:, -1, :3, :3]
    cosine = 0.5 * (np.einsum("kij,kij->k", tips, poses[:, :3, :3]) - 1.0)
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))


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
    told: bool = False,
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
    for k in range(count):
        for event in failing.get(k, ()):
            plant.fail(event.fault)
            if told:
                rival.tell(event.fault.joint)
        measured = plant.q
        if sensors is not None:
            sensors.measure(plant.q, plant.v)
            measured = sensors.q
        qs[k], vs[k] = plant.q, plant.v
        plant.advance(rival.step(measured, sample.pose[k], sample.twist[k]))
    tips = Skeleton.of(robot.chain).frames(qs)[:, -1, :3, 3]
    return Ride(t=t, q=qs, v=vs, tip=tips, target=sample.pose[:, :3, 3].copy())
