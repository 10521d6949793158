"""Certificate: why a task cannot be followed exactly, in the words of the robot, read from a step."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ftqp.control.planner.step_parts import StepLabels
from ftqp.core.checks import FloatArray
from ftqp.kernel.layout.enums import (
    BRAKING,
    FALLBACK,
    FREE,
    HEALTHY,
    LOCKED,
    MEASURED,
    SETTLING_ELASTIC_STAGE,
    SETTLING_STAGE,
    VELOCITY,
    Limit,
)
from ftqp.kernel.layout.rows import (
    CLEARANCE,
    CLEARANCES,
    COMPONENTS,
    HOLD,
    KEEP,
    NOTHING_ASKED,
    OWN_ROW,
    TORQUE,
    Asked,
    constraint_owners,
)
from ftqp.kernel.layout.thresholds import NEARER, NOISE_LEVELS, OUTSIDE_FROM, TASK_FLOOR
from ftqp.model.posture import NEAR_SINGULAR

WITHOUT_BOUND = {
    "singular": "the arm cannot move that way (singular)",
    "calm": "no limit, but the damping with which the arm comes to rest (calm)",
    "no answer": "no limit, but a solver without a usable answer",
    "objective": "no limit, but the scheme and the softness of the task",
    "": "nothing",
}
"""What holds an arm back where no bound does, in words."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Unreached:
    """A direction of the task and how much of it is missing.

    Attributes:
        direction: One of x, y, z, rx, ry, rz, along W (along the tool for ``position_axis``).
        amount: The motion minus what the task asks for, in its unit.
        unit: m/s2 or rad/s2; at the velocity level m/s or rad/s.
    """

    direction: str
    amount: float
    unit: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """A bound that stands in the way.

    Attributes:
        joint: The joint's name, that of what ``ftqp.Keep`` keeps, or those of two bodies.
        limit: Which bound it is: ``upper position``, ``lower velocity``, ``upper torque``, ``locked``,
            ``its boundary`` and the like.
        weight: How much it stands in the way, 0 to 1 without unit: its multiplier over the largest one.
    """

    joint: str
    limit: str
    weight: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Outside:
    """A limit that a joint does not keep as it is measured or believed.

    Attributes:
        joint: The joint's name.
        limit: Which limit it is: ``upper position``, ``lower position``, ``upper velocity`` or
            ``lower velocity``; of a failed joint the ends of its healthy range.
        amount: By how much the joint is beyond it, > 0, in its unit.
        unit: rad or rad/s; of a joint that slides m or m/s.
    """

    joint: str
    limit: str
    amount: float
    unit: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Certificate:
    """Which task directions cannot be kept, by how much, and which bounds stand in the way.

    At the best feasible command the residual s = A x - b and the multipliers z of the active bounds satisfy
    A's + z = 0 up to the objective: moving along -s would need one of those bounds to give.

    Attributes:
        unreached: The directions with their missing amounts, largest first.
        obstacles: The active bounds, heaviest first.
        outside: The limits that joints do not keep, in the order of the joints.
        jump: The share of an instant lock's velocity jump that the other joints have made, 0 to 1; less than
            1 where the whole of it would break a speed limit or leave no room to stop.
        without_bound: What holds the arm back where no bound does: ``singular``, which is said where the
            joints that work can hardly move the end effector the way that is missing; ``calm``, the damping
            with which an arm comes to rest; ``no answer`` of a solver; ``objective``, which outweighs a soft
            task. Empty where a bound does, or nothing is missing.
        instead: What else makes the step RELAXED, in sentences: what is done next to a joint that swings
            freely, rows of the task that were given up, torques beyond their limits.
    """

    unreached: tuple[Unreached, ...]
    obstacles: tuple[Obstacle, ...]
    outside: tuple[Outside, ...] = ()
    jump: float = 1.0
    without_bound: str = ""
    instead: tuple[str, ...] = ()

    def __str__(self) -> str:
        missing = ", ".join(f"{u.direction} by {u.amount:+.3g} {u.unit}" for u in self.unreached)
        bounds = ", ".join(f"{o.joint} at {o.limit}" for o in self.obstacles)
        because = bounds or WITHOUT_BOUND[self.without_bound]
        beyond = ", ".join(f"{o.joint} beyond {o.limit} by {o.amount:.3g} {o.unit}" for o in self.outside)
        silent = not self.unreached and (beyond or self.instead)
        held = (
            f"the task misses {missing}; in the way: "
            if missing
            else "the motion of the joints is held back by "
        )
        said = [] if silent else [held + because]
        said += self.instead
        said += [f"outside: {beyond}"] if beyond else []
        said += [f"{self.jump:.0%} of the jump at the lock was made"] if self.jump < 1.0 else []
        return "; ".join(said)


