"""Targets that are given by a clock are played back late while the arm cannot follow them, or is stopped."""

from math import sqrt
from typing import Any

from ftqp.kernel.arm.pose_error import exponential, turn_between
from ftqp.kernel.feedback.gap import approach
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.latches.settling import latch
from ftqp.kernel.layout.enums import (
    HISTORY,
    STOPPED_BY_LAG,
    TARGET_ACCELERATION,
    TARGET_HAS_ROTATION,
    TARGET_SIZE,
    TARGET_TWIST,
)
from ftqp.kernel.layout.thresholds import FASTEST, SCALED_FROM
from ftqp.kernel.maths.elementary import mul_add
from ftqp.kernel.maths.linear_systems import assign
from ftqp.kernel.monitor.leading import CATCHES_UP

LATEST = 1.0
"""Targets are played back at most this late [s]; then the arm is stopped."""

LONGEST = 60.0
"""An arm that is held for longer [s] is stopped in the end; a stop lasts for as long as it is wanted."""

CATCHING_UP_RATE = 2.0
"""While the arm follows again, this share of the lost time is made up a second, at most with the share
``CATCHES_UP`` of the targets' speed ..."""
CATCHING_UP_LEAST = 0.01
"""... but no slower than this, so that it ends."""


@jit
def _store(state: Any, task: Any, feedback: Any, history: Any) -> None:
    """Keep every few of the given targets, the newest at ``history.newest``."""
    if feedback.stored == 0:
        history.halved = 0
        history.held = 0.0
    if feedback.until_stored > 0:
        feedback.until_stored -= 1
        history.age += state.dt
        return
    feedback.until_stored = (feedback.stride << history.halved) - 1
    history.newest = history.newest + 1 if history.newest + 1 < HISTORY else 0
    feedback.stored = min(feedback.stored + 1, HISTORY)
    history.age = 0.0
    assign(history.target[history.newest], task.target, TARGET_SIZE)


@rare_jit
def _jumps(K: Any) -> bool:
    """Whether the given target is another goal: no motion of the joints could follow it so far in a tick."""
    task, last, J = K.task, K.history.last, K.kinematics.J
    x, y, z = turn_between(task.target, 4, last, 4)
    moved = way = turn = 0.0
    for r in range(3):
        moved += (task.target[4 * r + 3] - last[4 * r + 3]) ** 2
    for i in range(K.chain.n):
        most = K.state.dt * min(K.limits.v_max[i], FASTEST)
        way += most * sqrt(J[0, i] * J[0, i] + J[1, i] * J[1, i] + J[2, i] * J[2, i])
        turn += most * sqrt(J[3, i] * J[3, i] + J[4, i] * J[4, i] + J[5, i] * J[5, i])
    turned = x * x + y * y + z * z if task.uses_rotation else 0.0
    return moved > way * way or turned > turn * turn


@rare_jit
def _takes_time(K: Any) -> bool:
    """Whether the given target moves; one that stands makes nothing late, whatever comes after it.

    Where it jumps to another goal, nothing of what was given before is played back.
    """
    feedback, history, task = K.feedback, K.history, K.task
    if feedback.late == 0.0 or _jumps(K):
        feedback.late = 0.0
        feedback.stored = feedback.until_stored = 0
    assign(history.last, task.target, TARGET_SIZE)
    if feedback.stored == 0:
        return True
    for k in range(TARGET_SIZE):
        if task.target[k] != history.target[history.newest, k]:
            return True
    return False


@rare_jit
def _halve(feedback: Any, history: Any) -> None:
    """Drop every second target that is kept, so that twice the time is; the newest stays."""
    feedback.until_stored += feedback.stride << history.halved
    history.halved += 1
    feedback.stored = (feedback.stored + 1) // 2
    for k in range(1, feedback.stored):
        to, of = (history.newest - k) % HISTORY, (history.newest - 2 * k) % HISTORY
        for at in range(TARGET_SIZE):
            history.target[to, at] = history.target[of, at]


@rare_jit
def _count_held(K: Any) -> None:
    """The whole arm is held or stopped: nobody's fault is the time lost, and no target of it is forgotten."""
    feedback, history, dt = K.feedback, K.history, K.state.dt
    if K.watch.latched or history.held < LONGEST:
        history.held += dt
    spacing = (feedback.stride << history.halved) * dt
    if (
        feedback.stored >= HISTORY - 1 and feedback.late > (HISTORY - 3) * spacing
    ):  # an odd number keeps its ends
        _halve(feedback, history)


