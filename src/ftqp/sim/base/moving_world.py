"""A world in which the base moves: its truth at every tick, and what an inertial task gets to see of it."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from typing import ClassVar, final

import numpy as np

from ftqp.control.moving_base.inertial_task import InertialTask
from ftqp.control.planner.step import Step
from ftqp.control.planner.target import Target
from ftqp.core.checks import FloatArray, non_negative, positive
from ftqp.core.errors import InputError, unknown
from ftqp.core.pose import rotation_exp, rotation_vectors
from ftqp.core.setting import Setting, Settings
from ftqp.sim.base.disturbances import Disturbance
from ftqp.sim.plants.plant import Arm


class Base(ABC):
    """The role of a base: coordinates eta, and the pose of the arm's base frame B in the inertial frame I."""

    @property
    @abstractmethod
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates."""

    @abstractmethod
    def pose(self, eta: FloatArray) -> FloatArray:
        """Poses of B in I, (K, 4, 4) [m], at coordinates eta, (K, count) [m or rad]."""


@final
class Platform(Base):
    """Three joints: ``track`` along x0, ``rotation`` about z0 on the carriage, ``tilt`` about its y axis.

    Source: Holt and Desrochers 1994 for the joints; they give no dimensions, so the lengths are choices.
    """

    settings: ClassVar[Settings] = {
        "height": Setting("of the tilt axis, >= 0", unit="m", least=0.0),
        "mount": Setting("of the arm in the tilted frame", unit="m"),
    }

    def __init__(self, height: float = 0.30, mount: tuple[float, float, float] = (0.20, 0.0, 0.45)) -> None:
        self._height = non_negative("height", height, "m")
        self._mount = np.array(mount, dtype=np.float64)

    @property
    def coordinates(self) -> tuple[str, ...]:
        return ("track", "rotation", "tilt")

    def pose(self, eta: FloatArray) -> FloatArray:
        """Tx(track) Rz(rotation) Tz(height) Ry(tilt) T(mount) at eta, (K, 3) [m, rad, rad]."""
        from scipy.spatial.transform import Rotation  # slow to load, needed where the base moves

        turn = Rotation.from_euler("ZY", eta[:, 1:3])
        poses = np.tile(np.eye(4), (len(eta), 1, 1))
        poses[:, :3, :3] = turn.as_matrix()
        poses[:, :3, 3] = turn.apply(self._mount)
        poses[:, 0, 3] += eta[:, 0]
        poses[:, 2, 3] += self._height
        return poses


@final
class FreeBase(Base):
    """Six degrees of freedom: position ``x, y, z`` and rotation vector ``rx, ry, rz`` of B in I."""

    @property
    def coordinates(self) -> tuple[str, ...]:
        return ("x", "y", "z", "rx", "ry", "rz")

    def pose(self, eta: FloatArray) -> FloatArray:
        from scipy.spatial.transform import Rotation  # slow to load, needed where the base moves

        poses = np.tile(np.eye(4), (len(eta), 1, 1))
        poses[:, :3, :3] = Rotation.from_rotvec(eta[:, 3:]).as_matrix()
        poses[:, :3, 3] = eta[:, :3]
        return poses


@final
class PoseSensor:
    """Measures a pose in I with white noise, some samples late."""

    def __init__(
        self,
        *,
        position: float = 0.0,
        rotation: float = 0.0,
        late: int = 0,
        generator: np.random.Generator | None = None,
    ) -> None:
        self._position = non_negative("position noise", position, "m")
        self._rotation = non_negative("rotation noise", rotation, "rad")
        self._generator = np.random.default_rng(0) if generator is None else generator
        self._waiting: list[FloatArray] = []
        self._late = int(non_negative("delay of the sensor", late))

    def reset(self) -> None:
        """Forget what has been seen."""
        self._waiting.clear()

    def measure(self, truth: FloatArray) -> FloatArray:
        """The pose that is measured now, (4, 4); the first one until something has come through the delay."""
        seen = truth.copy()
        if self._position > 0.0:
            seen[:3, 3] += self._position * self._generator.standard_normal(3)
        if self._rotation > 0.0:
            noise = rotation_exp(self._rotation * self._generator.standard_normal(3))
            seen[:3, :3] = noise @ seen[:3, :3]
        self._waiting.append(seen)
        if len(self._waiting) > self._late + 1:
            self._waiting.pop(0)
        return self._waiting[0]


@final
class BaseMotion:
    """How a base really moves in a run: its pose at every tick, its mean twist in every sample.

    Attributes:
        eta: coordinates at the ticks, (ticks, count) [m or rad].
        pose: of B in I at the ticks, (ticks, 4, 4).
        twist: mean twist at B's origin along I over each tick's sample, (ticks, 6) [m/s, rad/s].
    """

    def __init__(self, base: Base, disturbances: Iterable[Disturbance], dt: float, ticks: int) -> None:
        step = positive("dt", dt, "s")
        names = base.coordinates
        t: FloatArray = np.arange(ticks + 1, dtype=np.float64) * step
        eta = np.zeros((ticks + 1, len(names)))
        for disturbance in disturbances:
            for name, value in disturbance.sample(t).items():
                if name not in names:
                    raise unknown("coordinate", name, "the base", names)
                eta[:, names.index(name)] += value
        poses = base.pose(eta)
        self.eta, self.pose = eta[:-1], poses[:-1]
        self.twist: FloatArray = np.zeros((ticks, 6))
        self.twist[:, :3] = np.diff(poses[:, :3, 3], axis=0) / step
        turns = poses[1:, :3, :3] @ np.swapaxes(poses[:-1, :3, :3], 1, 2)
        self.twist[:, 3:] = rotation_vectors(turns) / step


@final
class MovingWorld:
    """The base of a run and the sensors between it and an `InertialTask`.

    With sensing ``unknown`` the tip's pose is measured; with ``known`` the base's pose and its mean twist
    over the coming sample; with ``late`` the same, older by the delay that the task knows of. ``end_point``
    measures the tip in any case. Truth stays here: the task gets measurements only.

    Attributes:
        base_pose: true pose of B in I at the tick of the last ``sense``, (4, 4).
        tip_pose: true pose of the tip in I then, (4, 4).
        eta: true coordinates of the base then [m or rad].
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
            raise InputError(
                "end_point is false, but with sensing 'unknown' the end effector is all that is measured"
            )
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
        """Take the measurements of tick k."""
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
        """The follower's command from the measurements of the last ``sense``."""
        return self.follower.step(q, v, target, tip=self._tip, base=self._base, base_twist=self._twist)
