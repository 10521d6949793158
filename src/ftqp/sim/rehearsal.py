"""A motion of all joints, gone by a simulated arm behind position servos, as a recorder would keep it."""

from types import SimpleNamespace

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.model.fitting.exciting_motion import ExcitingMotion
from ftqp.model.fitting.torque_log import TorqueLog
from ftqp.model.robot import Robot
from ftqp.sim.plants.joint_servo import JointServo
from ftqp.sim.plants.true_arm import TrueArm

SUBSTEPS = 4
"""Servos take a command in each so many parts of a period: their torques would else be saw-teeth, and the
last tooth of a period is not their mean."""


def rehearsed(
    robot: Robot,
    motion: ExcitingMotion,
    true: TrueArm,
    *,
    bandwidth: float = 94.0,
    position_noise: float = 0.0,
    torque_noise: float = 0.0,
    seed: int = 0,
) -> TorqueLog:
    """What would be recorded of the true arm while its servos follow the motion."""
    from ftqp.sim.plants.mujoco_plant import MujocoPlant

    dt, rng, n = float(motion.t[1] - motion.t[0]), np.random.default_rng(seed), robot.nv
    servo = JointServo(true.geared(robot), "position", bandwidth=bandwidth)
    plant = MujocoPlant(robot, dt / SUBSTEPS, servo, true, substeps=1)
    plant.reset(motion.q[0], motion.v[0])
    q, tau, none = np.zeros_like(motion.q[:-1]), np.zeros_like(motion.q[:-1]), np.zeros(n, dtype=bool)
    for k in range(len(q)):
        q[k] = plant.q
        for part in range(SUBSTEPS):
            plant.advance(_between(motion, k, (part + 1) / SUBSTEPS, none))
            tau[k] += plant.tau / SUBSTEPS
    q += position_noise * rng.standard_normal(q.shape)
    tau += torque_noise * rng.standard_normal(q.shape)
    return TorqueLog(t=motion.t[:-1], q=q, tau=tau, late=0.5 * dt, name="the rehearsal")


def _between(motion: ExcitingMotion, k: int, share: float, none: FloatArray) -> SimpleNamespace:
    """The command at a share of the period after sample k."""
    q, v = (x[k] + share * (x[k + 1] - x[k]) for x in (motion.q, motion.v))
    return SimpleNamespace(q=q, v=v, tau=np.zeros(len(q)), brakes=none)
