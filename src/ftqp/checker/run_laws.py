"""The laws that a run is held against, each from the truth and the model file alone."""

from collections.abc import Callable
from typing import Any

import numpy as np

from ftqp.checker.body_law import touched
from ftqp.checker.boundary_laws import cone, plane
from ftqp.checker.claim_laws import honesty, inside, obedience, tracking
from ftqp.checker.hold_law import held
from ftqp.checker.lock_law import failed
from ftqp.checker.model_file import ModelFile
from ftqp.checker.motion_laws import acceleration, braking, position, speed
from ftqp.checker.recovery_law import recovery
from ftqp.checker.shaking_laws import chatter, rest
from ftqp.checker.strictness import Strictness
from ftqp.checker.task_law import tasks
from ftqp.checker.torque_law import torque
from ftqp.checker.trace import Trace
from ftqp.core.checks import FloatArray


def finite(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """Infinite where a position or velocity, true or sent, is not finite, (K, nv)."""
    good = np.isfinite(run.sent_q) & np.isfinite(run.sent_v) & np.isfinite(run.q[1:]) & np.isfinite(run.v[1:])
    return np.where(good, 0.0, np.inf)


Law = Callable[[ModelFile, Trace, Strictness], Any]
LAWS: dict[str, tuple[Law, str]] = {
    "finite": (finite, "what was sent or done is not a number"),
    "speed": (speed, "faster than its limit, by this share"),
    "acceleration": (acceleration, "accelerated more than its limit, by this share"),
    "position": (position, "beyond the end of its range, by this [rad or m]"),
    "braking": (braking, "cannot brake any more before the end of its range, by this [rad or m]"),
    "plane": (plane, "a point that it moves is beyond its plane, by this [m]"),
    "cone": (cone, "an axis that it moves is outside its cone, by this [rad]"),
    "touched": (touched, "a body that it moves is nearer to another than it may be, by this [m]"),
    "torque": (torque, "carries more than its limit without need, by this share"),
    "failed": (failed, "is locked and has moved, or was sent to move, by this in all [rad or m]"),
    "honesty": (honesty, "OK was claimed although the tip is farther than the tolerance, by this share"),
    "tasks": (
        tasks,
        "OK was claimed although a further task that counts is farther than the tolerance, by this share",
    ),
    "tracking": (tracking, "the target can be followed and was not, by this share of the tolerance"),
    "recovery": (
        recovery,
        "the joints left can do the rest of the task and did not, by this share of the tolerance or path",
    ),
    "inside": (inside, "OK was claimed although a joint is outside its range, by this [rad or m]"),
    "obedience": (obedience, "OK was claimed although a joint is not where it was sent, by this [rad or m]"),
    "chatter": (chatter, "jolts at full acceleration, so many times in a row more than a correction does"),
    "held": (held, "was held with all others and leaps, by this share, or is blamed for it"),
    "rest": (rest, "the target rests and the joint swings, at this share of its speed limit"),
}
"""Laws by name: how much each is broken by, at which tick and joint, and what to say of it."""
