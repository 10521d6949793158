"""What the arms of a batch have in common, read from the planner's record."""

from typing import Any, NamedTuple, Self

import numpy as np

from ftqp.kernel.layout.enums import ACCELERATION, HARD
from ftqp.qp.dtrnn.jax.arrays import Array, jnp


class Kind(NamedTuple):
    """What is compiled in.

    Attributes:
        accelerates: Whether x is the acceleration, else the velocity.
        rows: Components of the pose that are the task's rows.
        hard: Whether the rows are hard, else soft.
        turns: Whether the task has rotation rows.
        points: Whether they are those of the tool axis.
        calms: Whether the planner brings the arm to rest where the error bends more than the rows can hold.
        postures: Whether the objective draws to a posture.
        stops: Whether a large error may stop the arm.
        limits_torque: Whether torque limits are kept.
        keeps: Whether q after every tick is wanted.
    """

    accelerates: bool
    rows: tuple[int, ...]
    hard: bool
    turns: bool
    points: bool
    calms: bool
    postures: bool
    stops: bool
    limits_torque: bool
    keeps: bool

    @classmethod
    def of(cls, K: Any, keeps: bool) -> Self:
        """Of a planner's record."""
        task = K.task
        return cls(
            accelerates=int(K.state.level) == ACCELERATION,
            rows=tuple(int(c) for c in task.rows[: task.m]),
            hard=int(task.mode) == HARD,
            turns=bool(task.uses_rotation),
            points=bool(task.tool_rows),
            calms=bool(K.calm.on) and float(task.kp) != 0.0,
            postures=float(K.criteria.norm_q) != 0.0,
            stops=int(K.watch.stop_samples) > 0,
            limits_torque=bool(K.limits.dynamic),
            keeps=keeps,
        )


class Arm(NamedTuple):
    """The constants of the arm, its task and its scheme; see ``ftqp.kernel.layout.rooms`` for their meaning.

    Attributes:
        dt: [s].
        rotation: Of each joint's frame in its predecessor's at q = 0, (n, 3, 3).
        translation: (n, 3) [m].
        prismatic: Which joints slide, (n,).
        continuous: Which joints turn without end, (n,).
        tip_rotation: (3, 3).
        tip_translation: (3,) [m].
        gravity: (3,) [m/s2].
        mass: (n,) [kg].
        com: (n, 3) [m].
        inertia: About the com, (n, 3, 3) [kg m2].
        armature: (n,).
        viscous: (n,).
        row_scale: 1 or the characteristic length of each component, (6,).
        yielding: Compliance of each component beside that of the task as a whole, (6,).
        axis: Rotation whose z is the tool axis, in the tip frame, (3, 3).
        kp, kv: Gains.
        length: Characteristic length [m].
        slack_ratio: Compliance of the rows.
        norm, norm_v, norm_q: Coefficients of the objective.
        weight: Of each joint, (n,).
        posture: (n,).
        accept: Largest scaled residual that counts as solved.
        tolerance, rotation_tolerance: Beyond these the arm has something to say.
        stop_position, stop_rotation: Beyond these it may be stopped.
    """

    dt: Array
    rotation: Array
    translation: Array
    prismatic: Array
    continuous: Array
    tip_rotation: Array
    tip_translation: Array
    gravity: Array
    mass: Array
    com: Array
    inertia: Array
    armature: Array
    viscous: Array
    row_scale: Array
    yielding: Array
    axis: Array
    kp: Array
    kv: Array
    length: Array
    slack_ratio: Array
    norm: Array
    norm_v: Array
    norm_q: Array
    weight: Array
    posture: Array
    accept: Array
    tolerance: Array
    rotation_tolerance: Array
    stop_position: Array
    stop_rotation: Array

    @classmethod
    def of(cls, K: Any) -> Self:
        """Of a planner's record."""
        chain, task, criteria, watch, n = K.chain, K.task, K.criteria, K.watch, int(K.chain.n)
        inertia = np.empty((n, 3, 3))
        upper = np.triu_indices(3)
        inertia[:, upper[0], upper[1]] = inertia[:, upper[1], upper[0]] = chain.inertia[:n]
        given: dict[str, Any] = {
            "dt": K.state.dt,
            "rotation": chain.rotation[:n].reshape(n, 3, 3),
            "prismatic": chain.prismatic[:n] != 0,
            "continuous": chain.continuous[:n] != 0,
            "tip_rotation": chain.tip_rotation.reshape(3, 3),
            "tip_translation": chain.tip_translation,
            "gravity": chain.gravity,
            "inertia": inertia,
            "axis": task.axis.reshape(3, 3),
            "accept": K.ladder.accept,
            "tolerance": K.feedback.tolerance,
            "rotation_tolerance": K.feedback.rotation_tolerance,
            "stop_position": watch.stop_position,
            "stop_rotation": watch.stop_rotation,
        }
        for name in ("translation", "mass", "com", "armature", "viscous"):
            given[name] = chain[name][:n]
        for name in ("row_scale", "yielding", "kp", "kv", "length", "slack_ratio"):
            given[name] = task[name]
        for name in ("norm", "norm_v", "norm_q"):
            given[name] = criteria[name]
        for name in ("weight", "posture"):
            given[name] = criteria[name][:n]
        return cls(**{name: jnp.asarray(value) for name, value in given.items()})


class Limits(NamedTuple):
    """What each arm believes, which is the same for a stretch of ticks.

    Attributes:
        works: 1 for a joint that works, 0 for one that is locked or being locked, (B, n).
        lock_rate: Deceleration of a joint that is being locked, (B, n).
        q_min, q_max, v_max, a_max, a_brake, tau_max: As believed, (B, n).
        guard: Share of a_max up to which torque limits hold without being checked, (B, 1).
        until: Tick of the arm's next fault, (B,).
    """

    works: Array
    lock_rate: Array
    q_min: Array
    q_max: Array
    v_max: Array
    a_max: Array
    a_brake: Array
    tau_max: Array
    guard: Array
    until: Array


class State(NamedTuple):
    """Where each arm is.

    Attributes:
        q, v: Position and velocity, (B, n).
        a_last: Acceleration of the last tick, (B, n).
        lock_velocity: Velocity of the joints that are being locked, (B, n).
        stood: How long the target has stood, (B,) [s].
        last_position_error, last_rotation_error: Of the last tick, (B,) [m], [rad].
        worst_position, worst_rotation: The largest so far, (B,) [m], [rad].
        done: Ticks that were common ones, (B,).
        relaxed: Those of them that left some of the task, (B,).
        first_bad: The first of those, (B,); -1 while there is none.
        tick: The arm's next tick, (B,).
        inside: Whether all its ticks so far were common ones, (B,).
    """

    q: Array
    v: Array
    a_last: Array
    lock_velocity: Array
    stood: Array
    last_position_error: Array
    last_rotation_error: Array
    worst_position: Array
    worst_rotation: Array
    done: Array
    relaxed: Array
    first_bad: Array
    tick: Array
    inside: Array
