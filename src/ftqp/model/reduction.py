"""From any pinocchio model to the joints between its base and some tips: every other joint is held."""

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.core.errors import InputError, nearest, unknown
from ftqp.model.audit import OPEN_TIP, WRONG_TIP, Finding, unsafe
from ftqp.model.chain import frame_id, kind
from ftqp.model.followers import Follower
from ftqp.model.serial import MARK, graft

FREE = 6
"""Degrees of freedom of a joint that holds nothing."""
MOST_NAMES = 20
"""Most valid names that an error about a tip lists."""
SHOWN = 11
"""The same of an error about any other frame."""


def reduced(
    model: Any,
    tips: Sequence[str],
    locked: Sequence[str | int] = (),
    q_locked: Mapping[str, float] | None = None,
    followers: Mapping[str, Follower] | None = None,
    rest: Mapping[str, float] | None = None,
) -> Any:
    """The model with every joint held that is ``locked`` or not between the base and one of ``tips``.

    Held joints stand at ``q_locked`` or, without an entry, at ``rest``, else at neutral; their bodies'
    inertia is lumped into the body that carries them. Their rotor inertias and friction are dropped, for they
    stand still. A joint that moves keeps the leader that it follows; one whose leader is ``locked`` is held
    where that puts it.

    Joints in ``locked`` are given by name or 0-based index, ``q_locked`` and ``rest`` hold positions by name
    [rad or m]. The model handed in is not changed; in the new one joints of a branch are neighbours.
    """
    names = [str(name) for name in model.names][1:]
    for joint in model.joints.tolist()[1:]:
        if kind(joint) == "Mimic":
            raise InputError(
                f"{model.name} was built with mimic joints; build it without (mimic=False) and say which "
                "joint follows which with mimics={joint: (leader, ratio, offset)}"
            )
    held = {joint_index(names, joint, model.name) + 1 for joint in locked}
    moving = {i for tip in tips for i in model.supports[model.frames[frame_id(model, tip)].parentJoint]}
    places = dict(q_locked or {})
    for name, follower in (followers or {}).items():
        if not {name, follower.leader} <= set(names) or names.index(name) + 1 not in moving - held:
            continue
        leader = names.index(follower.leader) + 1
        if leader in held and not follower.otherwise:
            held.add(names.index(name) + 1)
            at = places.get(follower.leader, (rest or {}).get(follower.leader, 0.0))
            places.setdefault(name, follower.ratio * at + follower.offset)
        moving.add(leader)
    held |= {i for i in range(1, model.njoints) if i not in moving}
    order = _depth_first(model)
    plain = pin.Model()  # built anew, for pinocchio reduces only what is in order
    graft(plain, 0, np.eye(4), model, order=order[1:])
    for i, frame in enumerate(plain.frames):
        if i and frame.type != pin.FrameType.JOINT:
            frame.name = f"{i}{MARK}{frame.name}"
    q = pin.neutral(plain)
    for name, value in (rest or {}).items():
        if names.index(name) + 1 in held:
            places.setdefault(name, value)
    for joint, value in places.items():
        i = joint_index(names, joint, model.name) + 1
        if i not in held:
            raise InputError(f"q_locked holds a position of {joint!r}, which is not held; add it to locked")
        at = plain.idx_qs[order.index(i)]
        if model.nqs[i] == 1:
            q[at] = _position(joint, value)
        elif kind(model.joints[i]).startswith(("RUB", "RevoluteUnbounded")):
            q[at : at + 2] = np.cos(_position(joint, value)), np.sin(_position(joint, value))
        else:
            raise InputError(
                f"q_locked cannot hold {joint!r} of type {kind(model.joints[i])}; it is held at neutral"
            )
    try:
        result = pin.buildReducedModel(plain, sorted(map(order.index, held)), q)
    except ValueError as error:
        raise InputError(
            f"joints of {model.name} cannot be held ({' '.join(str(error).split())[:100]}); give every "
            "joint and body a name of its own"
        ) from error
    for frame in result.frames:
        frame.name = frame.name.partition(MARK)[2] or frame.name
    result.name = model.name
    result.gravity = model.gravity
    return result


def _depth_first(model: Any) -> list[int]:
    """pinocchio's numbers of joints, depth first as in files; in others its mass matrix is wrong."""
    order, left = [], [0]
    while left:
        order.append(left.pop())
        left += [i for i in range(model.njoints - 1, 0, -1) if model.parents[i] == order[-1]]
    return order


