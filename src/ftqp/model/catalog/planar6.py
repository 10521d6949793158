"""The six-link planar arm of Jin et al."""

import numpy as np

from ftqp.model.catalog.planar import links
from ftqp.model.robot import Robot

LENGTHS = (0.301, 0.290, 0.230, 0.225, 0.214, 0.103)
"""Link lengths [m]."""

DENSITY = 4.0
"""Mass per length of the uniform slender links [kg/m]."""

START = np.pi / 12
"""Start position of every joint [rad]."""


def planar6(*, vertical: bool = False) -> Robot:
    """Planar arm of six links: joint 1 has a motor, joints 2 to 6 push rods; tip at the end of link 6.

    Source: Jin et al. 2017, table 1: link lengths and position limits. The paper gives no masses,
    speed or acceleration limits. Chosen here: slender links of 4 kg/m, 0.4 rad/s, 2 rad/s2, no torque limit,
    start at pi/12 in every joint, and motion in a horizontal plane, so that gravity is zero.

    Args:
        vertical: Gravity (0, -9.81, 0) m/s2 instead of zero.
    """
    limits = dict(
        q_min=[-1.536, 0.052, 0.035, 0.052, 0.035, 0.009],
        q_max=[1.431, 0.816, 0.621, 0.599, 0.599, 0.445],
        v_max=0.4,
        a_max=2.0,
    )
    return links("planar6", LENGTHS, DENSITY, limits, neutral=np.full(6, START), vertical=vertical)
