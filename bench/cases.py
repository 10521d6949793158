"""The robots and the recorded targets: every program gets the same ones."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bench.urdf import TIP, Arm, Array, text
from bench.worker import Case

DT = 1e-3
"""Step [s]."""

PERIOD = 4000
"""Targets in one period: the path is closed, smooth, and starts at rest."""

SPEED = 0.05
"""Greatest speed of the tip along the path [m/s]: without feed-forward a loop lags by millimetres."""

KP, KV, GAIN = 2500.0, 100.0, 100.0
"""Critically damped task gains at torque level [1/s2, 1/s], and the gain at velocity level [1/s]."""

LOCKED = {"panda": 2, "chain30": 14}
"""The joint that does not move in the locked cases; the path needs it in none."""

LEVELS = ("velocity", "torque")


@dataclass(frozen=True, slots=True, kw_only=True)
class Path:
    """A robot and its targets.

    Attributes:
        name: The robot's name.
        arm: What the URDF says, and the acceleration limits it cannot say.
        urdf: The robot as text.
        poses: (N, 4, 4).
        twists: (N, 6), linear then angular along W.
        pose: Tip of the robot, for judging what a program reached.
    """

    name: str
    arm: Arm
    urdf: str
    poses: Array
    twists: Array
    pose: Callable[[Array], Array]

    def case(self, level: str, *, locked: bool) -> Case:
        """The task at ``level``, with every joint or without the one that is locked."""
        arm = self.arm
        return Case(
            robot=self.name,
            level=level,
            locked=LOCKED[self.name] if locked else None,
            dt=DT,
            urdf=self.urdf,
            tip=TIP,
            joints=arm.names,
            kp=KP,
            kv=KV,
            gain=GAIN,
            q=arm.neutral,
            poses=self.poses,
            twists=self.twists,
            q_min=arm.q_min,
            q_max=arm.q_max,
            v_max=arm.v_max,
            a_max=arm.a_max,
            tau_max=arm.tau_max,
        )


def path(name: str, arm: Arm, load: Callable[[str, Array], Callable[[Array], Array]]) -> Path:
    """A closed path that ``arm`` can follow with and without its locked joint.

    The targets are the tip of q(t) = q_0 + s a (1 - cos(2 pi t / T)) / 2, where the locked joint has a = 0
    and s gives the tip its greatest speed.

    Args:
        name: ``panda`` or ``chain30``.
        arm: The robot.
        load: A function from URDF text and acceleration limits to the function that gives the tip's pose (4,
            4) at q.
    """
    urdf = text(name, arm)
    pose = load(urdf, arm.a_max)
    shape = np.sin(1.7 * np.arange(len(arm.names)) + 0.6)
    shape[LOCKED[name]] = 0.0
    phase = 2.0 * np.pi * np.arange(PERIOD) / PERIOD
    rise = (1.0 - np.cos(phase)) / 2.0
    rate = np.pi / (PERIOD * DT) * np.sin(phase)
    ends = [pose(arm.neutral + sign * 1e-4 * shape) for sign in (-1.0, 1.0)]
    lever = float(np.linalg.norm(ends[1][:3, 3] - ends[0][:3, 3])) / 2e-4
    scale = SPEED / (lever * float(rate.max()))
    q = arm.neutral + scale * rise[:, None] * shape
    poses = np.array([pose(row) for row in q])
    return Path(name=name, arm=arm, urdf=urdf, poses=poses, twists=_twists(poses), pose=pose)


def _twists(poses: Array) -> Array:
    """Central differences of a closed sequence of poses, (N, 6); exact to dt^2."""
    ahead, behind = np.roll(poses, -1, axis=0), np.roll(poses, 1, axis=0)
    linear = (ahead[:, :3, 3] - behind[:, :3, 3]) / (2.0 * DT)
    spin = (ahead[:, :3, :3] - behind[:, :3, :3]) @ poses[:, :3, :3].transpose(0, 2, 1) / (2.0 * DT)
    twice = spin - spin.transpose(0, 2, 1)
    angular = np.stack([twice[:, 2, 1], twice[:, 0, 2], twice[:, 1, 0]], axis=1) / 2.0
    return np.ascontiguousarray(np.hstack([linear, angular]))


def chain30() -> Arm:
    """A 30-joint arm of 3 m whose axes alternate between the link's length and a normal to it.

    Links are 0.1 m rods of 0.4 kg; torque limits grow from 40 N m at the tip to 400 N m at the base.
    """
    n, length, mass = 30, 0.1, 0.4
    # Frame i has its z axis along the joint: up the arm for even joints, across it for odd ones.
    across = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    even = np.arange(n) % 2 == 0
    rotation = np.where(even[:, None, None], across.T, across)
    rotation[0] = np.eye(3)
    up = np.where(even[:, None], np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0]))
    translation = length * np.roll(up, 1, axis=0)
    translation[0] = 0.0
    slender, thick = mass * length**2 / 12.0, mass * 0.03**2 / 2.0
    along = np.diag([slender + thick / 2.0, slender + thick / 2.0, thick])
    inertia = np.array([along if is_even else across.T @ along @ across for is_even in even])
    return Arm(
        names=tuple(f"j{i + 1}" for i in range(n)),
        prismatic=np.zeros(n, dtype=bool),
        rotation=rotation,
        translation=translation,
        mass=np.full(n, mass),
        com=length / 2.0 * up,
        inertia=inertia,
        tip_rotation=np.eye(3),
        tip_translation=length * up[-1],
        q_min=np.full(n, -2.6),
        q_max=np.full(n, 2.6),
        v_max=np.full(n, 2.0),
        a_max=np.full(n, 10.0),
        tau_max=np.linspace(400.0, 40.0, n),
        neutral=np.where(even, 0.15, 0.12) * np.where(np.arange(n) % 4 < 2, 1.0, 0.6),
    )
