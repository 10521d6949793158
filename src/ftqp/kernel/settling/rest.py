"""When the target stands, and when to stop trying: rest is a decision, kept until something changes."""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.latches.settling import FUTILE, PUSHED, SURE, TARGET_MOVES, TARGET_STANDS, WORTH_IT, settle
from ftqp.kernel.layout.enums import ACCELERATION, TARGET_TWIST
from ftqp.kernel.maths.linear_systems import assign, factor, plus_products, solve_factored

SETTLED = 1.0
"""How long the target has stood before a swing counts [s]: until then the arm arrives."""
WINDOW, LONG_WINDOW = 1.0, 4.0
"""Over how long a motion is looked at [s], second by second and, for slow swings, four seconds at once. The
long one because greatest manipulability swung slowly without end
(tests/robustness/test_found_by_campaigns.py)."""
TO_AND_FRO = 0.5
"""It is a swing where the joints come no farther than this share of the way that they go ..."""
LEAST_WAY = 0.005
"""... and that is more than what one joint goes in a window at this share of its velocity limit. What they
must tell apart is in tests/robustness/test_stopped_arm.py."""
TIMES = 2
"""An arm that swings once comes to rest beside its task; seen so often, it no longer asks for its error."""


@jit
def watch_swing(K: Any) -> None:
    """Whether the arm swings: its way and how far it has come, window by window, in what v_max goes in 1 s.

    ``settling.window`` is the time within the long window, of which every second is a short one.

    A swing is remembered until the target moves or another set of joints works. A motion that leads the arm
    somewhere, however long it takes, is none.
    Source: docs/theory/settling.md, "Schemes that do not rest".
    """
    settling = K.settling
    if settling.stood < SETTLED:
        settling.window = 0.0
        settling.gradient_suppressed = 0
    elif not gives_up(settling):
        _look_back(K)


@jit
def gives_up(settling: Any) -> bool:
    """Whether the arm swings although its scheme has given way: not even its error is worth that."""
    swung: bool = settling.gradient_suppressed >= TIMES
    return swung


@rare_jit
def _look_back(K: Any) -> None:
    faults, state, settling = K.faults, K.state, K.settling
    if settling.window == 0.0:
        settling.way = settling.long_way = 0.0
        _begin_at(state, K.chain, settling.q_long_window)
    if settling.way == 0.0:
        _begin_at(state, K.chain, settling.q_window)
    way = 0.0
    for k in range(faults.working):
        i = faults.order[k]
        way += state.dt * abs(state.v[i]) / _top(K.limits, i)
    settling.way += way
    settling.long_way += way
    begun = settling.window // WINDOW
    settling.window += state.dt
    swings = False
    if settling.window // WINDOW > begun:
        swings = _goes_to_and_fro(state, faults, K.limits, WINDOW, settling.way, settling.q_window)
        settling.way = 0.0
    if settling.window >= LONG_WINDOW:
        swings = swings or _goes_to_and_fro(
            state, faults, K.limits, LONG_WINDOW, settling.long_way, settling.q_long_window
        )
        settling.window = 0.0
    if swings:
        settling.gradient_suppressed += 1
        settling.window = 0.0


@jit
def _begin_at(state: Any, chain: Any, q: Any) -> None:
    assign(q, state.q, chain.n)


@jit
def _goes_to_and_fro(state: Any, faults: Any, limits: Any, window: float, way: float, q: Any) -> bool:
    """Whether the joints went ``way`` since they were at q, and came no farther than half of that."""
    come = 0.0
    for k in range(faults.working):
        i = faults.order[k]
        come += abs(state.q[i] + state.dt * state.v[i] - q[i]) / _top(limits, i)
    swings: bool = way > LEAST_WAY * window and come < TO_AND_FRO * way
    return swings


@jit
def _top(limits: Any, i: int) -> Any:
    return limits.v_max[i] if limits.v_max[i] < inf else 1.0


STANDS_WITHIN = 5e-4
"""A target that stays within this of where it came to stand [m; rotations times the length] does stand ..."""
STANDS_BELOW = 2e-3
"""... if it is not said to move faster than this [m/s; rotations times the length]."""

STOOD = 0.5
"""How long the target stands before the arm may hold [s]."""
GAIN = 0.02
"""Share of the error below which what can be removed counts as hardly anything (rho). What a hold gives up
was a few per cent of a large miss at most (docs/theory/settling.md, "Holding")."""
SLOW = 0.2
"""Share of the velocity limits below which the arm may hold at first ..."""
IMPATIENT = 1.4
"""... until the target has stood so long [s]: from then on at any speed, so that a valley that gains a little
without end is ended, too."""
NEAR_SHARE = 0.5
"""Within this share of the task's tolerances no joint goes on faster than SLOW that long, because a wrist
turned half round for the last degree of an error that was tolerated already (docs/theory/settling.md,
"Holding")."""

