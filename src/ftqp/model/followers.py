"""Joints that follow others, as a file's ``mimic`` has it: what they do to limits, Jacobians and inertias."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Protocol

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray, IntArray
from ftqp.model.audit import Finding, unsafe, warning
from ftqp.model.limits import JointLimits


class Led(Protocol):
    """Leader, ratio and offset of every joint, (nv,) each, as an ``ftqp.model.chain.Chain`` has them."""

    @property
    def lead(self) -> IntArray: ...
    @property
    def ratio(self) -> FloatArray: ...
    @property
    def offset(self) -> FloatArray: ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Follower:
    """How a joint follows another one: q = ratio q_leader + offset."""

    leader: str  # The name of the joint that it follows
    ratio: float = 1.0  # Of its motion to that of its leader, any number but 0
    offset: float = 0.0  # Where it is when its leader is at 0 [rad or m]
    # Why it follows in a way that is not this one, empty where it does; such a joint can only be held
    otherwise: str = ""


def leads_of(
    names: Sequence[str], followers: Mapping[str, Follower]
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Leader, ratio and offset of every joint, (nv,) each; of one that cannot follow those of a free one."""
    lead, ratio, offset = np.arange(len(names)), np.ones(len(names)), np.zeros(len(names))
    for i, name in enumerate(names):
        follower = followers.get(name)
        if follower is not None and follower.leader in names and not _why_not(name, follower, followers):
            lead[i] = names.index(follower.leader)
            ratio[i], offset[i] = follower.ratio, follower.offset
    return lead, ratio, offset


def _why_not(name: str, follower: Follower, followers: Mapping[str, Follower]) -> str:
    """Why a joint cannot follow as it is said to, whatever moves; empty where it can."""
    if follower.otherwise:
        return follower.otherwise
    if follower.leader == name:
        return "a joint cannot follow itself"
    if follower.leader in followers:
        turn = followers[follower.leader].leader
        return f"{follower.leader!r} mimics {turn!r} in turn; let both mimic the joint with the motor"
    if not (np.isfinite([follower.ratio, follower.offset]).all() and follower.ratio != 0.0):
        return (
            f"by {follower.ratio:g} times its position plus {follower.offset:g}, expected finite numbers and "
            "a multiplier other than 0"
        )
    return ""


def followers_of(names: Sequence[str], chain: Led) -> dict[str, Follower]:
    """The joints that follow others, by name."""
    return {
        names[i]: Follower(leader=names[l], ratio=float(chain.ratio[i]), offset=float(chain.offset[i]))
        for i, l in enumerate(chain.lead.tolist())
        if l != i
    }


def is_led(chain: Led) -> BoolArray:
    """Which joints follow another one, (nv,)."""
    return np.asarray(chain.lead != np.arange(len(chain.lead)))


def led_joints(chain: Led) -> list[tuple[int, int, float, float]]:
    """Each joint that follows another one: itself, its leader, ratio and offset."""
    return [
        (m, int(chain.lead[m]), float(chain.ratio[m]), float(chain.offset[m]))
        for m in np.flatnonzero(is_led(chain)).tolist()
    ]


def coupled_places(chain: Led, q: FloatArray) -> FloatArray:
    """Positions (..., nv) with every follower where its leader puts it [rad or m]."""
    led = is_led(chain)
    return np.where(led, chain.ratio * q[..., chain.lead] + chain.offset, q) if led.any() else q


def coupled_columns(chain: Led, J: FloatArray) -> FloatArray:
    """J E: columns of followers, (..., nv), added to those of their leaders, and zero themselves."""
    led = np.flatnonzero(is_led(chain))
    if not led.size:
        return J
    J = np.array(J)
    for m in led:
        J[..., chain.lead[m]] += chain.ratio[m] * J[..., m]
        J[..., m] = 0.0
    return J


def coupled_square(chain: Led, M: FloatArray) -> FloatArray:
    """E'M E of a matrix of the joints, (nv, nv)."""
    return coupled_columns(chain, coupled_columns(chain, M).T).T


def follower_findings(
    followers: Mapping[str, Follower], moving: Sequence[str], continuous: BoolArray, locked: Sequence[Any]
) -> list[Finding]:
    """What is wrong with joints that follow others."""
    found: list[Finding] = []
    for name, follower in followers.items():
        leader = follower.leader
        if name not in moving:
            if leader in moving and name not in locked:
                found.append(warning(f"joint {name!r} mimics {leader!r} but is held still"))
            continue
        why = _why_not(name, follower, followers)
        if not why and leader not in moving:
            why = "that is no joint that moves"
        elif not why and (continuous[moving.index(name)] or continuous[moving.index(leader)]):
            why = "one of them turns without limits; give both limits"
        if why:
            found.append(
                unsafe(f"joint {name!r} mimics {leader!r}, but {why}; or hold it with locked=[{name!r}]")
            )
    return found


def coupled_limits(
    names: Sequence[str], chain: Led, limits: JointLimits
) -> tuple[JointLimits, list[Finding]]:
    """Limits with those of followers folded into their leaders', and what is wrong with them.

    The leader keeps the part of its range in which its followers are in theirs, and the speed, acceleration
    and jerk with which they are within theirs; those of a follower are then the images of the leader's. A
    limit that a follower does not have, NaN or no number above 0, is none; its torque is its leader's.
    """
    led = led_joints(chain)
    if not led:
        return limits, []
    all_of = {field.name: np.array(getattr(limits, field.name)) for field in fields(JointLimits)}
    low, high, found = all_of["q_min"], all_of["q_max"], list[Finding]()
    rates = [all_of[name] for name in ("v_max", "a_max", "j_max")]
    for m, l, ratio, offset in led:
        own = np.where(np.isnan([low[m], high[m]]), [-np.inf, np.inf], [low[m], high[m]])
        ends = np.sort((own - offset) / ratio)
        low[l], high[l] = max(low[l], ends[0]), min(high[l], ends[1])
        if low[l] >= high[l]:
            found.append(
                unsafe(
                    f"joint {names[m]!r} mimics {names[l]!r} by {ratio:g} q + {offset:g}, and no place of "
                    f"{names[l]!r} keeps both in their ranges; correct the limits"
                )
            )
        for rate in rates:
            own_rate = rate[m] if rate[m] > 0.0 else np.inf
            rate[l] = min(rate[l], own_rate / abs(ratio))
    for m, l, ratio, offset in led:
        low[m], high[m] = np.sort(ratio * np.array([low[l], high[l]]) + offset)
        for rate in rates:
            rate[m] = abs(ratio) * rate[l]
        all_of["tau_max"][m] = np.inf
    return JointLimits(**all_of), found
