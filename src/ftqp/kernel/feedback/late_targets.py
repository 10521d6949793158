"""Targets that are given by a clock are played back late while the arm cannot follow them."""

from typing import Any

from ftqp.kernel.arm.pose_error import exponential, turn_between
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

LATEST = 1.0
"""Targets are played back at most this late [s]; then the arm is stopped."""

LONGEST = 60.0
"""Of the time for which the whole arm was held, so much is made up for [s]: what is kept is then a second
apart."""

CATCHING_UP = 0.25
"""While the arm follows again, lost time is made up with at most this much beside the targets' speed ..."""
CATCHING_UP_RATE = 2.0
"""... or this share of the lost time a second ..."""
CATCHING_UP_LEAST = 0.01
"""... but no slower than this, so that it ends."""
FOLLOWS_FROM = 0.98
"""A rate above this counts as following again."""


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
    for k in range(TARGET_SIZE):
        history.target[history.newest, k] = task.target[k]


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
    """The whole arm is held: that this time is lost is nobody's fault, and no target of it is forgotten."""
    feedback, history, dt = K.feedback, K.history, K.state.dt
    history.held = min(history.held + dt, LONGEST)
    spacing = (feedback.stride << history.halved) * dt
    if feedback.stored == HISTORY and feedback.late > (HISTORY - 3) * spacing:
        _halve(feedback, history)


@jit
def _between(A: Any, B: Any, s: float, h: float, history: Any, out: Any) -> None:
    """The target at the share s of the time h from A to B: cubic where they have twists, else straight."""
    moving = 0.0
    for k in range(6):
        moving = max(moving, abs(A[TARGET_TWIST + k]), abs(B[TARGET_TWIST + k]))
    for r in range(3):
        a, b = A[4 * r + 3], B[4 * r + 3]
        x = a + s * (b - a)
        if moving > 0.0:
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
    if feedback.rate > FOLLOWS_FROM and feedback.late > 0.0:
        wanted = min(CATCHING_UP, max(CATCHING_UP_RATE * feedback.late, CATCHING_UP_LEAST))
    change = min(max((wanted - feedback.up) / max(0.05, dt), -5.0), 2.0)
    feedback.up = max(feedback.up + dt * change, 0.0)
    return change


@jit
def play_back(K: Any) -> None:
    """The target of ``late`` seconds ago at the speed r = rate + up.

    Its twist is r x', its acceleration r^2 x'' + r' x', and late' = 1 - r. While nothing is late the target
    is the given one, untouched. It stops the arm when it would be later than a second, beside the
    time for which the whole arm was held.
    Source: docs/theory/feedback.md, "Late targets".
    """
    feedback, task, watch, dt = K.feedback, K.task, K.watch, K.state.dt
    _store(K.state, task, feedback, K.history)
    if feedback.late == 0.0 and feedback.rate == 1.0:
        feedback.up = 0.0
        return
    change = feedback.rate_change
    if watch.latched == 0:
        change += _catch_up(K)
        feedback.late += dt * (1.0 - feedback.rate - feedback.up)
        if K.held.on or feedback.rate < FOLLOWS_FROM:
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