HELD = "its task on level 0"
"""What holds a frame whose task goes before that of the tip."""
NEAR = "their clearance"
"""What holds two bodies that are kept apart."""
BY = {KEEP: "its boundary", HOLD: HELD, OWN_ROW: "its row", CLEARANCE: NEAR}
"""What holds back, by the kind of row: a point or axis, a frame, a row of one's own, or two bodies."""
ACTIVE = 1e-9
"""A multiplier above this share of the largest counts as active."""
_LIMIT_NAMES = {limit: limit.name.lower() for limit in (Limit.ACCELERATION, Limit.VELOCITY, Limit.POSITION)}
LEAST_SHARE = 1e-3
"""A direction of which less is missing than this share of the largest is left out."""


def unreached(parts: Any, slack: FloatArray) -> list[Unreached]:
    """What is missing of the task, largest first."""
    per = "/s" if int(parts["level"][0]) == VELOCITY else "/s2"
    names = [COMPONENTS[int(c)] for c in parts["components"][: len(slack)]]
    largest = float(np.abs(slack).max())
    found = [
        Unreached(direction=name, amount=float(s), unit=("rad" if name.startswith("r") else "m") + per)
        for name, s in zip(names, slack, strict=True)
        if abs(s) > LEAST_SHARE * largest
    ]
    return sorted(found, key=lambda entry: -abs(entry.amount))


def missed_tasks(parts: Any, named: StepLabels) -> tuple[str, ...]:
    """Which further tasks that the status speaks of the command misses, and by how much, in sentences."""
    if not parts["soft_missed"][0]:
        return ()
    per = "m/s" if int(parts["level"][0]) == VELOCITY else "m/s2"
    amounts = {name: float(np.abs(named.slack(name, parts["soft_slack"])).max()) for name in named.required}
    return tuple(
        f"the task {name!r} is missed by {amount:.3g} {per}"
        for name, amount in sorted(amounts.items(), key=lambda one: -one[1])
        if amount > TASK_FLOOR
    )


def without_bound(parts: Any, jacobian: FloatArray, code: int) -> str:
    """What holds the arm back where no bound does, a key of ``WITHOUT_BOUND``.

    With J the Jacobian of the joints that work, angular rows times the length and all divided by it, and s
    what is missing, the arm is singular that way where ||J's|| is below 0.02 ||s||.
    """
    s = parts["slack"][: len(jacobian)]
    if np.linalg.norm(jacobian.T @ s) < NEAR_SINGULAR * np.linalg.norm(s):
        return "singular"
    if int(parts["stage"][0]) in (SETTLING_STAGE, SETTLING_ELASTIC_STAGE):
        return "calm"
    return "no answer" if code == FALLBACK else "objective"


def too_near(parts: Any, nearest: tuple[str, str] | None) -> tuple[str, ...]:
    """Which bodies are nearer to each other than they are to be kept, and whether all are watched."""
    distance, keep = float(parts["distance"][0]), float(parts["keep"][0])
    if nearest is None:
        return ()
    crowd = f"more than {CLEARANCES} points of bodies are near, and those that are farthest are not watched"
    crowded = (crowd,) if parts["crowded"][0] else ()
    if not distance < keep - NEARER:
        return crowded
    apart = (
        f"{1e3 * distance:.1f} mm apart" if distance > 0.0 else f"{-1e3 * distance:.1f} mm into each other"
    )
    return (
        f"{nearest[0]} and {nearest[1]} are {apart}, and are to be kept {1e3 * keep:.0f} mm apart",
        *crowded,
    )


