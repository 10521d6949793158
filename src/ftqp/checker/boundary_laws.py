"""The laws of what was to keep apart: points and planes, axes and cones, bodies and things, by coal."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import coal
import numpy as np

from ftqp.checker.model_file import LinkShape, ModelFile, hull_of_corners
from ftqp.checker.trace import Body, Cone, Strictness, Thing, Trace
from ftqp.core.checks import BoolArray, FloatArray


def plane(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far points are beyond their planes after each tick, by the joint that moves them, (K, nv) [m]."""
    beyond = (
        (one.joint, one.offset - arm.point(run.q, one.joint, one.at_zero) @ np.array(one.normal))
        for one in run.planes
    )
    return farther(arm, run, strict.plane, beyond)


def cone(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far axes are outside their cones after each tick, by joint, (K, nv) [rad]."""
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


NEAR = 0.05
"""Pairs surely farther apart than they are to be kept and this [m] are not measured. A convention."""


def touched(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How much nearer than they may be bodies are, by tick and joint, (K, nv) [m]."""
    pairs = list(_too_near(arm, run))
    begun = max((float(near[0]) for _, near in pairs), default=0.0)
    return farther(arm, run, strict.body + max(begun, 0.0), iter(pairs))


def _too_near(arm: ModelFile, run: Trace) -> Iterator[tuple[int, FloatArray]]:
    """Of each pair the joint that moves its first body, and how much too near it is, (K + 1,) [m]."""
    joints = {body.name: body.joint for body in run.bodies}
    placed = {body.name: _body(arm, run, body) for body in run.bodies}
    placed |= {thing.name: _standing(thing, len(run.q)) for thing in run.things}
    for first, second in run.watched:
        yield joints[first], run.keep - _between(placed[first], placed[second], run.keep)
    things = {thing.name for thing in run.things}
    for link in arm.links:
        for name in sorted({second for first, second in run.watched if joints[first] == link.joint} & things):
            yield link.joint, -_between(_link(arm, run, link), placed[name], 0.0)


class Placed(NamedTuple):
    """A body at each tick."""

    shape: Any  # As coal has it
    R: FloatArray  # How it is turned, (K + 1, 3, 3)
    p: FloatArray  # Where its middle is, (K + 1, 3) [m]
    reach: float  # How far it extends from there [m]; infinite of a half-space


def _body(arm: ModelFile, run: Trace, body: Body) -> Placed:
    """A link: the hull of its corners, or a capsule along its own z axis."""
    if len(body.corners_at_zero):
        middle = body.corners_at_zero.mean(axis=0)
        at_zero = np.eye(4)
        at_zero[:3, 3] = middle
        moved = body.joint >= 0
        T = arm.poses(run.q, body.joint, at_zero) if moved else np.broadcast_to(at_zero, (len(run.q), 4, 4))
        corners = body.corners_at_zero - middle
        reach = float(np.linalg.norm(corners, axis=1).max())
        return Placed(hull_of_corners(corners), T[:, :3, :3], T[:, :3, 3], reach)
    if body.joint < 0:
        ends = np.broadcast_to(np.array(body.ends_at_zero), (len(run.q), 2, 3))
    else:
        ends = np.stack([arm.point(run.q, body.joint, end) for end in body.ends_at_zero], axis=1)
    way = ends[:, 1] - ends[:, 0]
    length = float(np.linalg.norm(way[0]))
    z = way / length if length > 0.0 else np.broadcast_to([0.0, 0.0, 1.0], way.shape)
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z), axis=1)])
    x /= np.linalg.norm(x, axis=1)[:, None]
    R = np.stack([x, np.cross(z, x), z], axis=2)
    return Placed(coal.Capsule(body.radius, length), R, ends.mean(axis=1), 0.5 * length + body.radius)


def _link(arm: ModelFile, run: Trace, link: LinkShape) -> Placed:
    """A piece of a link as the model file has it."""
    T = arm.poses(run.q, link.joint, link.at_zero)
    return Placed(link.shape, T[:, :3, :3], T[:, :3, 3], link.reach)


def _standing(thing: Thing, count: int) -> Placed:
    """Something that stands where it is."""
    x, y, z = thing.extent
    match thing.kind:
        case "box":
            shape, reach = coal.Box(2.0 * x, 2.0 * y, 2.0 * z), float(np.linalg.norm(thing.extent))
        case "cylinder":
            shape, reach = coal.Cylinder(y, 2.0 * x), float(np.hypot(x, y))
        case "hull":
            shape, reach = hull_of_corners(thing.corners), float(np.linalg.norm(thing.extent))
        case "half_space":
            shape, reach = coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0), np.inf
        case _:
            shape, reach = coal.Capsule(y, 2.0 * x), x + y
    R, p = (np.broadcast_to(part, (count, *part.shape)) for part in (thing.pose[:3, :3], thing.pose[:3, 3]))
    return Placed(shape, R, p, reach)


def _between(one: Placed, other: Placed, keep: float) -> FloatArray:
    """The distance of two bodies at each tick, (K + 1,) [m]; infinite where it is certainly large."""
    request, result = coal.DistanceRequest(), np.full(len(one.p), np.inf)
    apart = np.linalg.norm(one.p - other.p, axis=1)
    for k in np.flatnonzero(apart <= one.reach + other.reach + keep + NEAR):
        a, b = (coal.Transform3s(each.R[k], each.p[k]) for each in (one, other))
        result[k] = coal.distance(one.shape, a, other.shape, b, request, coal.DistanceResult())
    return result