def _position(joint: str, value: float) -> float:
    if not np.isfinite(value):
        raise InputError(f"q_locked holds {value} for {joint!r}, expected a finite position")
    return float(value)


def joint_index(names: Sequence[str], joint: str | int, owner: str) -> int:
    """The 0-based index of a joint given by name or index."""
    if isinstance(joint, str):
        if joint in names:
            return list(names).index(joint)
        raise unknown("joint", joint, owner, names)
    if isinstance(joint, (int, np.integer)) and not isinstance(joint, bool):
        if 0 <= joint < len(names):
            return int(joint)
        raise InputError(f"joint index {joint} of {owner} is out of range, expected 0 to {len(names) - 1}")
    raise InputError(f"a joint of {owner} is given by name or 0-based index, got {joint!r:.80}")


def frame_names(model: Any) -> list[str]:
    """Names that can be a tip: bodies, operational frames, fixed joints and joints, each once."""
    return list(dict.fromkeys(str(f.name) for f in model.frames if f.name != "universe"))


def wanted_tips(tip: Any, tips: Any) -> tuple[str, ...]:
    """The names of tips that a user gives, one or several; none where the choice is left open."""
    if tips is None:
        return () if tip is None else (tip,)
    if tip is not None:
        raise InputError(f"both tip={tip!r:.60} and tips={tips!r:.80} are given; give one of them")
    if isinstance(tips, str):
        raise InputError(f"tips is {tips!r:.60}, expected several names; give tip={tips!r:.60}, or a list")
    if not isinstance(tips, Sequence) or not all(isinstance(name, str) for name in tips):
        raise InputError(f"tips is {tips!r:.80}, expected a list of names of frames")
    if not tips:
        raise InputError(
            "tips is empty, expected at least one name of a frame; leave it out for the only end"
        )
    for name in tips:
        if tips.count(name) > 1:
            raise InputError(f"tips has {name!r:.60} {tips.count(name)} times, expected each once")
    return tuple(tips)


def tips_of(
    model: Any, wanted: Sequence[str], locked: Sequence[str | int] = ()
) -> tuple[tuple[str, ...], list[Finding]]:
    """The tip frames: those wanted if they exist, or without any the only body at the end of the model."""
    valid = frame_names(model)
    if model.njoints < 2:
        raise InputError(f"{model.name} has no joint that moves; expected an arm")
    names = [str(name) for name in model.names][1:]
    held = {joint_index(names, joint, model.name) + 1 for joint in locked}
    ends = _ends(model, held) or [names[-1]]
    found: list[Finding] = []
    there = []
    for tip in wanted:
        if tip in valid:
            there.append(str(tip))
            continue
        there += (get_close_matches(str(tip), valid, n=1, cutoff=0.5) or ends)[:1]
        sentence = (
            f"{tip!r} is not a frame of {model.name}{nearest(str(tip), valid)}; it has {_listed(valid)}"
        )
        found.append(unsafe(sentence, WRONG_TIP))
    if wanted:
        return tuple(there), found
    if len(ends) > 1:
        several = f"{len(ends)} possible tips; choose one with tip=, or several with tips=(...)"
        question = f"{model.name} has {several}: {_listed(ends)}"
        found.append(unsafe(question, OPEN_TIP))
    return (ends[0],), found


def named_frame(model: Any, name: Any) -> int:
    """pinocchio's number of a frame that a user names."""
    valid = frame_names(model)
    if name not in (*valid, "universe"):
        more = ", ..." if len(valid) > SHOWN else ""
        raise InputError(
            f"frame is {name!r:.60}{nearest(str(name), valid)}, expected one of {model.name}: "
            f"{', '.join(valid[:SHOWN])}{more}"
        )
    return frame_id(model, name)


def _ends(model: Any, held: set[int]) -> list[str]:
    """Bodies and operational frames at ends that no held joint carries, nor a free joint alone."""
    kinds = (pin.FrameType.BODY, pin.FrameType.OP_FRAME)
    parents = {f.parentFrame for f in model.frames}
    arm = {i for i in range(1, model.njoints) if model.nvs[i] < FREE}
    ends = [f for i, f in enumerate(model.frames) if i not in parents and f.type in kinds]
    carried = [(f, arm & set(model.supports[f.parentJoint])) for f in ends]
    return [str(f.name) for f, joints in carried if joints and not held & joints]


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return ", ".join(names[:MOST_NAMES]) + more
