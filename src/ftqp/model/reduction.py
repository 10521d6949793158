"""From any pinocchio model to the serial chain between its base and one tip: every other joint is held."""

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.core.errors import InputError, nearest, unknown
from ftqp.model.audit import Finding, unsafe
from ftqp.model.chain import frame_id, kind

MARK = "\x1f"
"""Separates a frame's number from its name while a model is reduced."""

MOST_NAMES = 20
"""Most valid names that an error about a frame lists."""


def reduced(
    model: Any, tip: str, locked: Sequence[str | int] = (), q_locked: Mapping[str, float] | None = None
) -> Any:
    """The model with every joint held that is ``locked`` or not between the base and ``tip``.

    Held joints stand at ``q_locked`` or, without an entry, at neutral; their bodies' inertia is lumped into
    the body that carries them. Their rotor inertias and friction are dropped, for they stand still.

    Joints in ``locked`` are given by name or 0-based index, ``q_locked`` holds positions by name [rad or m].
    The model handed in is not changed.

    Raises:
        InputError: An unknown joint, or a position of a joint that is not held or has several degrees of
            freedom.
    """
    names = [str(name) for name in model.names][1:]
    for joint in model.joints.tolist()[1:]:
        if kind(joint) == "Mimic":
            raise InputError(
                f"{model.name} was built with mimic joints; build it without (mimic=False) and hold them"
            )
    held = {joint_index(names, joint, model.name) + 1 for joint in locked}
    chain = set(model.supports[model.frames[frame_id(model, tip)].parentJoint])
    held |= {i for i in range(1, model.njoints) if i not in chain}
    q = pin.neutral(model)
    for joint, value in (q_locked or {}).items():
        i = joint_index(names, joint, model.name) + 1
        if i not in held:
            raise InputError(f"q_locked holds a position of {joint!r}, which is not held; add it to locked")
        at = model.idx_qs[i]
        if model.nqs[i] == 1:
            q[at] = _position(joint, value)
        elif kind(model.joints[i]).startswith(("RUB", "RevoluteUnbounded")):
            q[at : at + 2] = np.cos(_position(joint, value)), np.sin(_position(joint, value))
        else:
            raise InputError(
                f"q_locked cannot hold {joint!r} of type {kind(model.joints[i])}; it is held at neutral"
            )
    try:
        result = pin.buildReducedModel(_plain(model), sorted(held), q)
    except ValueError as error:
        raise InputError(
            f"{model.name} cannot be reduced to a chain ({' '.join(str(error).split())[:100]}); give every "
            "joint and body a name of its own"
        ) from error
    for frame in result.frames:
        frame.name = frame.name.partition(MARK)[2] or frame.name
    result.name = model.name
    result.gravity = model.gravity
    return result


def _plain(model: Any) -> Any:
    """The model built anew so that pinocchio can reduce it.

    It refuses NaN or crossed limits, two frames of one name, and frames that stand before their joint's.
    """
    plain = pin.Model()
    for i in range(1, model.njoints):
        plain.addJoint(model.parents[i], model.joints[i], model.jointPlacements[i], model.names[i])
        plain.appendBodyToJoint(i, model.inertias[i], pin.SE3.Identity())
    at = [0]
    for i in range(1, model.njoints):
        at.append(plain.addJointFrame(i, at[model.parents[i]]))
    for i, f in enumerate(model.frames):
        if f.type != pin.FrameType.JOINT and i > 0:
            name = f"{i}{MARK}{f.name}"
            plain.addFrame(pin.Frame(name, f.parentJoint, at[f.parentJoint], f.placement, f.type), False)
    plain.armature, plain.damping, plain.friction = model.armature, model.damping, model.friction
    return plain


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


def tip_of(model: Any, tip: str | None, locked: Sequence[str | int] = ()) -> tuple[str, list[Finding]]:
    """The tip frame: ``tip`` itself if it exists, or without one the only body at the end of the model.

    Where that fails, the nearest or the last frame stands in, so that the audit can go on, with an unsafe
    finding.
    """
    valid = frame_names(model)
    if model.njoints < 2:
        raise InputError(f"{model.name} has no joint that moves; expected an arm")
    if tip in valid:
        return str(tip), []
    names = [str(name) for name in model.names][1:]
    held = {joint_index(names, joint, model.name) + 1 for joint in locked}
    ends = _ends(model, held) or [names[-1]]
    if tip is not None:
        close = get_close_matches(str(tip), valid, n=1, cutoff=0.5)
        sentence = (
            f"{tip!r} is not a frame of {model.name}{nearest(str(tip), valid)}; it has {_listed(valid)}"
        )
        return (close or ends)[0], [unsafe(sentence)]
    if len(ends) == 1:
        return ends[0], []
    return ends[0], [
        unsafe(f"{model.name} has {len(ends)} possible tips; choose one with tip=: {_listed(ends)}")
    ]


def _ends(model: Any, held: set[int]) -> list[str]:
    """Bodies and operational frames with no other frame behind them, not carried by a held joint."""
    kinds = (pin.FrameType.BODY, pin.FrameType.OP_FRAME)
    parents = {f.parentFrame for f in model.frames}
    ends = [f for i, f in enumerate(model.frames) if i not in parents and f.type in kinds]
    return [str(f.name) for f in ends if f.parentJoint > 0 and not held & set(model.supports[f.parentJoint])]


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return ", ".join(names[:MOST_NAMES]) + more
