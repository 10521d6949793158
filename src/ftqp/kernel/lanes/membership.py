"""Whether a joint's next velocity or acceleration lies in its interval, without the interval's ends.

The interval is that of ``ftqp.kernel.rows.joint_intervals`` with the conversion ``viability``. Each condition
is one of an arm or of several side by side; where it does not hold, the interval itself decides.
"""

from typing import Any

from ftqp.kernel.jit import jit


@jit
def may_have_velocity(x: Any, v: Any, d: Any, v_max: Any, a_max: Any, a_brake: Any, dt: float) -> Any:
    """Whether x <= min(v_max, v + a_max dt, braking_velocity(d)), the last one by what surely suffices.

    Braking from x in whole steps takes at most x^2/(2 a_brake) + 3/2 x dt.
    """
    stops = (x <= 0.0) | (x * x <= 2.0 * a_brake * (d - 1.5 * x * dt))
    return (x <= v_max) & (x <= v + a_max * dt) & (d >= 0.0) & stops


@jit
def may_have_acceleration(x: Any, v: Any, d: Any, v_max: Any, a_max: Any, a_brake: Any, dt: float) -> Any:
    """Whether x is at most the upper end of ``viability``.

    After the step the joint must be able to stop, v'^2 <= 2 a_brake (d - way); a joint that turns round in
    the step must do so before its limit, v^2 <= -2 d x.
    """
    after = v + dt * x
    stops = after * after <= 2.0 * a_brake * (d - 0.5 * dt * (v + after))
    turns = (after < 0.0) & ((v <= 0.0) | (v * v <= -2.0 * d * x))
    return (x <= a_max) & (after <= v_max) & (d >= 0.0) & (((after >= 0.0) & stops) | turns)
