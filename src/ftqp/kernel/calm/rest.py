"""When the target stands, and when to stop trying: rest is a decision, kept until something changes."""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.calm.swing import gives_up
from ftqp.kernel.jit import jit
from ftqp.kernel.latches.settling import FUTILE, PUSHED, SURE, TARGET_MOVES, TARGET_STANDS, WORTH_IT, settle
from ftqp.kernel.layout.enums import TARGET_TWIST

STANDS_WITHIN = 5e-4
"""A target that stays within this of where it came to stand [m; rotations times the length] does stand ..."""
STANDS_BELOW = 2e-3
"""... if it is not said to move faster than this [m/s; rotations times the length]."""

STOOD = 0.5
"""How long the target stands before the arm may hold [s]."""
GAIN = 0.02
"""Share of the error below which what can be removed counts as hardly anything (rho). What a hold gives up
was a few per cent of a large miss at most (docs/theory/calm.md, "Holding")."""
SLOW = 0.2
"""Share of the velocity limits below which the arm may hold at first ..."""
IMPATIENT = 1.4
"""... until the target has stood so long [s]: from then on at any speed, so that a valley that gains a little
without end is ended, too."""
NEAR_SHARE = 0.5
"""Within this share of the task's tolerances no joint goes on faster than SLOW that long, because a wrist
turned half round for the last degree of an error that was tolerated already (docs/theory/calm.md,
"Holding")."""

LEAST = 1e-6
"""An error e'e below this, a millimetre, is never held: a target in reach is not given up so near [m2]. The
square of a millimetre, which is a convention."""
DISTURBED = 1.5
"""An error that has grown by this factor since the arm held, and ..."""
PUSHED_BY = 0.01
"""... by this [m], ends the hold: it was pushed."""


@jit
def target_stands(task: Any, calm: Any) -> bool:
    """Whether the target is where it was, and is not said to move; else it is remembered anew."""
    T, anchor = task.target, calm.anchor
    way = speed = 0.0
    for r in range(3):
        d = T[4 * r + 3] - anchor[4 * r + 3]
        way += d * d
        speed += T[TARGET_TWIST + r] * T[TARGET_TWIST + r]
    if task.uses_rotation:
        L2 = task.length * task.length
        for r in range(3):
            for c in range(3):
                d = T[4 * r + c] - anchor[4 * r + c]
                way += 0.5 * L2 * d * d
            speed += L2 * T[TARGET_TWIST + 3 + r] * T[TARGET_TWIST + 3 + r]
    if way <= STANDS_WITHIN * STANDS_WITHIN and speed <= STANDS_BELOW * STANDS_BELOW:
        return True
    for r in range(12):
        anchor[r] = T[r]
    return False


@jit
def _beliefs_changed(faults: Any, calm: Any) -> bool:
    """Whether another set of joints works than at the last tick."""
    changed = calm.known_working != faults.working
    calm.known_working = faults.working
    for k in range(faults.working):
        if calm.known[k] != faults.order[k]:
            changed = True
            calm.known[k] = faults.order[k]
    return changed


@jit
def watch_target(state: Any, faults: Any, task: Any, calm: Any) -> None:
    """How long the target has stood and beliefs have not changed [s]; else the arm no longer holds."""
    stands, same = target_stands(task, calm), not _beliefs_changed(faults, calm)
    if stands and same and state.ticks > 1:
        settle(calm, TARGET_STANDS, state.dt)
    else:
        settle(calm, TARGET_MOVES, state.dt)


@jit
def _is_slow(state: Any, faults: Any, limits: Any) -> bool:
    """Whether every working joint is below SLOW of its velocity limit."""
    for k in range(faults.working):
        i = faults.order[k]
        top = limits.v_max[i] if limits.v_max[i] < inf else 1.0
        if abs(state.v[i]) >= SLOW * top:
            return False
    return True


@jit
def _is_near(task: Any, feedback: Any) -> bool:
    """Whether what is left of the error is well within what the task tolerates."""
    near: bool = task.position_error < NEAR_SHARE * feedback.tolerance
    return near and task.rotation_error < NEAR_SHARE * feedback.rotation_tolerance


@jit
def _is_futile(K: Any, square: float) -> bool:
    """Whether hardly anything of the error e'e is worth the motion that removes it."""
    calm = K.calm
    futile = calm.stood >= STOOD - SURE and calm.rho < GAIN and square > LEAST
    futile = futile and (calm.stood >= IMPATIENT or _is_slow(K.state, K.faults, K.limits))
    if calm.stood >= IMPATIENT and _is_near(K.task, K.feedback) and not _is_slow(K.state, K.faults, K.limits):
        futile = True
    if gives_up(calm) and square > LEAST:
        futile = True
    return bool(futile)


@jit
def decide(K: Any, square: float) -> None:
    """Hold when hardly anything of the error e'e is worth removing, go on when the arm was pushed away."""
    calm, dt = K.calm, K.state.dt
    if calm.holding:
        if sqrt(square) > DISTURBED * calm.held + PUSHED_BY:
            settle(calm, PUSHED, dt)
        return
    settle(calm, FUTILE if _is_futile(K, square) else WORTH_IT, dt)
    if calm.holding:
        calm.held = sqrt(square)
