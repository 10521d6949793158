"""A posture near by where an arm can stand for long: far from limits, and its motors idle."""

from typing import Final

import numpy as np

from ftqp.control.inverse_kinematics.passable import Passable
from ftqp.control.planner.planner_view import JointState, PlannerView
from ftqp.control.references.jerk_limit import RISE_TIME, Motion, State
from ftqp.core.checks import FloatArray
from ftqp.model.robot import Robot

NEAR: Final = 0.6
"""A joint goes no farther than this to it [rad or m] ..."""
ROUNDS, SAMPLES, SHRINK = 4, 32, 0.5
"""... and it is the best of so many samples round the best one so far, in so many rounds, the next of which
is so much narrower."""
BASE_SHARE: Final = 0.25
"""What the base bears on the way there, as a share of what it bears where the arm brakes on the spot, is a
quarter of a torque limit's whole share. A convention."""
LEAST_BORNE: Final = np.array([10.0, 1.0])
"""The force and torque [N, N m] below which that share is not told apart: a kilogram's. A convention."""
CHOICE: Final = 6
"""For so many of the postures that need least, and are clear, the way there is looked at ..."""
ON_THE_WAY: Final = 12
"""... in so many places."""
ROOM_SHARE: Final = 0.1
"""A joint with less than this share of its range to its nearer limit counts as near it: half of what a torque
limit's whole share counts, at the limit. A convention."""


def halt_posture(
    start: JointState, stand: FloatArray, passable: Passable, view: PlannerView, robot: Robot
) -> FloatArray:
    """The posture near by that needs the least of the motors and the base and is away from limits, (nv,).

    effort(q) + 0.5 max(0, 1 - room(q)/0.1) + 0.125 (force/force_0 + torque/torque_0) is made small, with the
    largest share of a torque limit that holds the arm at rest, the least share of a range to a limit, and
    the largest force and torque that the base bears on the way there, beside those of braking on the spot.
    The same arm gets the same posture.
    Source: docs/theory/ways-out.md; Chen 2020.

    Args:
        start: Where the arm is, and how fast.
        stand: Where it would stand if it braked, (nv,) [rad or m].
        passable: Where it may be.
        view: The planner's.
        robot: The arm.
    """
    generator = np.random.default_rng(0)
    working, low, high = view.working, view.limits.q_min, view.limits.q_max
    box_low, box_high = np.maximum(low, stand - NEAR), np.minimum(high, stand + NEAR)
    ranged = working & np.isfinite(low) & np.isfinite(high)

    def costs(places: FloatArray) -> FloatArray:
        room = np.minimum(places - low, high - places)[:, ranged] / (high - low)[ranged]
        near = np.maximum(0.0, 1.0 - room.min(axis=1, initial=1.0) / ROOM_SHARE)
        found: FloatArray = passable.effort(places) + 0.5 * near
        found[passable.room(places) <= 0.0] = np.inf
        return found

    seen, cost, width = stand[None], costs(stand[None]), 1.0
    for _ in range(ROUNDS):
        places = seen[np.argmin(cost)] + width * NEAR * generator.uniform(-1.0, 1.0, (SAMPLES, len(stand)))
        places = np.where(working, np.clip(places, box_low, box_high), stand)
        seen, cost = np.vstack([seen, places]), np.append(cost, costs(places))
        width *= SHRINK
    first = _borne(start, stand, passable, view, robot)
    chosen = [0, *(int(k) for k in np.argsort(cost[1:], kind="stable")[:CHOICE] + 1)]
    for k in chosen:
        borne = _borne(start, seen[k], passable, view, robot) if k else first
        cost[k] += 0.5 * BASE_SHARE * float((borne / np.maximum(first, LEAST_BORNE)).sum())
    best: FloatArray = seen[min(chosen, key=lambda k: cost[k])]
    return best


def _borne(
    start: JointState, end: FloatArray, passable: Passable, view: PlannerView, robot: Robot
) -> FloatArray:
    """The largest force and torque that the base bears on the way to a posture, (2,) [N, N m]."""
    working, limits = view.working, view.limits
    jerk = np.minimum(robot.limits.a_max / RISE_TIME, robot.limits.j_max)
    now = State(*(part[working] for part in start))
    motion = Motion(int(working.sum())) if working.any() else None
    rows = np.tile(np.array([start.q, 0.0 * start.v, 0.0 * start.v]), (ON_THE_WAY, 1, 1))
    if motion is not None:
        motion.plan(now, end[working], limits.v[working], limits.a[working], jerk[working])
        for row, t in zip(rows, np.linspace(0.0, motion.duration, ON_THE_WAY), strict=True):
            row[:, working] = motion.at(float(t))
    borne: FloatArray = passable.base_wrenches(*rows.transpose(1, 0, 2)).max(axis=0)
    return borne
