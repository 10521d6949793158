"""The task as equality rows A x = b: which rows of the pose, in which units, with which feedback."""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import (
    ACCELERATION,
    SCALE,
    TARGET_ACCELERATION,
    TARGET_TWIST,
)
from ftqp.kernel.layout.thresholds import SINGULAR_FROM
from ftqp.kernel.maths.elementary import select
from ftqp.kernel.maths.linear_systems import assign, plus_products
from ftqp.kernel.maths.side_by_side import WIDTH, lane_mask, load_lanes, store_lanes, sum_of
from ftqp.kernel.maths.svd import singular_directions
from ftqp.kernel.maths.vectors import Vector, inner, rotated, three_from
from ftqp.kernel.rows.joint_intervals import bound, draw

TIP_BRAKE_STEPS = 20.0
"""Scaled mode: scale 0 brakes the tip along its own direction with the time constant TIP_BRAKE_STEPS dt."""
SCALE_WEIGHT = 1e3
"""1 - s of a scale or a path rate costs SCALE_WEIGHT times the largest value of the objective, so that
progress goes before rates."""


@jit
def tool_axis(task: Any, kinematics: Any, a: int) -> Vector:
    """Axis ``a`` of the tool along W: R_tip R_axis e_a."""
    return rotated(kinematics.R_tip, (task.axis[a], task.axis[3 + a], task.axis[6 + a]))


@jit
def component_of(task: Any, kinematics: Any, component: int, offset: int, source: Any) -> float:
    """Component 0..5 of a six-vector along W; with tool rows the angular part along the tool's axes."""
    if component < 3 or not task.tool_rows:
        value: float = source[offset + component]
        return value
    return inner(tool_axis(task, kinematics, component - 3), three_from(source, offset + 3))


@part_jit
def task_rows(K: Any, kp: float) -> None:
    """Acceleration level: A = J, b = r'' - Jdot v + kv (r' - J v) + kp e.  Velocity level: b = r' + kp e.

    Angular rows are multiplied by the characteristic length, so that every row counts in metres. Scaled mode
    adds the path scale s as a variable: A x - s (b - b_0) = b_0, where s = 0 brakes the tip (velocity level:
    b_0 = 0).
    Source: Jin et al. 2017; scaling as in Flacco et al. 2012.
    """
    state, kinematics, task, qp = K.state, K.kinematics, K.task, K.qp
    n, m = K.chain.n, task.m
    for k in range(m):
        c = task.rows[k]
        w = task.row_scale[c]
        row = qp.A[k]
        if c < 3 or not task.tool_rows:
            J = kinematics.J[c]
            for at in range(0, n, WIDTH):
                store_lanes(row, at, w * load_lanes(J, at))
        else:
            t0, t1, t2 = tool_axis(task, kinematics, c - 3)
            J = kinematics.J
            for at in range(0, n, WIDTH):
                s = t0 * load_lanes(J[3], at) + t1 * load_lanes(J[4], at) + t2 * load_lanes(J[5], at)
                store_lanes(row, at, w * s)
        e = w * component_of(task, kinematics, c, 0, task.error)
        rate = w * component_of(task, kinematics, c, TARGET_TWIST, task.target)
        moving = drift = 0.0
        if state.level == ACCELERATION:
            moves = 0.0
            for at in range(0, n, WIDTH):
                moves = moves + load_lanes(row, at) * load_lanes(state.v, at)
            moving = sum_of(moves)
            drift = w * component_of(task, kinematics, c, 0, kinematics.drift)
            b = (
                w * component_of(task, kinematics, c, TARGET_ACCELERATION, task.target)
                + task.kv * (rate - moving)
                + kp * e
                - drift
            )
            rest = -drift - moving / (TIP_BRAKE_STEPS * state.dt)
        else:
            b = rate + kp * e
            rest = 0.0
        b += w * component_of(task, kinematics, c, 0, K.feedback.push)
        qp.b[k] = b
        if task.mode == SCALE:
            row[n] = rest - b
            qp.b[k] = rest
    qp.meq = m
    qp.nx = n
    task.beyond = 0.0


STIFFER = 1e-4
"""Compliance of rows that keep bodies apart, as a share of the task's: what the task asks for then moves them
by no more than this share of what it gives up."""


@jit
def softness(task: Any, terms: Any, chain: Any, qp: Any, ratio: float) -> float:
    """ratio |A|_F^2/(m tr H), the task's compliance as ``compliance`` gives it to the rows."""
    trace, norm = -terms.added, 0.0
    for i in range(chain.n):
        trace += qp.H[i, i] if qp.dense else qp.H_diagonal[i]
        norm = plus_products(norm, qp.A[:, i], qp.A[:, i], task.m)
    return ratio * norm / (task.m * trace) + 1e-300


@jit
def compliance(task: Any, terms: Any, chain: Any, qp: Any, turned: Any, ratio: float) -> None:
    """soft_k = yielding_k ratio |A|_F^2 / (m tr H): the slack's weight follows the QP's own magnitude."""
    trace = -terms.added
    if qp.dense:
        for i in range(chain.n):
            trace += qp.H[i, i]
    else:
        for at in range(0, chain.n, WIDTH):
            trace += sum_of(select(lane_mask(chain.n, at), load_lanes(qp.H_diagonal, at), 0.0))
    squares = 0.0
    for at in range(0, chain.n, WIDTH):
        inside = lane_mask(chain.n, at)
        for k in range(qp.meq):
            a = select(inside, load_lanes(qp.A[k], at), 0.0)
            squares = squares + a * a
    soft = ratio * sum_of(squares) / (max(qp.meq, 1) * trace) + 1e-300
    qp.soft_last = STIFFER * soft
    for k in range(qp.meq):
        qp.soft[k] = (
            soft + turned.softness[k] * chain.n / trace if turned.on else soft * task.yielding[task.rows[k]]
        )


