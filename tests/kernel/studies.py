"""Studies of arms for the tests of the kernel."""

import numpy as np
from scipy.stats import qmc

from ftqp.kernel.entry.study_session import StudySession
from ftqp.model import catalog


def study_of(robot, rows, step=0.05, *, limited=False):
    """A study of a robot, by default without its limits."""
    low, high = robot.limits.q_min, robot.limits.q_max
    free = np.full(robot.nv, np.inf)
    return StudySession(
        robot.chain.constants(),
        rows,
        robot.length,
        q_min=low if limited else -free,
        q_max=high if limited else free,
        wraps=~robot.chain.prismatic & (np.isinf(low) | (not limited)),
        step=step,
    )


def unit_arm(joints=3):
    """A planar arm of links of 1 m whose joints turn without end."""
    return catalog.load("planar", lengths=(1.0,) * joints, continuous=True)


def at(x, y):
    """The pose of a planar goal."""
    T = np.eye(4)
    T[:2, 3] = x, y
    return T


def starts(joints, count=64):
    """Joint values that fill one turn each, (count, joints)."""
    return np.asarray((2.0 * qmc.Sobol(joints, seed=0).random(count) - 1.0) * np.pi)
