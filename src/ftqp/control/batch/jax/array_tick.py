"""The common ticks of many arms, one after the other: ``ftqp.kernel.lanes.common_tick`` as array code."""

from functools import partial
from typing import NamedTuple

from ftqp.control.batch.jax.array_bounds import braked_velocity, is_inside
from ftqp.control.batch.jax.array_calm import needs_no_calm
from ftqp.control.batch.jax.array_dynamics import torques
from ftqp.control.batch.jax.array_facts import Arm, Kind, Limits, State
from ftqp.control.batch.jax.array_kinematics import Posture, frames
from ftqp.control.batch.jax.array_qp import resolve
from ftqp.control.batch.jax.array_rows import Error, pose_error, rows
from ftqp.qp.dtrnn.jax.arrays import Array, jit, jnp, lax


class Ahead(NamedTuple):
    """The ticks to come, the same for every arm.

    Attributes:
        tick: Their numbers, (C,).
        target: Packed targets, (C, 29).
        usable: Whether a target can be followed, (C,).
        stands: Whether the target is where it was, (C,).
    """

    tick: Array
    target: Array
    usable: Array
    stands: Array


class Command(NamedTuple):
    """What the tick of each arm would be.

    Attributes:
        x: (B, n).
        a: The acceleration, (B, n).
        after: Velocity of the joints that are being locked, 0 for the others, (B, n).
        missed: Whether some of the task is left, (B,).
        error: Of the tip.
        good: Where this is the planner's tick, (B,).
    """

    x: Array
    a: Array
    after: Array
    missed: Array
    error: Error
    good: Array


def _keeps_torque(arm: Arm, limits: Limits, at: Posture, v: Array, a: Array) -> Array:
    """Where M a + h is within the torque limits of the joints that work, (B,)."""
    tau = torques(arm, at, v, a)
    return ((jnp.abs(tau) <= limits.tau_max) | (limits.works <= 0.0)).all(axis=1)


def common_tick(kind: Kind, arm: Arm, limits: Limits, state: State, target: Array) -> Command:
    """The command of the next ``dt``; where it is that of the planner's tick.

    Args:
        kind: What is compiled in.
        arm: The arm.
        limits: What each believes.
        state: Where each is.
        target: Packed, (29,).
    """
    at = frames(arm, state.q)
    error = pose_error(kind, arm, at, target)
    e, r = error.position, error.rotation
    good = state.inside & error.near & (e <= arm.tolerance) & (r <= arm.rotation_tolerance)
    if kind.stops:
        good = good & (e <= arm.stop_position) & (r <= arm.stop_rotation)
    own = rows(kind, arm, at, state, error, target)
    good = good & needs_no_calm(kind, arm, limits, at, state, error, own)
    after = braked_velocity(arm, limits, state)
    fixed = (after - state.lock_velocity) / arm.dt if kind.accelerates else after
    x, missed, solves = resolve(arm, own, limits.works, fixed)
    good = good & solves & is_inside(kind, arm, limits, state, x)
    a = x if kind.accelerates else (x - state.v) / arm.dt
    if kind.limits_torque:
        guarded = (jnp.abs(a) <= limits.guard * limits.a_max).all(axis=1)
        keeps = lax.cond(
            (good & ~guarded).any(),
            lambda: _keeps_torque(arm, limits, at, state.v, a),
            lambda: jnp.ones_like(guarded),
        )
        good = good & (guarded | keeps)
    return Command(x, a, after, missed, error, good)


def settled(
    kind: Kind, arm: Arm, limits: Limits, state: State, done: Command, good: Array, stands: Array
) -> State:
    """The command as the next state where ``good``, and what is remembered of the tick.

    Args:
        kind: What is compiled in.
        arm: The arm.
        limits: What each believes.
        state: Where each is.
        done: By ``common_tick``.
        good: (B,).
        stands: Whether the target is where it was.
    """
    x, dt, e, r = done.x, arm.dt, done.error.position, done.error.rotation
    way = state.v + 0.5 * dt * x if kind.accelerates else x
    after = state.v + dt * x if kind.accelerates else x
    after = jnp.where(limits.works > 0.0, after, done.after)
    all_joints = good[:, None]
    return State(
        q=jnp.where(all_joints, state.q + dt * way, state.q),
        v=jnp.where(all_joints, after, state.v),
        a_last=jnp.where(all_joints, done.a, state.a_last),
        lock_velocity=jnp.where(all_joints, done.after, state.lock_velocity),
        stood=jnp.where(good, jnp.where(stands, state.stood + dt, 0.0), state.stood),
        last_position_error=jnp.where(good, e, state.last_position_error),
        last_rotation_error=jnp.where(good, r, state.last_rotation_error),
        worst_position=jnp.where(good, jnp.maximum(state.worst_position, e), state.worst_position),
        worst_rotation=jnp.where(good, jnp.maximum(state.worst_rotation, r), state.worst_rotation),
        done=state.done + good,
        relaxed=state.relaxed + (good & done.missed),
        first_bad=jnp.where(good & done.missed & (state.first_bad < 0), state.tick, state.first_bad),
        tick=state.tick + good,
        inside=state.inside,
    )


@partial(jit, static_argnames="kind")
def ticks(
    arm: Arm, limits: Limits, state: State, ahead: Ahead, last: Array, kind: Kind
) -> tuple[State, Array]:
    """Common ticks of every arm until it needs another one, which is then the arm's next; kept q, (C, B, n).

    Args:
        arm: The arm.
        limits: What each believes.
        state: Where each is; those that are not inside stay where they are.
        ahead: The ticks to come.
        last: From this tick on nothing is done.
        kind: What is compiled in.
    """

    def tick(state: State, at: Ahead) -> tuple[State, Array]:
        goes_on = at.tick < last
        done = common_tick(kind, arm, limits, state, at.target)
        good = done.good & at.usable & (at.tick < limits.until) & goes_on
        state = settled(kind, arm, limits, state, done, good, at.stands)
        state = state._replace(inside=jnp.where(goes_on, good, state.inside))
        return state, state.q if kind.keeps else state.q[:0]

    end: tuple[State, Array] = lax.scan(tick, state, ahead)
    return end
