"""What a reader hands over: a pinocchio model, its limits as written, and what is wrong with the file."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ftqp.model.audit import Finding
from ftqp.model.capsules import Capsule, Collision
from ftqp.model.followers import Follower

Written = Mapping[str, float]
"""q_min, q_max, v_max, tau_max of a joint as a file has them, NaN where missing.

a_max, j_max, soft_min and soft_max where they are there.
"""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Source:
    """A robot as it was read."""

    model: Any  # pinocchio model of everything in the file
    limits: Mapping[str, Written]  # Limits by joint name
    followers: Mapping[str, Follower] = field(default_factory=dict)  # Joints that follow another one, and how
    findings: Sequence[Finding] = ()  # What the reader has to say
    # Postures that the model names, positions by joint [rad or m]
    postures: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    shapes: Sequence[Capsule | Collision] = ()  # Collision geometry of the links
    held: Sequence[str] = ()  # Joints that are held anyway, those of a base that is free in a simulator
    # Where joints are held that nobody says a place for, 0 where absent [rad or m]
    rest: Mapping[str, float] = field(default_factory=dict)
    # Joints that have no body of their own, as the next joint moves the same one
    bodiless: Collection[str] = ()


def source_of(model: Any) -> Source:
    """A pinocchio model as a source; the largest float means no limit there, infinity here."""
    limits: dict[str, Written] = {}
    for i in range(1, model.njoints):
        if model.nvs[i] != 1:
            continue
        at, one = model.idx_vs[i], model.nqs[i] == 1
        limits[str(model.names[i])] = {
            "q_min": unlimited(model.lowerPositionLimit[model.idx_qs[i]]) if one else -np.inf,
            "q_max": unlimited(model.upperPositionLimit[model.idx_qs[i]]) if one else np.inf,
            "v_max": unlimited(model.velocityLimit[at]),
            "tau_max": unlimited(model.effortLimit[at]),
        }
    return Source(model=model, limits=limits, postures=_postures(model))


def _postures(model: Any) -> dict[str, dict[str, float]]:
    """The reference configurations that pinocchio keeps with a model."""
    found: dict[str, dict[str, float]] = {}
    for entry in model.referenceConfigurations:
        name, q = entry.key(), np.asarray(entry.data(), dtype=np.float64)
        if q.shape != (model.nq,) or not np.isfinite(q).all():
            continue
        found[str(name)] = {}
        for i in range(1, model.njoints):
            at = model.idx_qs[i]
            if (model.nqs[i], model.nvs[i]) == (1, 1):
                found[str(name)][str(model.names[i])] = float(q[at])
            elif (model.nqs[i], model.nvs[i]) == (2, 1):
                found[str(name)][str(model.names[i])] = float(np.arctan2(q[at + 1], q[at]))
    return found


def unlimited(value: float) -> float:
    """A limit as written; the largest float is none."""
    return float(value) if not abs(value) >= np.finfo(np.float64).max else float(np.copysign(np.inf, value))
