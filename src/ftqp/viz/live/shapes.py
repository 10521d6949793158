"""The look of an arm of which only joints and tips are known: barrels for joints, tubes for links, a foot."""

from dataclasses import dataclass

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.model.chain import Chain, ends_of
from ftqp.model.robot import Robot
from ftqp.viz.live.solids import Mesh, ball, box, cylinder, joined, tube

BASE = -1
"""Index of the frame that does not move."""
THICK = 0.055
"""Radius of the first barrel, as a share of the arm's size."""
TAPER = 0.55
"""By how much the barrels become thinner to the tip, as a share of the first."""
SLIM = 0.72
"""Radius of a tube, as a share of the barrel's that it begins at."""
TALL = 2.1
"""Length of a barrel, in its radii."""
STRAIGHT = 0.02
"""A part of an elbow below this share of the other is left out."""
NEAR = 1e-3
"""Origins nearer to each other than this share of the arm's size have no tube between them."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Part:
    """A rigid part of an arm, whose mesh stands in a joint's frame, or in ``BASE``.

    The kind is ``joint``, ``link``, ``base``, ``tip``, or ``body``: a link that shows its joint's condition.
    """

    name: str
    kind: str
    frame: int
    mesh: Mesh


def size_of(chain: Chain) -> float:
    """By what everything of a scene is scaled [m]: distances between origins, first joint to tip, > 0."""
    way = chain.way(chain.tip_joint)
    steps = np.vstack([chain.translation[way[1:]], chain.tip_translation[None]])
    size = float(np.linalg.norm(steps, axis=1).sum())
    return size if size > 0.0 else float(np.linalg.norm(chain.translation[0])) or 1.0


def radii(chain: Chain) -> FloatArray:
    """Radius of each joint's barrel, (nv,) [m]: 0.055 size (1 - 0.55 k / n), k of n joints before it."""
    before = np.array([len(chain.way(i)) - 1 for i in range(len(chain.names))])
    return np.asarray(THICK * size_of(chain) * (1.0 - TAPER * before / (before.max() + 1)))


def arm_parts(robot: Robot) -> tuple[Part, ...]:
    """All parts of a robot, base to tips, each in the coordinates of its joint's frame."""
    chain = robot.chain
    size, thick = size_of(chain), radii(chain)
    parts = [Part(name="base", kind="base", frame=BASE, mesh=_base(chain, float(thick[0]), size))]
    tips = [(body, at) for body, _, at in ends_of(robot.model, robot.tips)]
    ends = [*zip(chain.parent.tolist(), chain.translation, strict=True), *tips]
    for i in range(robot.nv):
        radius = float(thick[i])
        parts.append(Part(name=f"joint{i}", kind="joint", frame=i, mesh=_joint(chain, i, radius)))
        link = joined([_link(end, SLIM * radius, size) for body, end in ends if body == i])
        if len(link.faces):
            parts.append(Part(name=f"link{i}", kind="link", frame=i, mesh=link))
    for k, (body, at) in enumerate(tips):
        tip = ball(1.1 * SLIM * float(thick[body]), at)
        parts.append(Part(name=f"tip{k or ''}", kind="tip", frame=body, mesh=tip))
    return tuple(parts)


def _joint(chain: Chain, i: int, radius: float) -> Mesh:
    """A barrel about the axis of a joint that turns, a box on one that slides."""
    if chain.prismatic[i]:
        return box(radius * np.array([2.0, 2.0, TALL]))
    half = 0.5 * TALL * radius
    return cylinder(radius, -half, half)


def _link(end: FloatArray, radius: float, size: float) -> Mesh:
    """From a frame's origin to a point: along the frame's z axis, then across, with a ball in the elbow."""
    along, across = abs(float(end[2])), float(np.hypot(end[0], end[1]))
    if np.hypot(along, across) < NEAR * size:
        return joined([])
    start = np.zeros(3)
    if min(along, across) < STRAIGHT * max(along, across):
        return tube(start, end, radius)
    elbow = np.array([0.0, 0.0, end[2]])
    return joined([tube(start, elbow, radius), ball(radius, elbow), tube(elbow, end, radius)])


def _base(chain: Chain, radius: float, size: float) -> Mesh:
    """A foot plate and what carries the first joints."""
    plate = cylinder(2.1 * radius, -0.35 * radius, 0.0, 1.9 * radius)
    pillars = [_link(chain.translation[i], 1.15 * radius, size) for i in np.flatnonzero(chain.parent < 0)]
    return joined([plate, *pillars])
