"""The arm on a base that moves: where the base is, how it moves, and the inertial target seen from it.

I is the inertial frame, B the arm's base (the W of all other modules), T_b the pose of B in I. The QP stays
in B: its error is R' e, the error along I's axes turned by the base attitude R that is believed.
Source: Holt and Desrochers 1994, eq. 19 with R = R_b(eta_o) ("nominal"); the estimate of the base, the
observer and the feed-forward are additions, derived in docs/theory/moving-base.md.
"""

from typing import Any

from ftqp.kernel.arm.pose_error import exponential, rotation_vector, turn_of
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import (
    BASE_HALTED,
    BASE_RANK_DEFICIENT,
    BASE_SATURATED,
    BASE_STALE,
    BASE_TRACKING,
    BASE_UNREACHABLE,
    BY_POSITION,
    DELAYS,
    HAS_BASE,
    HAS_POSITION,
    HAS_TIP,
    HAS_TWIST,
    HEALTHY,
    INVALID_INPUT,
    MEASURED_ATTITUDE,
    NOMINAL_ATTITUDE,
    OK,
    SCALED,
    STOPPED,
    STOPPING,
    TARGET_HAS_ROTATION,
    TARGET_TWIST,
)
from ftqp.kernel.layout.thresholds import AT_REST
from ftqp.kernel.maths.elementary import has_last_row, is_finite
from ftqp.kernel.maths.linear_systems import assign, factor
from ftqp.kernel.maths.vectors import add_to, column, cross, inner, rotated_back, three, three_from, write
from ftqp.kernel.rows.joint_intervals import narrow

PATIENCE = 5
"""Samples in a row of standing, or of leaning on a position limit, after which a target is out of reach."""


@jit
def base_from_tip(E: Any, arm: Any, T: Any) -> None:
    """T_b = T_E T_arm^-1: R_b = R_E R_arm', p_b = p_E - R_b p_arm.

    E and T are (4, 4); arm, (12,), is R_arm and p_arm.
    """
    for r in range(3):
        for c in range(3):
            T[r, c] = inner(three(E[r]), three_from(arm, 3 * c))
        T[r, 3] = E[r, 3] - inner(three(T[r]), three_from(arm, 9))


@jit
def _is_measured(T: Any) -> bool:
    """Whether a pose, (4, 4), is finite, and not transposed."""
    for r in range(3):
        for c in range(4):
            if not is_finite(T[r, c]):
                return False
    return has_last_row(T[3, 0], T[3, 1], T[3, 2], T[3, 3])


@jit
def _measure(base: Any, arm: Any) -> bool:
    """Write the base pose that this tick's measurements give into ``now``; False without a finite one.

    A tip position alone gives p_b with the nominal attitude: T_b = (R_o, p_E - R_o p_arm).
    """
    T, has = base.now, base.has
    if has & HAS_BASE and not _is_measured(base.given):
        return False
    if has & HAS_TIP:
        E = base.tip_world
        if has & HAS_POSITION:
            for r in range(3):
                if not is_finite(E[r, 3]):
                    return False
                for c in range(3):
                    E[r, c] = 0.0
                    for k in range(3):
                        E[r, c] += base.nominal[3 * r + k] * arm[3 * k + c]
        elif not _is_measured(E):
            return False
        base_from_tip(E, arm, T)
        return True
    if has & HAS_BASE:
        for r in range(3):
            assign(T[r], base.given[r], 4)
        return True
    return False


@jit
def _observe(base: Any, arm: Any) -> None:
    """Observe the disturbance: dv <- dv + a (d - dv), d the tip's displacement by the base since last time.

    d is T_b,k T_arm against T_b,k-1 T_arm with the same arm pose. For a target at rest that is
    -(e_k - e_k-1) - R_b J (q_k - q_k-1), here exact for large motions, too. Joint motion enters as it was
    measured, never as commanded, so neither a limit nor a slow servo is taken for base motion; ``hold``
    freezes dv after a step that limits cut.
    Source: docs/theory/moving-base.md, "Observer".
    """
    T, L, s = base.now, base.last, base.six
    for r in range(3):
        s[r] = (
            T[r, 3]
            + inner(three(T[r]), three_from(arm, 9))
            - (L[r, 3] + inner(three(L[r]), three_from(arm, 9)))
        )
    write(s, 3, turn_of((three(T[0]), three(T[1]), three(T[2])), (three(L[0]), three(L[1]), three(L[2]))))
    for k in range(6):
        base.shift[k] += base.observer * (s[k] - base.shift[k])


