"""A velocity that the null space is drawn to, for a path that has stalled."""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import HEALTHY, VELOCITY
from ftqp.kernel.rows.objective import draw_to

DRIVE_GAIN = 4.0
"""How fast the null-space velocity approaches the drive at least, where it is a state [1/s]."""


@jit
def add_drive(K: Any, path: Any) -> None:
    """The objective of x - x_0 in place of x, g -= H x_0: the null space is drawn to the velocity ``drive``.

    Velocity level: x_0 = drive, or DRIVE_GAIN dt (drive - v) where the scheme keeps the last velocity.
    Acceleration level: x_0 = gain drive - (gain - own) v, own the velocity gain that the scheme has already
    and gain = max(DRIVE_GAIN, own).
    """
    faults, state, criteria, scratch = K.faults, K.state, K.criteria, K.scratch
    own = 0.0
    if criteria.norm > 0.0:
        own = criteria.norm_v / criteria.norm
    elif criteria.inertia > 0.0:
        own = criteria.inertia_v / criteria.inertia
    gain = max(DRIVE_GAIN, own)
    keeps = own < 0.0 or (criteria.norm == 0.0 and criteria.inertia == 0.0)
    for i in range(K.chain.n):
        x = path.drive[i]
        if state.level != VELOCITY:
            x = gain * x - (gain - own) * state.v[i]
        elif keeps:
            x = DRIVE_GAIN * state.dt * (x - state.v[i])
        scratch.joints[i] = x if faults.code[i] == HEALTHY else 0.0
    draw_to(K.chain, K.qp, scratch.joints)
