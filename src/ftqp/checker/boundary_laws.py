"""The laws of what was to stay on its side of a boundary: points of their planes, axes in their cones."""

from collections.abc import Iterator

import numpy as np

from ftqp.checker.model_file import ModelFile
from ftqp.checker.trace import Cone, Strictness, Trace
from ftqp.core.checks import BoolArray, FloatArray


def plane(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far points are beyond their planes after each tick, by the joint that moves them, (K, nv) [m]."""
    beyond = (
        (one.joint, one.offset - arm.point(run.q, one.joint, one.at_zero) @ np.array(one.normal))
        for one in run.planes
    )
    return farther(arm, run, strict.plane, beyond)


def cone(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far axes are outside their cones after each tick, by the joint that they move with, (K, nv) [rad].

    Of an angle as many rad are let pass as of a plane's distance m.
    """
    beyond = ((one.joint, _angles(arm, run, one) - one.within) for one in run.cones)
    return farther(arm, run, strict.plane, beyond)


def farther(
    arm: ModelFile, run: Trace, passes: float, beyond: Iterator[tuple[int, FloatArray]]
) -> FloatArray:
    """What is beyond more than it may be, by joint and tick, of joints and how far beyond each was, (K + 1,).

    What begins beyond may not go farther, and none again once it has come back. No motor keeps what a freely
    swinging joint moves; where it is in the end counts as its beginning.
    """
    result = np.zeros((len(run.status), len(arm.names)))
    for joint, far in beyond:
        excused, allowed = _swinging(arm, run, joint), max(float(far[0]), 0.0)
        for k, now in enumerate(far[1:]):
            allowed = max(float(now), 0.0) if excused[k] else allowed
            result[k, joint] = max(result[k, joint], now - allowed - passes)
            allowed = min(allowed, max(float(now), 0.0))
    return result


def _angles(arm: ModelFile, run: Trace, one: Cone) -> FloatArray:
    """Between the axis and the middle of its cone, (K + 1,) [rad]."""
    ends = np.array(one.at_zero), np.array(one.at_zero) + np.array(one.axis_at_zero)
    foot, head = (arm.point(run.q, one.joint, end.tolist()) for end in ends)
    away = np.linalg.norm(np.cross(head - foot, one.along), axis=1)
    result: FloatArray = np.arctan2(away, (head - foot) @ np.array(one.along))
    return result


def _swinging(arm: ModelFile, run: Trace, joint: int) -> BoolArray:
    """Ticks in which a freely swinging joint turns what moves with a joint, (K,)."""
    t = run.t
    result = np.zeros(len(t), dtype=np.bool_)
    for failure in run.failures:
        if failure.kind == "free" and failure.joint in arm.moves_with(joint):
            result |= (t > failure.since - 1.5 * run.dt) & (t < failure.until + 0.5 * run.dt)
    return result