@jit
def path_scale(state: Any, limits: Any, chain: Any, qp: Any) -> None:
    """The extra variable s in [0, 1] of the scaled mode, drawn to 1."""
    n = chain.n
    size = 0.0
    for i in range(n):
        reach = min(limits.a_max[i], 1e3) if state.level == ACCELERATION else min(limits.v_max[i], 1e3)
        size += (qp.H[i, i] if qp.dense else qp.H_diagonal[i]) * reach * reach
    weight = SCALE_WEIGHT * size
    for i in range(n):
        qp.H[i, n] = qp.H[n, i] = 0.0
    draw(qp, n, weight, 1.0)
    qp.H[n, n] = weight
    bound(qp, n, 0.0, 1.0)
    qp.nx = n + 1


SETTLING_FROM = 0.1
"""Singular value below which the task fades where a path is blocked; elsewhere SINGULAR_FROM."""
PATIENT_WITH = 2e-3
"""Error in characteristic lengths, along directions where the feedback has faded, at which a path waits."""


@jit
def _reduced_svd(faults: Any, task: Any, qp: Any, scratch: Any, turned: Any) -> None:
    """U and sigma of the task rows' columns of the working joints; diag(sigma) V' stays in scratch."""
    W = scratch.wide
    for column in range(faults.working):
        assign(W[:, column], qp.A[:, faults.order[column]], task.m)
    singular_directions(W, task.m, faults.working, turned.U, turned.sigma)


@jit
def fade_feedback(K: Any, path: Any) -> None:
    """Of a blocked path without settling the task loses 1 - (sigma_k/sigma_0)^2 along singular directions.

    A path that waits at a singularity leaves an error that no motion reduces, and the full feedback would
    swing the arm at its acceleration limits from one side of the singularity to the other. Settling brakes
    that; without it the arm may swing until the verdict. With settling and without, the path goes on no
    faster than the share of PATIENT_WITH lengths that the error along these directions leaves, so that no
    swing carries it off. The velocity feedback of the acceleration level stays whole.
    """
    task, turned, qp = K.task, K.turned, K.qp
    m, U = task.m, turned.U
    _reduced_svd(K.faults, task, qp, K.scratch, turned)
    lost, blocked = 0.0, path.limit == 0.0 and not K.settling.on
    for k in range(m):
        share = turned.sigma[k] / (task.length * (SETTLING_FROM if blocked else SINGULAR_FROM))
        if share < 1.0:
            along = plus_products(0.0, U[:, k], path.feedback, m)
            along *= 1.0 - share * share
            lost += along * along
            if blocked:
                for j in range(m):
                    qp.b[j] -= along * U[j, k]
    path.left = 1.0
    if lost > 0.0 and not blocked:
        path.left = max(0.0, 1.0 - sqrt(lost) / (task.kp * task.length * PATIENT_WITH))


@part_jit
def turn_rows(K: Any) -> None:
    """U'A x + s = U'b, U of the reduced Jacobian A_f = U diag(sigma) V' of the working joints.

    Row k below the threshold sigma_0 gets the compliance

        softness_k = (length factor (1 - (sigma_k/(length sigma_0))^2))^2

    in units of H, a row above it none. With H = I and no bound in the way the solution is
    x = sum_k sigma_k/(sigma_k^2 + softness_k) v_k u_k'b: each singular direction is damped by itself, and the
    others are followed exactly.
    Source: variable damping of Nakamura and Hanafusa 1986 and numerical filtering of Maciejewski and Klein
    1988, here as compliance of turned rows, so that bounds, torque rows and objective stay those of the QP;
    docs/theory/singularities.md, "Directional damping".
    """
    chain, task, turned, qp, scratch = K.chain, K.task, K.turned, K.qp, K.scratch
    n, m = chain.n, task.m
    U = turned.U
    _reduced_svd(K.faults, task, qp, scratch, turned)
    for i in range(n):
        for k in range(m):
            scratch.rows[k] = plus_products(0.0, U[:, k], qp.A[:, i], m)
        assign(qp.A[:, i], scratch.rows, m)
    for k in range(m):
        scratch.rows[k] = plus_products(0.0, U[:, k], qp.b, m)
    for k in range(m):
        qp.b[k] = scratch.rows[k]
        share = turned.sigma[k] / (task.length * turned.threshold)
        rest = 1.0 - share * share
        turned.softness[k] = (task.length * turned.factor * rest) ** 2 if share < 1.0 else 0.0
    turned.on = 1


@jit
def turn_back(task: Any, scratch: Any, turned: Any) -> None:
    """The slack along the rows of the task, from that along the singular directions."""
    m = task.m
    for k in range(m):
        scratch.rows[k] = plus_products(0.0, turned.U[k], task.slack, m)
    assign(task.slack, scratch.rows, m)
