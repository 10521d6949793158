"""Stops that a planner is told of, and what ends them."""

from math import inf
from typing import Any

from ftqp.kernel.arm.dynamics import dynamics
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.jit import jit
from ftqp.kernel.latches.stop_latch import latch
from ftqp.kernel.layout.enums import ALL_BRAKES, NO_BRAKES, NOT_STOPPED, STOPPED_BY_LAG, STOPPED_BY_OVERLOAD


@jit
def stop(watch: Any, reason: int) -> None:
    """Latch a stop; the reason of one that is latched stays."""
    if watch.latched == 0:
        latch(watch, reason)


@jit
def release(watch: Any, feedback: Any, chain: Any) -> None:
    """No stop is latched, and nothing is known of the last one."""
    watch.stopped = watch.rising = watch.fallbacks = 0
    feedback.moving = 0
    for i in range(chain.n):
        feedback.going[i] = 0.0
    watch.last_position_error = watch.last_rotation_error = inf
    watch.left = 0.0
    watch.latched = 0  # the last thing, so that whoever is interrupted has still stopped
    watch.reason = NOT_STOPPED


@jit
def resume(watch: Any, feedback: Any, chain: Any) -> bool:
    """Release a stop; False while a lost sensor, or the brake of the whole arm, forbids it."""
    for i in range(chain.n):
        if feedback.lost[i] or (feedback.brakes == ALL_BRAKES and feedback.asks[i]):
            return False
    feedback.waited = feedback.late = feedback.up = feedback.spent_elsewhere = 0.0
    feedback.far = feedback.stored = feedback.until_stored = 0
    for i in range(chain.n):
        feedback.spent[i] = 0.0
    release(watch, feedback, chain)
    return True


@jit
def ask_for_brake(watch: Any, feedback: Any, i: int) -> None:
    """Let the brake of joint i be asked for from now on, if the arm has any; that of all stops it."""
    if feedback.brakes == NO_BRAKES:
        return
    feedback.asks[i] = 1
    if feedback.brakes == ALL_BRAKES and watch.latched == 0:
        feedback.culprit = i
        latch(watch, STOPPED_BY_LAG)


@jit
def hold_up(K: Any, A: Any, i: int) -> bool:
    """Whether joint i is too weak for the arm's weight; its brake is then asked for, and the arm stopped.

    A planner that never stops of its own accord only asks.
    """
    if K.state.is_reset == 0 or not K.limits.tau_max[i] < inf:
        return False
    for j in range(K.chain.n):
        A.state.q[j], A.state.v[j] = K.state.q_command[j], 0.0
    forward_kinematics(A, A.state)
    motion(A, A.state)
    dynamics(A, A.state)
    if not abs(A.kinematics.h[i]) > K.limits.tau_max[i]:
        return False
    if K.watch.latched == 0 and K.watch.stop_samples > 0:
        latch(K.watch, STOPPED_BY_OVERLOAD)
    ask_for_brake(K.watch, K.feedback, i)
    return True
