"""A reference that swings every joint, noisy samples of it, and a detector that looks on."""

import numpy as np

import ftqp

DT = 1e-3
SIGMA = 1e-4


class Shaken:
    """The reference of an arm that swings, and samples of it.

    Args:
        robot: the arm.
        ticks: how long.
        speed: largest speed of every joint [rad/s].
        seed: of the noise.
    """

    def __init__(self, robot, ticks, speed=0.5, seed=0):
        self.robot = robot
        n = robot.nv
        t = DT * np.arange(ticks + 1)[:, None]
        rate = 1.0 + 0.13 * np.arange(n)
        q = robot.neutral + speed / rate * (1.0 - np.cos(rate * t))
        v, a = speed * np.sin(rate * t), speed * rate * np.cos(rate * t)
        self.q_ref, self.v_ref, self.a_ref = q[1:], v[1:], a[:-1]
        self.true = q[:-1].copy()
        self.noise = SIGMA * np.random.default_rng(seed).standard_normal((ticks, n))

    @property
    def q(self):
        return self.true + self.noise

    @property
    def torques(self):
        """What the reference's motion takes, (K, nv)."""
        rows = zip(self.q_ref, self.v_ref, self.a_ref, strict=True)
        return np.array([self.robot.mass_matrix(q) @ a + self.robot.bias(q, v) for q, v, a in rows])

    def log(self, **more):
        return ftqp.MotionLog(q=self.q, q_ref=self.q_ref, v_ref=self.v_ref, a_ref=self.a_ref, **more)


def watch(detector, motion, q, first=0):
    """The diagnosis after all samples q, and what was isolated when."""
    for k in range(first, len(q)):
        command = ftqp.Commanded(motion.q_ref[k], motion.v_ref[k], motion.a_ref[k])
        diagnosis = detector.update(q[k], None, None, command)
    return diagnosis