LEAST = 1e-6
"""An error e'e below this, a millimetre, is never held: a target in reach is not given up so near [m2]. The
square of a millimetre, which is a convention."""
DISTURBED = 1.5
"""An error that has grown by this factor since the arm held, and ..."""
PUSHED_BY = 0.01
"""... by this [m], ends the hold: it was pushed."""


@jit
def target_stands(task: Any, settling: Any) -> bool:
    """Whether the target is where it was, and is not said to move; else it is remembered anew."""
    T, anchor = task.target, settling.anchor
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
    assign(anchor, T, 12)
    return False


@jit
def _beliefs_changed(faults: Any, settling: Any) -> bool:
    """Whether another set of joints works than at the last tick."""
    changed = settling.known_working != faults.working
    settling.known_working = faults.working
    for k in range(faults.working):
        if settling.known[k] != faults.order[k]:
            changed = True
            settling.known[k] = faults.order[k]
    return changed


@jit
def watch_target(state: Any, faults: Any, task: Any, settling: Any) -> None:
    """How long the target has stood and beliefs have not changed [s]; else the arm no longer holds."""
    stands, same = target_stands(task, settling), not _beliefs_changed(faults, settling)
    if stands and same and state.ticks > 1:
        settle(settling, TARGET_STANDS, state.dt)
    else:
        settle(settling, TARGET_MOVES, state.dt)


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
    settling = K.settling
    futile = settling.stood >= STOOD - SURE and settling.rho < GAIN and square > LEAST
    futile = futile and (settling.stood >= IMPATIENT or _is_slow(K.state, K.faults, K.limits))
    if (
        settling.stood >= IMPATIENT
        and _is_near(K.task, K.feedback)
        and not _is_slow(K.state, K.faults, K.limits)
    ):
        futile = True
    if gives_up(settling) and square > LEAST:
        futile = True
    return bool(futile)


@jit
def decide(K: Any, square: float) -> None:
    """Hold when hardly anything of the error e'e is worth removing, go on when the arm was pushed away."""
    settling, dt = K.settling, K.state.dt
    if settling.holding:
        if sqrt(square) > DISTURBED * settling.held + PUSHED_BY:
            settle(settling, PUSHED, dt)
        return
    settle(settling, FUTILE if _is_futile(K, square) else WORTH_IT, dt)
    if settling.holding:
        settling.held = sqrt(square)


SHARE = 0.45
"""Share of the braking deceleration that the way to the goal counts on. Chosen by
`python studies/study_calm.py --seed 17` (docs/evidence/settling.md, "Targets that stand")."""
FINE = 0.005
"""Share of the velocity limits that feedback asks for in the last millimetre of a target that has stood for
IMPATIENT: less than what counts as rest. It grows as the fourth power of a larger error; a step up there made
an arm hunt for ever across that millimetre (tests/robustness/test_found_by_campaigns.py). Chosen by the
same command as SHARE, `python studies/study_calm.py --seed 17`."""


@jit
def way_to_go(task: Any, settling: Any, count: int, soft: float) -> float:
    """Delta over the free joints and the share of the error that it can remove.

    Delta = (A'A + D + soft 1)^-1 (A'e + kick),  rho = (A'e + kick)'Delta/(e'e)
    """
    W, delta = settling.work, settling.delta
    square = plus_products(0.0, settling.e, settling.e, task.m)
    for a in range(count):
        i = settling.free[a]
        delta[a] = settling.gradient[i] + settling.kick[i]
        for b in range(a + 1):
            j = settling.free[b]
            W[a, b] = plus_products(settling.D[i, j], settling.A[:, i], settling.A[:, j], task.m)
        W[a, a] += soft
    if not factor(W, count):
        return 1.0
    solve_factored(W, count, delta)
    rho = 0.0
    for a in range(count):
        i = settling.free[a]
        rho += (settling.gradient[i] + settling.kick[i]) * delta[a]
    return rho / square if square > 0.0 else 1.0


@jit
def braked(limits: Any, settling: Any, count: int, rate: float, square: float) -> float:
    """beta = min_i sqrt(2 SHARE a_brake_i |Delta_i|) / (rate |Delta_i|), at most 1.

    It is the share of the error that feedback may ask for: never a speed from which the arm cannot brake
    before the point it goes to. Velocity limits do not count here, they are bounds of the QP: a joint that
    runs at its limit does not slow the others. ``rate`` is that of the feedback [1/s], ``square`` e'e.
    """
    fine = FINE * max(1.0, square / LEAST) ** 2 if settling.stood >= IMPATIENT else inf
    beta = 1.0
    for a in range(count):
        i = settling.free[a]
        size = abs(settling.delta[a])
        top = sqrt(2.0 * SHARE * limits.a_brake[i] * size)
        if fine < inf:
            top = min(top, fine * limits.v_max[i])
        if rate * size * beta > top:
            beta = top / (rate * size)
    return beta


@jit
def feedback_rate(state: Any, task: Any, kp: float) -> float:
    """How fast the feedback alone brings the error down [1/s]: kp/kv, or kp at the velocity level."""
    if state.level == ACCELERATION:
        return kp / task.kv if task.kv > 0.0 else 0.0
    return kp
