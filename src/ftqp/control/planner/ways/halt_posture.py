"""A posture near by where an arm can stand for long: far from limits, and its motors idle."""

from typing import Final

import numpy as np

from ftqp.control.inverse_kinematics.passable import Passable
from ftqp.core.checks import BoolArray, FloatArray

NEAR: Final = 0.6
"""A joint goes no farther than this to it [rad or m] ..."""
ROUNDS, SAMPLES, SHRINK = 4, 32, 0.5
"""... and it is the best of so many samples round the best one so far, in so many rounds, the next of which
is so much narrower. Guesses that tests/control/planner/ways/test_ways_out.py has not contradicted."""
BASE_SHARE, LIGHT = 0.25, 1.0
"""What the base bears, as a share of what it bears now, or of so many newton metres where that is less, is
a quarter of a torque limit's whole share. A convention."""
ROOM_SHARE: Final = 0.1
"""A joint with less than this share of its range to its nearer limit counts as near it: half of what a torque
limit's whole share counts, at the limit. A convention."""


def halt_posture(
    q: FloatArray, passable: Passable, working: BoolArray, low: FloatArray, high: FloatArray
) -> FloatArray:
    """The posture near q that needs the least of the motors and is away from limits, (nv,) [rad or m].

    effort(q) + 0.5 max(0, 1 - room(q)/0.1) + 0.25 moment(q)/moment(q now) is made small, with the largest
    share of a torque limit that holds the arm at rest, the least share of a range to a limit, and the torque
    that the base bears. The same arm gets the same posture.
    Source: docs/theory/ways-out.md.

    Args:
        q: Where the arm is, (nv,) [rad or m].
        passable: Where it may be.
        working: Joints that work, (nv,).
        low: Lower limits that are left, (nv,) [rad or m].
        high: Upper ones.
    """
    generator = np.random.default_rng(0)
    box_low, box_high = np.maximum(low, q - NEAR), np.minimum(high, q + NEAR)
    now = max(float(passable.base_moment(q[None])[0]), LIGHT)
    ranged = working & np.isfinite(low) & np.isfinite(high)

    def costs(places: FloatArray) -> FloatArray:
        room = np.minimum(places - low, high - places)[:, ranged] / (high - low)[ranged]
        near = np.maximum(0.0, 1.0 - room.min(axis=1, initial=1.0) / ROOM_SHARE)
        found: FloatArray = passable.effort(places) + 0.5 * near
        found += BASE_SHARE * passable.base_moment(places) / now
        found[passable.room(places) <= 0.0] = np.inf
        return found

    best, cost, width = q.copy(), float(costs(q[None])[0]), 1.0
    for _ in range(ROUNDS):
        places = best + width * NEAR * generator.uniform(-1.0, 1.0, (SAMPLES, len(q)))
        places = np.where(working, np.clip(places, box_low, box_high), q)
        found = costs(places)
        k = int(np.argmin(found))
        if found[k] < cost:
            best, cost = places[k], float(found[k])
        width *= SHRINK
    return best