@jit
def _between(A: Any, B: Any, s: float, h: float, history: Any, out: Any) -> None:
    """The target at the share s of the time h from A to B: straight, or cubic where their twists lead there.

    Those of targets that are far apart, as after a long hold, may lead elsewhere.
    """
    way = beside_a = beside_b = moving = 0.0
    for r in range(3):
        d = B[4 * r + 3] - A[4 * r + 3]
        u, w = h * A[TARGET_TWIST + r], h * B[TARGET_TWIST + r]
        way += d * d
        beside_a += (u - d) * (u - d)
        beside_b += (w - d) * (w - d)
        moving += u * u + w * w
    smooth = moving > 0.0 and max(beside_a, beside_b) <= way
    for r in range(3):
        a, b = A[4 * r + 3], B[4 * r + 3]
        x = mul_add(s, b - a, a)
        if smooth:
            u, w = h * A[TARGET_TWIST + r], h * B[TARGET_TWIST + r]
            x += s * (1.0 - s) * ((1.0 - s) * (u - (b - a)) - s * (w - (b - a)))
        out[4 * r + 3] = x
    x, y, z = turn_between(B, 4, A, 4)
    exponential(s * x, s * y, s * z, history.turn)
    Q = history.turn
    for r in range(3):
        for c in range(3):
            out[4 * r + c] = Q[3 * r] * A[c] + Q[3 * r + 1] * A[4 + c] + Q[3 * r + 2] * A[8 + c]
    for k in range(TARGET_TWIST, TARGET_HAS_ROTATION):
        out[k] = A[k] + s * (B[k] - A[k])
    if moving > 0.0 and not smooth:
        for r in range(3):
            out[TARGET_TWIST + r] = (B[4 * r + 3] - A[4 * r + 3]) / h
        out[TARGET_TWIST + 3], out[TARGET_TWIST + 4], out[TARGET_TWIST + 5] = x / h, y / h, z / h
        for k in range(TARGET_ACCELERATION, TARGET_HAS_ROTATION):
            out[k] = 0.0
    out[TARGET_HAS_ROTATION] = B[TARGET_HAS_ROTATION]


@rare_jit
def _look_up(K: Any, late: float) -> None:
    """The target that was given ``late`` seconds ago, into the task."""
    feedback, history, task = K.feedback, K.history, K.task
    spacing = (feedback.stride << history.halved) * K.state.dt
    if late <= history.age or feedback.stored < 2:
        newer, older, h, back = -1, history.newest, history.age, late
        if h == 0.0:
            return
    else:
        index = int((late - history.age) / spacing)
        index = min(index, feedback.stored - 2)
        newer = history.newest - index
        newer = newer if newer >= 0 else newer + HISTORY
        older = newer - 1 if newer > 0 else HISTORY - 1
        h, back = spacing, min(late - history.age - index * spacing, spacing)
    for k in range(TARGET_SIZE):
        history.given[k] = task.target[k] if newer < 0 else history.target[newer, k]
    _between(
        history.target[older], history.given, min(max(1.0 - back / h, 0.0), 1.0), h, history, task.target
    )


@rare_jit
def _catch_up(K: Any) -> float:
    """How the speed of the playback changes to make up for lost time [1/s]."""
    feedback, dt = K.feedback, K.state.dt
    wanted = 0.0
    if feedback.rate > SCALED_FROM and feedback.late > 0.0:
        wanted = min(CATCHES_UP, max(CATCHING_UP_RATE * feedback.late, CATCHING_UP_LEAST))
    change = approach(feedback.up, wanted, dt)
    feedback.up = max(feedback.up + dt * change, 0.0)
    return change


@jit
def play_back(K: Any) -> None:
    """The target of ``late`` seconds ago at the speed r = rate + up, which is 0 while the arm is stopped.

    Its twist is r x', its acceleration r^2 x'' + r' x', and late' = 1 - r. While nothing is late the target
    is the given one, untouched. It stops the arm when it would be later than a second, beside the
    time for which the whole arm was held or stopped.
    Source: docs/theory/feedback.md, "Late targets".
    """
    feedback, task, watch, dt = K.feedback, K.task, K.watch, K.state.dt
    if feedback.late == 0.0 and feedback.rate == 1.0 and watch.latched == 0:
        _store(K.state, task, feedback, K.history)
        feedback.up = 0.0
        return
    if watch.latched:
        feedback.rate = feedback.rate_change = feedback.up = 0.0
    change = feedback.rate_change + _catch_up(K)
    if _takes_time(K):
        feedback.late += dt
        _store(K.state, task, feedback, K.history)
    feedback.late -= dt * (feedback.rate + feedback.up)
    if watch.latched or K.held.on or feedback.rate < SCALED_FROM:
        _count_held(K)
    K.history.held = min(K.history.held, max(feedback.late, 0.0))
    if feedback.late <= 0.0:
        feedback.late = 0.0
        if feedback.rate == 1.0:
            return
    if feedback.late > LATEST + K.history.held:
        feedback.late = LATEST + K.history.held
        if watch.stop_samples > 0 and watch.latched == 0:
            latch(watch, STOPPED_BY_LAG)
    if feedback.late > 0.0:
        _look_up(K, feedback.late)
    r = feedback.rate + feedback.up
    for k in range(6):
        twist = task.target[TARGET_TWIST + k]
        task.target[TARGET_TWIST + k] = r * twist
        task.target[TARGET_ACCELERATION + k] = r * r * task.target[TARGET_ACCELERATION + k] + change * twist