@jit
def _predict(state: Any, kinematics: Any, base: Any) -> None:
    """Twist of the tip by base motion, as a twist at the tip's point along I, and T_b brought to now.

    A given twist V of the base is the mean over the sample that began ``lead`` ago: over the coming sample it
    will be V + lead V', on the way to now it was V + (lead - dt)/2 V', with V' = (V - V_last)/dt. At the tip
    that is v + w x r with r from the base to the tip. Without a given twist it is dv/dt of the observer, or
    zero.
    """
    T, S, s = base.now, base.pose, base.six
    lead = base.delay * state.dt
    tip = three(kinematics.o_tip)
    r = (inner(three(T[0]), tip), inner(three(T[1]), tip), inner(three(T[2]), tip))
    if base.has & HAS_TWIST:
        for k in range(6):
            change = (base.rate[k] - base.rate_last[k]) / state.dt if base.rates > 1 else 0.0
            s[k] = base.rate[k] + 0.5 * (lead - state.dt) * change if base.delay > 0 else base.rate[k]
            base.twist[k] = base.rate[k] + lead * change
        add_to(s, 0, cross(three_from(s, 3), r))
        add_to(base.twist, 0, cross(three_from(base.twist, 3), r))
    else:
        for k in range(6):
            base.twist[k] = s[k] = base.shift[k] / state.dt
    if base.delay == 0:
        for k in range(3):
            assign(S[k], T[k], 4)
        return
    X = base.turn
    exponential(s[3] * lead, s[4] * lead, s[5] * lead, X)
    for k in range(3):
        for c in range(3):
            S[k, c] = inner(three_from(X, 3 * k), column(T, 0, c))
    for k in range(3):
        S[k, 3] = T[k, 3] + inner(three(T[k]), tip) + s[k] * lead - inner(three(S[k]), tip)


@jit
def _target_from_base(task: Any, kinematics: Any, base: Any) -> None:
    """The inertial target as a target in B whose error there is R' e, and its twist R'(V_d - V_base).

    e = (p_d - p_E; log R_d R_E') along I with T_E = T_b T_arm; p = p_arm + R'(p_d - p_E), rotation
    R' R_d R_E' R R_arm. With R = R_b that is T_b^-1 T_d. R is the estimated, the nominal or the measured
    attitude.
    Source: Holt and Desrochers 1994, eq. 19, for the nominal one.
    """
    B, T, A, R = base.pose, task.target, kinematics.R_tip, base.turn
    for r in range(3):
        for c in range(3):
            if base.attitude == NOMINAL_ATTITUDE:
                R[3 * r + c] = base.nominal[3 * r + c]
            elif base.attitude == MEASURED_ATTITUDE and base.has & HAS_BASE:
                R[3 * r + c] = base.given[r, c]
            else:
                R[3 * r + c] = B[r, c]
    E, X, e = base.tip, base.product, base.error
    for r in range(3):
        for c in range(3):
            E[3 * r + c] = B[r, 0] * A[c] + B[r, 1] * A[3 + c] + B[r, 2] * A[6 + c]
        e[r] = T[4 * r + 3] - (B[r, 3] + inner(three(B[r]), three(kinematics.o_tip)))
    e[3] = e[4] = e[5] = 0.0
    if T[TARGET_HAS_ROTATION] != 0.0:
        for r in range(3):
            for c in range(3):  # X = R_d R_E'
                X[3 * r + c] = inner(three_from(T, 4 * r), three_from(E, 3 * c))
        write(e, 3, rotation_vector(three(X), three_from(X, 3), three_from(X, 6)))
        for r in range(3):
            for c in range(3):  # E = R' X
                E[3 * r + c] = R[r] * X[c] + R[3 + r] * X[3 + c] + R[6 + r] * X[6 + c]
        for r in range(3):
            for c in range(3):  # X = R' X R
                X[3 * r + c] = E[3 * r] * R[c] + E[3 * r + 1] * R[3 + c] + E[3 * r + 2] * R[6 + c]
        for r in range(3):
            for c in range(3):
                T[4 * r + c] = X[3 * r] * A[c] + X[3 * r + 1] * A[3 + c] + X[3 * r + 2] * A[6 + c]
    s = base.six
    for r in range(3):
        T[4 * r + 3] = kinematics.o_tip[r] + R[r] * e[0] + R[3 + r] * e[1] + R[6 + r] * e[2]
    for k in range(6):
        s[k] = T[TARGET_TWIST + k] - base.twist[k]
    for half in range(0, 6, 3):
        write(T, TARGET_TWIST + half, rotated_back(R, three_from(s, half)))


