"""A world in which the base moves: its truth at every tick, and what an inertial task gets to see of it."""

from collections.abc import Sequence
from typing import final

import numpy as np

from ftqp.control.moving_base.inertial_task import InertialTask
from ftqp.control.planner.step import Step
from ftqp.control.planner.target import Target
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.sim.base.base_motion import BaseMotion
from ftqp.sim.base.carriers import Base
from ftqp.sim.base.disturbances import Disturbance
from ftqp.sim.plants.arm_model import Arm
from ftqp.sim.sensors.pose_sensor import PoseSensor


@final
class MovingWorld:
    """The base of a run and the sensors between it and an `InertialTask`.

    With sensing ``unknown`` the tip's pose is measured; with ``known`` the base's pose and its mean twist
    over the coming sample; with ``late`` the same, older by the delay that the task knows of. ``end_point``
    measures the tip in any case. Truth stays here: the task gets measurements only.

    Args:
        follower: the inertial task that leads the arm.
        base: what carries the arm.
        disturbances: what moves it.
        end_point: whether the tip's pose is measured; None: when the base's is not.
        position_noise: standard deviation of every measured position, each axis [m].
        rotation_noise: the same of every measured attitude [rad].
        seed: of the noise.

    Attributes:
        base_pose: true pose of B in I at the tick of the last ``sense``, (4, 4).
        tip_pose: true pose of the tip in I then, (4, 4).
        eta: true coordinates of the base then [m or rad].

    Raises:
        InputError: the tip is not measured although nothing of the base is known.
    """

    def __init__(
        self,
        follower: InertialTask,
        base: Base,
        disturbances: Sequence[Disturbance],
        *,
        end_point: bool | None = None,
        position_noise: float = 0.0,
        rotation_noise: float = 0.0,
        seed: int = 0,
    ) -> None:
        self.follower, self.base = follower, base
        sensing = follower.base.sensing
        self._sees_base = sensing != "unknown"
        self._sees_tip = not self._sees_base if end_point is None else end_point
        if not (self._sees_tip or self._sees_base):
            raise InputError("end_point is false, but with sensing 'unknown' the tip is all that is measured")
        self._disturbances = tuple(disturbances)
        self._arm = Arm(follower.planner.robot)
        self._late = round(follower.base.delay / follower.planner.dt)
        self._noise = (position_noise, rotation_noise)
        self._seed = seed
        self._motion: BaseMotion | None = None
        self.base_pose, self.tip_pose = np.eye(4), np.eye(4)
        self.eta: FloatArray = np.zeros(len(base.coordinates))
        BaseMotion(base, self._disturbances, follower.planner.dt, 2)
        self._sensors = self._fresh_sensors()

    def _fresh_sensors(self) -> tuple[PoseSensor, PoseSensor]:
        generator = np.random.default_rng(self._seed)
        position, rotation = self._noise
        tip, base = (
            PoseSensor(position=position, rotation=rotation, late=self._late, generator=generator)
            for _ in range(2)
        )
        return tip, base

    def start(self) -> FloatArray:
        """Pose of B in I at time 0, (4, 4)."""
        motion = BaseMotion(self.base, self._disturbances, self.follower.planner.dt, 1)
        first: FloatArray = motion.pose[0].copy()
        return first

    def reset(self, q: FloatArray, v: FloatArray, ticks: int) -> None:
        """Begin a run of so many ticks at (q, v), each (nv,)."""
        self._motion = BaseMotion(self.base, self._disturbances, self.follower.planner.dt, ticks)
        self._sensors = self._fresh_sensors()
        self.follower.reset(q, v)

    def sense(self, k: int, q: FloatArray) -> None:
        """Take the measurements of tick k.

        Args:
            k: the tick.
            q: true joint positions, (nv,).
        """
        motion = self._motion
        if motion is None:
            raise InputError("the world has no run; call reset before the first tick")
        self.base_pose, self.eta = motion.pose[k], motion.eta[k]
        self.tip_pose = self.base_pose @ self._arm.tip(q)
        tip, base = self._sensors
        self._tip = tip.measure(self.tip_pose) if self._sees_tip else None
        self._base = base.measure(self.base_pose) if self._sees_base else None
        self._twist = motion.twist[max(0, k - self._late)] if self._sees_base else None

    def step(self, q: FloatArray, v: FloatArray, target: Target) -> Step:
        """The follower's command from the measurements of the last ``sense``.

        Args:
            q: measured joint positions, (nv,).
            v: measured joint velocities, (nv,).
            target: in I.
        """
        return self.follower.step(q, v, target, tip=self._tip, base=self._base, base_twist=self._twist)
