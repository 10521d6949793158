"""What a planner was made with, written into its session once, and into its orders."""

import numpy as np

from ftqp.control.drive.joint_drive import BRAKES, KINDS, Drive, Noise
from ftqp.control.planner.degrading import allow
from ftqp.control.planner.free_joint import KEPT_OF
from ftqp.control.planner.qp_solver import Solver
from ftqp.control.planner.settings import LEVELS, Settings
from ftqp.control.task.bounds import Bounds, Jin
from ftqp.control.task.task import (
    MODES,
    PRIORITIES,
    EmergencyStop,
    Task,
    axis_frame,
    checked_gains,
    row_indices,
)
from ftqp.kernel.entry.orders import LIMITS, Orders
from ftqp.kernel.entry.session import ArmSession, Session
from ftqp.kernel.layout.criteria import COEFFICIENTS, Criterion
from ftqp.kernel.layout.enums import HISTORY
from ftqp.kernel.layout.record import load_chain
from ftqp.kernel.layout.rows import CLEARANCE, NOTHING_ASKED, Asked, constraint_owners
from ftqp.model.robot import Robot

PATIENCE = 0.1
"""Time [s] of fallback commands in a row after which the arm is stopped."""
STOP_RISE = 0.05
"""A stop brings the deceleration up to the acceleration limit within this time [s]. So that a stop ends at
rest without a step of the acceleration, which makes servos overshoot (docs/theory/feedback.md, "Stops")."""
REMEMBERED = 1.05
"""How long given targets are kept [s]. LATEST, after which the arm is stopped, and 50 ms, so that the oldest
one is still there."""
TOLERANCE = 1e-10
"""Largest violation of a bound that the active set counts as none. Some million units of rounding."""
ACCEPT = 1e-6
"""Largest scaled residual of a QP that counts as solved."""


def filled(
    robot: Robot,
    task: Task,
    criterion: Criterion,
    bounds: Bounds,
    emergency: EmergencyStop | None,
    *,
    level: str,
    dt: float,
    drive: Drive = Drive(),  # noqa: B008  frozen
    noise: Noise = Noise(),  # noqa: B008  frozen
    asked: Asked = NOTHING_ASKED,
) -> Session:
    """The session of a healthy robot; what is believed of its joints is another's to write."""
    session = Session(robot.nv)
    K = session.K
    load_chain(K, **robot.chain.constants())
    K.state.dt, K.state.level = dt, LEVELS[level]
    rows = row_indices(robot.default_rows if task.rows is None else task.rows)
    length = robot.length if task.length is None else task.length
    t = K.task
    t.kp, t.kv = checked_gains(task, level, dt)
    t.mode, t.slack_ratio, t.length = MODES[task.mode], task.slack, length
    t.m = len(rows)
    t.rows[: len(rows)] = rows
    t.row_scale[:] = 1.0, 1.0, 1.0, length, length, length
    t.yielding[:] = PRIORITIES[task.priority]
    t.uses_rotation = rows[-1] >= 3
    t.tool_rows = task.rows == "position_axis"
    t.axis[:] = axis_frame(task.axis).ravel()
    K.calm.on = task.calm
    if task.damping is not None:
        K.turned.threshold, K.turned.factor = task.damping.threshold, task.damping.factor
    for name in COEFFICIENTS:
        setattr(K.criteria, name, getattr(criterion, name))
    K.criteria.weight[:] = 1.0
    K.limits.conversion = bounds.code
    if isinstance(bounds, Jin):
        K.limits.jin_p, K.limits.jin_v = bounds.gamma_p, bounds.gamma_v
        K.limits.jin_margin, K.limits.jin_upsilon = bounds.margin, bounds.upsilon
    watch = K.watch
    watch.stop_position = watch.stop_rotation = np.inf
    if emergency is not None:
        watch.stop_position, watch.stop_rotation = emergency.position, emergency.rotation
        watch.stop_samples = emergency.samples
    watch.rise = STOP_RISE
    watch.fallback_limit = max(1, round(PATIENCE / dt))
    K.qp.tolerance, K.qp.max_iterations = TOLERANCE, 50 * (robot.nv + 10)
    K.cascade.accept = ACCEPT
    feedback = K.feedback
    feedback.kind, feedback.latency = KINDS[drive.kind], drive.ticks(dt)
    a_max = float(np.min(robot.limits.a_max))
    paces = drive.paces(dt, noise, 6.0 * robot.length, a_max)
    K.learned.by_delay[: len(paces)] = paces
    feedback.span = feedback.latency + 1 + max(len(paces), 1)
    feedback.brakes = BRAKES[drive.brakes]
    feedback.stride = int(REMEMBERED / ((HISTORY - 2) * dt)) + 1
    feedback.speed = 1.0
    feedback.tolerance, feedback.rotation_tolerance = task.tolerance, task.rotation_tolerance
    gains = drive.gains(dt, noise, 6.0 * robot.length, a_max)
    K.gate.lead = gains.pop("lead")
    for name, value in gains.items():
        setattr(feedback, name, value)
    for name, value in drive.learning(dt, noise).items():
        setattr(K.learned, name, value)
    K.keeps.asked = sum(len(names) for kind, names in asked.items() if kind != CLEARANCE.name)
    K.cascade.p = len(constraint_owners(robot.joints, robot.has_inertia, asked))
    return session


def orders_of(session: Session, arm: ArmSession, given: Settings, solver: Solver) -> Orders:
    """The orders of a planner."""
    K, robot, kept = session.K, given.robot, given.task.kept_sets
    fewer = kept if solver.sizes_may_change else ()
    allow(K, fewer, given.dt, asked=given.task.degrade is not None)
    facts = {
        **{name: getattr(robot.limits, name) for name in LIMITS},
        "coulomb": robot.coulomb,
        "torque_limits": int(given.limits_torque),
        "dynamic": int(given.dynamic),
        "on_demand": int(given.on_demand),
        "external": int(K.cascade.external),
        "rich": int(solver.rich),
        "may_swing": int(
            robot.has_inertia and robot.is_serial and not robot.chain.floating and solver.has_qp
        ),
        "allowed": sum(1 << KEPT_OF[name] for name in kept),
    }
    if given.posture is not None:
        facts |= {"has_posture": 1, "posture": given.posture}
    return Orders(session, arm, facts)
