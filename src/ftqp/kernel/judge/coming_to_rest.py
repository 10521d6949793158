"""How every joint that works comes to rest: the motion that QPs without a task are drawn to."""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.enums import ACCELERATION
from ftqp.kernel.layout.thresholds import FREE_SHARE
from ftqp.kernel.rows.one_variable import draw, lighten, narrow

BRAKING_SHARE = 0.25
"""Where torque limits cannot be kept in a stop, each joint brakes by this share of what it wants at least.
Joints swung at their limits to lessen an excess that nothing removes
(tests/robustness/test_stop_under_a_load.py); the quarter is a guess."""


@jit
def deceleration(v: float, last: float, a_max: float, time: float, rise: float, dt: float) -> float:
    """The acceleration that brings v to zero within ``time``, at most a_max, and none of it suddenly.

    With a jerk limit j = a_max/rise, a^2/(2 j) + a dt/2 <= |v|, the speed that falling by j dt a tick takes,
    so that it ends at rest with a = 0; and a differs from the last one by j dt at most. An acceleration that
    still speeds the joint up ends at once, and so does what a limit that was lowered since leaves of it.
    """
    a = min(abs(v) / time, a_max)
    if rise > dt:
        jerk = a_max / rise
        half = 0.5 * jerk * dt
        a = min(a, sqrt(half * half + 2.0 * jerk * abs(v)) - half)
        braked = min(max(-last if v > 0.0 else last, 0.0), a_max)
        a = min(max(a, braked - jerk * dt), braked + jerk * dt, abs(v) / dt)
    return -a if v > 0.0 else a


@rare_jit
def draw_to_rest(K: Any, time: float, rise: float, weight: float) -> None:
    """Objective weight |x - x_rest|^2/2; x_rest brings the joints that work to rest by ``deceleration``.

    What a free-swinging joint does counts little: the others are not to brake late to spare it.
    """
    limits, faults, state, qp = K.limits, K.faults, K.state, K.qp
    qp.dense = 0
    for i in range(K.chain.n):
        draw(qp, i, weight, 0.0 if state.level == ACCELERATION else state.v[i])
    for k in range(faults.working, faults.movable):
        lighten(qp, faults.order[k], FREE_SHARE)
    for k in range(faults.working):
        i = faults.order[k]
        a = deceleration(state.v[i], state.a_command[i], limits.a_max[i], time, rise, state.dt)
        draw(qp, i, weight, a if state.level == ACCELERATION else state.v[i] + state.dt * a)


@rare_jit
def only_brake(K: Any, share: float) -> None:
    """Narrow the box to between that share of x_rest and x_rest; a limit that wants more goes before.

    An excess of torque that nothing removes, for example a load that a motor cannot carry, would else have
    the joints swing at their limits for ever to lessen it. With the share 0 no joint speeds up.
    """
    faults, state, qp = K.faults, K.state, K.qp
    for k in range(faults.working):
        i = faults.order[k]
        rest = -qp.g[i] / qp.H_diagonal[i]
        coast = 0.0 if state.level == ACCELERATION else state.v[i]
        least = coast + share * (rest - coast)
        narrow(qp, i, min(rest, least), max(rest, least))
