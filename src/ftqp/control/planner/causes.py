"""What keeps a step from doing all that its task asks for, read from the parts of the step."""

from collections.abc import Sequence
from typing import Any

from ftqp.control.planner.certificate import Obstacle, Outside
from ftqp.kernel.layout.enums import BRAKING, FREE, HEALTHY, LOCKED, Limit
from ftqp.kernel.layout.rows import TORQUE, constraint_owner
from ftqp.kernel.layout.thresholds import OUTSIDE_FROM, OUTSIDE_SIGMAS

ACTIVE = 1e-9
"""A multiplier above this share of the largest counts as active."""
_LIMIT_NAMES = {limit: limit.name.lower() for limit in (Limit.ACCELERATION, Limit.VELOCITY, Limit.POSITION)}


def outside(parts: Any, joints: Sequence[str]) -> list[Outside]:
    """Which limits were broken before the step, by whom, and by how much.

    A joint is beyond its range when its reference is, or when it is measured there, noise aside.
    """
    found = []
    room = OUTSIDE_FROM + OUTSIDE_SIGMAS * float(parts["sigma"][0])
    active = bool(parts["active"][0])
    for i, joint in enumerate(joints):
        q, v, v_max = (float(parts[name][i]) for name in ("q_before", "v_before", "v_max"))
        seen = float(parts["q_measured"][i]) if active else q
        q_min, q_max = float(parts["q_min"][i]), float(parts["q_max"][i])
        for limit, d, measured in (
            ("upper position", q - q_max, seen - q_max),
            ("lower position", q_min - q, q_min - seen),
        ):
            if d > OUTSIDE_FROM or measured > room:
                found.append(Outside(joint=joint, limit=limit, amount=max(d, measured)))
        if int(parts["code"][i]) == HEALTHY and abs(v) > v_max * (1.0 + OUTSIDE_FROM):
            side = "upper" if v > 0.0 else "lower"
            found.append(Outside(joint=joint, limit=f"{side} velocity", amount=abs(v) - v_max))
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
