"""What follows from an arm's shape and masses: reach, a sensible start, whether its inertia is sound."""

from collections.abc import Collection
from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.core.checks import BoolArray, FloatArray
from ftqp.core.errors import InputError
from ftqp.model.audit import Finding, Severity, body_findings, length_findings, note, rotor_findings, unsafe
from ftqp.model.chain import Chain
from ftqp.model.limits import JointLimits

SINGULAR = 1e-12
"""Smallest ratio of eigenvalues of the joint-space inertia that still counts as regular."""

EDGE = 0.05
"""A start at zero moves to the middle of the range when it lies in this fraction of it from a limit."""

HALF_OPEN = 0.5
"""Distance [rad or m] from the only limit of a joint at which it starts."""


PLANAR_BASE = ("base_x", "base_y", "base_yaw")
"""The joints that ``Robot.on_planar_base`` puts before those of a robot."""


def reach_of(chain: Chain, limits: JointLimits) -> float:
    """Length of the stretched arm [m]: distances between joint origins from the first joint to the tip.

    The height of the second joint along the axis of a first joint that turns does not count: it moves
    nothing, and the same arm written with another base frame has the same reach. A sliding joint adds its
    larger finite limit. Of several arms it is that of the one to the tip, the first of several, and a planar
    base counts nothing.
    """
    way = chain.way(chain.tip_joint)
    if chain.names[:3] == PLANAR_BASE:
        way = way[3:]
    way = way[chain.floating :]
    steps = [step.copy() for step in [*chain.translation[way[1:]], chain.tip_translation]]
    if not chain.prismatic[way[0]]:
        steps[0][2] = 0.0
    reach = float(sum(np.linalg.norm(step) for step in steps))
    for i in (i for i in way if chain.prismatic[i]):
        ends = np.abs([limits.q_min[i], limits.q_max[i]])
        finite = ends[np.isfinite(ends)]
        reach += float(finite.max()) if finite.size else 0.0
    return reach if reach > 0.0 else 1.0


def neutral_of(limits: JointLimits, wanted: FloatArray | None) -> FloatArray:
    """A configuration inside the limits, (nv,) [rad or m]: the wanted one, else zero or the middle."""
    low, high = limits.q_min, limits.q_max
    if wanted is not None:
        if not np.isfinite(wanted).all():
            raise InputError("neutral is not finite; expected a configuration inside the limits")
        return np.clip(wanted, low, high)
    result = np.zeros(len(limits))
    for i, (a, b) in enumerate(zip(low, high, strict=True)):
        if np.isfinite(a) and np.isfinite(b):
            edge = EDGE * (b - a)
            result[i] = 0.0 if a + edge <= 0.0 <= b - edge else 0.5 * (a + b)
        elif np.isfinite(a):
            result[i] = max(0.0, a + HALF_OPEN)
        elif np.isfinite(b):
            result[i] = min(0.0, b - HALF_OPEN)
    return result


def random_postures(
    limits: JointLimits, prismatic: BoolArray, count: int, generator: np.random.Generator
) -> FloatArray:
    """Random postures inside the limits, (count, nv), half a turn or half a metre where there are none."""
    wide = np.where(prismatic, 0.5, np.pi)
    low = np.where(np.isfinite(limits.q_min), limits.q_min, -wide)
    high = np.where(np.isfinite(limits.q_max), limits.q_max, wide)
    return generator.uniform(low, np.maximum(low, high), (count, len(limits)))


def dynamics_findings(model: Any, bodiless: Collection[str] = ()) -> list[Finding]:
    """What is wrong with rotors, bodies and joint-space inertia at neutral of a reduced model."""
    bodies = [model.inertias[i] for i in range(1, model.njoints)]
    names = [str(model.names[i]) for i in range(1, model.njoints)]
    each = [name for i, name in enumerate(names, 1) for _ in range(model.nvs[i])]
    places = [model.jointPlacements[i].translation for i in range(1, model.njoints)]
    places += [frame.placement.translation for frame in model.frames]
    found = rotor_findings(each, model.armature)
    found += length_findings([*names, *(str(frame.name) for frame in model.frames)], np.array(places))
    if any(finding.severity is Severity.UNSAFE for finding in found):
        return found
    far = found
    mass = np.array([b.mass for b in bodies])
    inertia = np.array([b.inertia for b in bodies])
    if not mass.any() and not inertia.any():
        return [*far, note(f"{model.name} has no masses; torques are neither limited nor minimised")]
    com = np.array([b.lever for b in bodies])
    real = [i for i, name in enumerate(names) if mass[i] or name not in bodiless]
    found = far + body_findings(
        "the body behind joint", [names[i] for i in real], mass[real], com[real], inertia[real]
    )
    if any(finding.severity is Severity.UNSAFE for finding in found):
        return found
    M = pin.crba(model, model.createData(), pin.neutral(model))
    M = np.triu(M) + np.triu(M, 1).T
    values = np.linalg.eigvalsh(M)
    if values[0] <= SINGULAR * values[-1]:
        sentence = (
            f"{model.name} has a joint-space inertia that is not positive definite (eigenvalues "
            f"{values[0]:.3g} to {values[-1]:.3g}); correct the masses or drop them with kinematics_only=True"
        )
        found.append(unsafe(sentence))
    return found