@part_jit
def follow_base(K: Any, base: Any) -> bool:
    """One tick of the moving base, after the kinematics: False when it has not been seen for too long."""
    state, kinematics = K.state, K.kinematics
    at = base.ticks % DELAYS
    now = base.arm_history[at]
    assign(now, kinematics.R_tip, 9)
    for r in range(3):
        now[9 + r] = kinematics.o_tip[r]
    if base.ticks == 0:
        for row in range(1, DELAYS):
            assign(base.arm_history[row], now, 12)
    arm = base.arm_history[(base.ticks - base.delay) % DELAYS]
    base.ticks += 1
    if base.has & HAS_TWIST:
        for k in range(6):
            if not is_finite(base.rate[k]):
                base.has &= ~HAS_TWIST
    if _measure(base, arm):
        if base.seen > 0 and base.observer > 0.0 and not base.hold:
            _observe(base, arm)
        base.seen += 1
        base.age = 0.0
        for r in range(3):
            assign(base.last[r], base.now[r], 4)
    else:
        base.age += state.dt
        if base.ever == 0 or base.age > base.patience:
            base.seen = base.rates = 0
            base.shift[:6] = 0.0
            base.stale = 1
            return False
        base.seen = 0
    base.ever = 1
    base.stale = 1 if base.age > 0.0 else 0
    base.rates = base.rates + 1 if base.has & HAS_TWIST else 0
    _predict(state, kinematics, base)
    if base.has & HAS_TWIST:
        assign(base.rate_last, base.rate, 6)
    _target_from_base(K.task, kinematics, base)
    return True


@jit
def reduce_by_lead(state: Any, faults: Any, limits: Any, qp: Any, base: Any) -> None:
    """-v_max - lead/dt <= x <= v_max - lead/dt, lead = set point - q: no windup against a servo that lags."""
    for k in range(faults.working):
        i = faults.order[k]
        lead = (base.setpoint[i] - state.q[i]) / state.dt
        narrow(qp, i, -limits.v_max[i] - lead, limits.v_max[i] - lead)


@jit
def is_rank_deficient(faults: Any, task: Any, qp: Any, scratch: Any, threshold: float) -> bool:
    """Whether sigma_min of the working joints' task rows in characteristic lengths is below ``threshold``.

    That is so exactly when A_H A_H' - (threshold length)^2 1 has no Cholesky factor.
    """
    m, S = task.m, scratch.square
    least = threshold * task.length
    for a in range(m):
        for b in range(a + 1):
            s = 0.0
            for k in range(faults.working):
                i = faults.order[k]
                s += qp.A[a, i] * qp.A[b, i]
            S[a, b] = s
        S[a, a] -= least * least
    return not factor(S, m)


@jit
def _leans_or_stands(state: Any, faults: Any, limits: Any, chain: Any, qp: Any) -> bool:
    """Whether every command is about zero, or a position limit holds one back."""
    standing = True
    for i in range(chain.n):
        if abs(state.v_command[i]) > AT_REST * min(limits.v_max[i], 1e3):
            standing = False
        z = qp.z_box[i]
        if faults.code[i] == HEALTHY and (
            (z > 0.0 and limits.upper_by[i] == BY_POSITION) or (z < 0.0 and limits.lower_by[i] == BY_POSITION)
        ):
            return True
    return standing


@jit
def base_verdict(K: Any, base: Any) -> int:
    """After the step: the set point moves on, and what the operator reads of the base."""
    chain, state, task, cascade = K.chain, K.state, K.task, K.cascade
    for i in range(chain.n):
        base.setpoint[i] += state.dt * state.v_command[i]
    held = cascade.status != OK and cascade.status != SCALED
    base.hold = 1 if held and base.freezes else 0
    if base.stale:
        base.leaning = 0
        return BASE_STALE
    if cascade.status == STOPPING or cascade.status == STOPPED or cascade.status == INVALID_INPUT:
        return BASE_HALTED
    off = task.position_error > base.tolerance or task.rotation_error * task.length > base.tolerance
    base.leaning = (
        base.leaning + 1 if held and off and _leans_or_stands(state, K.faults, K.limits, chain, K.qp) else 0
    )
    if is_rank_deficient(K.faults, task, K.qp, K.scratch, base.rank):
        return BASE_RANK_DEFICIENT
    if base.leaning >= PATIENCE:
        return BASE_UNREACHABLE
    return BASE_SATURATED if held else BASE_TRACKING