def instead(parts: Any, beside_free: str | None, excess: float) -> tuple[str, ...]:
    """What makes a step RELAXED beside directions that are missed and limits that joints do not keep."""
    said = [] if beside_free is None else [beside_free]
    if parts["given_up"][0]:
        kept = ", ".join(COMPONENTS[int(c)] for c in parts["components"][: int(parts["m"][0])])
        said.append(f"rows of the task were given up, {kept} are kept")
    if excess > 0.0:
        unit = "N m or N" if parts["prismatic"].any() else "N m"
        said.append(f"torques exceed their limits by up to {excess:.3g} {unit}")
    return tuple(said)


def unused(parts: Any, joints: Sequence[str]) -> str:
    """Which input of a step is not used."""
    bad = [k for k in range(len(joints)) if parts["bad"][k]] if parts["active"][0] else []
    if not bad:
        return (
            "the target or a measurement is not used: it is not finite, or its pose has no rotation matrix; "
            "what is given must be numbers"
        )
    units = ["m" if parts["prismatic"][k] else "rad" for k in range(len(joints))]
    expected = ", ".join(
        f"{joints[k]} (expected near {float(parts['q_measured'][k]):.4g} {units[k]})" for k in bad
    )
    return (
        f"what was measured of {expected} cannot be true and is not used; look for degrees, another order of "
        "the joints, or a broken encoder"
    )


def outside(parts: Any, joints: Sequence[str]) -> list[Outside]:
    """Which limits were broken before the step, by whom, and by how much."""
    found = []
    room = OUTSIDE_FROM + NOISE_LEVELS * float(parts["sigma"][0])
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


def obstacles(
    parts: Any,
    joints: Sequence[str],
    has_inertia: bool,
    asked: Asked = NOTHING_ASKED,
    pairs: Sequence[tuple[str, str]] = (),
) -> list[Obstacle]:
    """Which bounds and rows of C hold the command back, the one that matters most first."""
    found: list[tuple[str, str, float]] = []
    for i, joint in enumerate(joints):
        z = float(parts["z_box"][i])
        if int(parts["code"][i]) in (LOCKED, BRAKING):
            found.append((joint, "locked", abs(z)))
        elif int(parts["code"][i]) == MEASURED:
            found.append((joint, "free-swinging", abs(z)))
        elif z != 0.0:
            by = Limit(int(parts["upper_by"][i] if z > 0.0 else parts["lower_by"][i]))
            side = "upper" if z > 0.0 else "lower"
            found.append((joint, f"{side} {_LIMIT_NAMES.get(by, 'bound')}", abs(z)))
    owners = constraint_owners(joints, has_inertia, asked)
    for row in range(int(parts["nc"][0])):
        z = float(parts["z"][row])
        if z != 0.0:
            kind, i, name = owners[row]
            if kind is CLEARANCE and 0 <= int(parts["slot"][i]) < len(pairs):
                name = " and ".join(pairs[int(parts["slot"][i])])
            if kind in BY:
                found.append((name, BY[kind], abs(z)))
                continue
            free = kind is TORQUE and int(parts["code"][i]) == FREE
            by_joint = "free-swinging" if free else f"{'upper' if z > 0.0 else 'lower'} {kind.name}"
            found.append((name, by_joint, abs(z)))
    largest = max((weight for _, _, weight in found), default=0.0)
    if largest == 0.0:
        return []
    order = {of: k for k, of in enumerate((*joints, *(name for kind, _, name in owners if kind.most)))}
    found.sort(key=lambda entry: order.get(entry[0], len(order)))
    kept: dict[tuple[str, str], Obstacle] = {}
    for joint, limit, weight in found:  # several points of two bodies may have a row each
        if weight > ACTIVE * largest:
            one = Obstacle(joint=joint, limit=limit, weight=weight / largest)
            kept[joint, limit] = max(one, kept.get((joint, limit), one), key=lambda each: each.weight)
    return sorted(kept.values(), key=lambda obstacle: -obstacle.weight)
