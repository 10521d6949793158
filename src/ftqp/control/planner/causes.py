"""What keeps a step from doing all that its task asks for, read from the parts of the step."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ftqp.control.planner.certificate import Obstacle, Outside, Unreached
from ftqp.core.checks import FloatArray
from ftqp.kernel.layout.enums import (
    BRAKING,
    CALM_STAGE,
    FALLBACK,
    FREE,
    HEALTHY,
    LOCKED,
    VELOCITY,
    Limit,
)
from ftqp.kernel.layout.rows import COMPONENTS, TORQUE, constraint_owner
from ftqp.kernel.layout.thresholds import OUTSIDE_FROM, OUTSIDE_SIGMAS
from ftqp.model.posture import NEAR_SINGULAR

ACTIVE = 1e-9
"""A multiplier above this share of the largest counts as active."""
_LIMIT_NAMES = {limit: limit.name.lower() for limit in (Limit.ACCELERATION, Limit.VELOCITY, Limit.POSITION)}
LEAST_SHARE = 1e-3
"""A direction of which less is missing than this share of the largest is left out."""


def unreached(parts: Any, slack: FloatArray) -> list[Unreached]:
    """What is missing of the task, largest first.

    Args:
        parts: Those of a step.
        slack: What is missing in every row, (m,).
    """
    per = "/s" if int(parts["level"][0]) == VELOCITY else "/s2"
    names = [COMPONENTS[int(c)] for c in parts["components"][: len(slack)]]
    largest = float(np.abs(slack).max())
    found = [
        Unreached(direction=name, amount=float(s), unit=("rad" if name.startswith("r") else "m") + per)
        for name, s in zip(names, slack, strict=True)
        if abs(s) > LEAST_SHARE * largest
    ]
    return sorted(found, key=lambda entry: -abs(entry.amount))


def without_bound(parts: Any, jacobian: FloatArray, code: int) -> str:
    """What holds the arm back where no bound does, a key of ``WITHOUT_BOUND``.

    With J the Jacobian of the joints that work, angular rows times the length and all divided by it, and s
    what is missing, the arm is singular that way where ||J's|| is below 0.02 ||s||.

    Args:
        parts: Those of a step that misses its task.
        jacobian: J, (m, nv).
        code: The status as a number.
    """
    s = parts["slack"][: len(jacobian)]
    if np.linalg.norm(jacobian.T @ s) < NEAR_SINGULAR * np.linalg.norm(s):
        return "singular"
    if int(parts["stage"][0]) == CALM_STAGE:
        return "calm"
    return "no answer" if code == FALLBACK else "objective"


def outside(parts: Any, joints: Sequence[str]) -> list[Outside]:
    """Which limits were broken before the step, by whom, and by how much.

    A joint is beyond its range when its reference is, or when it is measured there, noise aside.
    """
    found = []
    room = OUTSIDE_FROM + OUTSIDE_SIGMAS * float(parts["sigma"][0])
    active = bool(parts["active"][0])
    for i, joint in enumerate(joints):
        unit = "m" if parts["prismatic"][i] else "rad"
        q, v, v_max = (float(parts[name][i]) for name in ("q_before", "v_before", "v_max"))
        seen = float(parts["q_measured"][i]) if active else q
        q_min, q_max = float(parts["q_min"][i]), float(parts["q_max"][i])
        for limit, d, measured in (
            ("upper position", q - q_max, seen - q_max),
            ("lower position", q_min - q, q_min - seen),
        ):
            if d > OUTSIDE_FROM or measured > room:
                found.append(Outside(joint=joint, limit=limit, amount=max(d, measured), unit=unit))
        if int(parts["code"][i]) == HEALTHY and abs(v) > v_max * (1.0 + OUTSIDE_FROM):
            side = "upper" if v > 0.0 else "lower"
            found.append(
                Outside(joint=joint, limit=f"{side} velocity", amount=abs(v) - v_max, unit=f"{unit}/s")
            )
    return found


def obstacles(parts: Any, joints: Sequence[str], has_inertia: bool) -> list[Obstacle]:
    """Which bounds and rows of C hold the command back, the one that matters most first."""
    found: list[tuple[str, str, float]] = []
    for i, joint in enumerate(joints):
        z = float(parts["z_box"][i])
        if int(parts["code"][i]) in (LOCKED, BRAKING):
            found.append((joint, "locked", abs(z)))
        elif z != 0.0:
            by = Limit(int(parts["upper_by"][i] if z > 0.0 else parts["lower_by"][i]))
            side = "upper" if z > 0.0 else "lower"
            found.append((joint, f"{side} {_LIMIT_NAMES.get(by, 'bound')}", abs(z)))
    for row in range(int(parts["nc"][0])):
        z = float(parts["z"][row])
        if z != 0.0:
            kind, i = constraint_owner(row, len(joints), has_inertia)
            free = kind is TORQUE and int(parts["code"][i]) == FREE
            name = "free-swinging" if free else f"{'upper' if z > 0.0 else 'lower'} {kind.name}"
            found.append((joints[i], name, abs(z)))
    largest = max((weight for _, _, weight in found), default=0.0)
    if largest == 0.0:
        return []
    order = {joint: k for k, joint in enumerate(joints)}
    found.sort(key=lambda entry: order[entry[0]])
    kept = [Obstacle(joint=j, limit=l, weight=w / largest) for j, l, w in found if w > ACTIVE * largest]
    return sorted(kept, key=lambda obstacle: -obstacle.weight)
