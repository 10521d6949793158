"""How a robot comes together: reduced to a chain, limits completed, audited, then refused or built."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.core.checks import array, frozen, positive
from ftqp.core.errors import InputError, ModelError
from ftqp.model import audit
from ftqp.model.audit import Finding
from ftqp.model.chain import chain_of
from ftqp.model.limits import RISE_TIME, JointLimits
from ftqp.model.neutral import Arm, neutral_posture
from ftqp.model.reading.source import Source, follower_findings
from ftqp.model.reduction import reduced, tip_of
from ftqp.model.refitting import friction_findings, has_masses, write_friction
from ftqp.model.shape import dynamics_findings, reach_of

ROWS = ("x", "y", "z", "rx", "ry", "rz")
"""Names of the task rows: linear then angular, along the axes of W."""

LENGTH_FRACTION = 1.0 / 6.0
"""Characteristic length by reach: where a norm mixes units, one radian counts as much as this length."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Wishes:
    """What the user asked for beside the model; the fields are explained in ``Robot.from_pinocchio``."""

    tip: str | None
    locked: Sequence[str | int] = ()
    q_locked: Mapping[str, float] | None = None
    limits: JointLimits | Mapping[str, Any] | None = None
    acceleration: Any = None
    name: str | None = None
    neutral: Any = None
    default_rows: Sequence[str] = ROWS
    length: float | None = None
    gravity: Any = None
    kinematics_only: bool = False


def robot_fields(source: Source, wishes: Wishes) -> dict[str, Any]:
    """The fields of a ``Robot``.

    Raises:
        InputError: An unknown tip or joint, or a wrong shape.
        ModelError: The robot is unsafe or not a chain; carries every finding.
    """
    if isinstance(wishes.locked, str):
        raise InputError(f"locked is {wishes.locked!r}, expected a list of joints, [{wishes.locked!r}]")
    tip, findings = tip_of(source.model, wishes.tip, wishes.locked)
    arm = reduced(source.model, tip, wishes.locked, wishes.q_locked)
    arm.name = wishes.name or source.model.name or "robot"
    if wishes.gravity is not None:
        arm.gravity = pin.Motion(
            np.concatenate([array("gravity", wishes.gravity, (3,), "(3,)"), np.zeros(3)])
        )
    if wishes.kinematics_only:
        for i in range(arm.njoints):
            arm.inertias[i] = pin.Inertia.Zero()
        arm.armature = np.zeros(arm.nv)
    if not has_masses(arm):
        write_friction(arm, 0.0, 0.0)
    findings += [f for f in source.findings if not (wishes.kinematics_only and f.about == "masses")]
    findings += dynamics_findings(arm)
    try:
        chain = chain_of(arm, tip)
    except ModelError as error:
        audit.refuse_unsafe(arm.name, [*map(audit.unsafe, error.findings), *findings])
        raise
    findings += follower_findings(source.followers, chain.names, wishes.locked)
    bounds = _limits([source.limits[name] for name in chain.names], wishes, findings)
    findings += audit.limit_findings(chain.names, bounds, chain.continuous)
    findings += friction_findings(arm, bounds)
    audit.refuse_unsafe(arm.name, findings)
    write_limits(arm, bounds)
    rows = _rows(wishes.default_rows)
    length = _length(wishes.length, LENGTH_FRACTION * reach_of(chain, bounds))
    shape = Arm(arm, tip, chain, bounds, rows, length)
    start, said = neutral_posture(shape, wishes.neutral, source.postures)
    return {
        "name": arm.name,
        "model": arm,
        "tip": tip,
        "chain": chain,
        "limits": bounds,
        "neutral": frozen(start),
        "default_rows": rows,
        "length": length,
        "findings": (*findings, *said),
    }


def _length(given: float | None, default: float) -> float:
    return default if given is None else positive("length", given, "m")


def _limits(written: Sequence[Mapping[str, float]], wishes: Wishes, findings: list[Finding]) -> JointLimits:
    """The limits as written, replaced by those given; accelerations by rule where nobody gave them."""
    count = len(written)
    changes: dict[str, Any] = {}
    if isinstance(wishes.limits, JointLimits):
        if len(wishes.limits) != count:
            raise InputError(f"limits are of {len(wishes.limits)} joints, expected (nv,) = ({count},)")
        changes = {field.name: getattr(wishes.limits, field.name) for field in fields(JointLimits)}
    elif isinstance(wishes.limits, Mapping):
        changes = dict(wishes.limits)
    elif wishes.limits is not None:
        raise InputError(
            f"limits is of type {type(wishes.limits).__name__}, expected JointLimits or a mapping"
        )
    if wishes.acceleration is not None:
        changes["a_max"] = wishes.acceleration
    own = {key: np.array([joint[key] for joint in written]) for key in ("q_min", "q_max", "v_max", "tau_max")}
    own["v_max"] = changes.get("v_max", own["v_max"])
    if "a_max" not in changes and all("a_max" in joint for joint in written):
        changes["a_max"] = np.array([joint["a_max"] for joint in written])
    if "a_max" not in changes:
        findings.append(
            audit.note(
                f"no acceleration limit is known; a_max = v_max / {RISE_TIME:g} s is taken; "
                "give acceleration=... to replace it"
            )
        )
    return JointLimits.of(count, **own).replaced(changes)


def write_limits(arm: Any, limits: JointLimits) -> None:
    """Writes the limits into the pinocchio model, which the tests take for an oracle."""
    for i in range(1, arm.njoints):
        if arm.nqs[i] == 1:
            arm.lowerPositionLimit[arm.idx_qs[i]] = limits.q_min[i - 1]
            arm.upperPositionLimit[arm.idx_qs[i]] = limits.q_max[i - 1]
        arm.velocityLimit[arm.idx_vs[i]] = limits.v_max[i - 1]
        arm.effortLimit[arm.idx_vs[i]] = limits.tau_max[i - 1]


def _rows(rows: Sequence[str]) -> tuple[str, ...]:
    for row in rows:
        if row not in ROWS:
            raise InputError(f"{row!r} is not a task row; expected some of {', '.join(ROWS)}")
    if not rows:
        raise InputError(f"default_rows is empty; expected some of {', '.join(ROWS)}")
    return tuple(row for row in ROWS if row in rows)
