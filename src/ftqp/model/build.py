"""How a robot comes together: joints held, limits completed, audited, then refused or built."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, TypedDict, get_type_hints

import numpy as np
import pinocchio as pin

from ftqp.core.checks import array, frozen, positive
from ftqp.core.errors import InputError, ModelError, nearest, unknown
from ftqp.model import audit
from ftqp.model.audit import Finding
from ftqp.model.chain import Chain, chain_of
from ftqp.model.followers import (
    Follower,
    coupled_limits,
    coupled_places,
    follower_findings,
    is_led,
)
from ftqp.model.limits import RISE_TIME, JointLimits, by_joint
from ftqp.model.neutral import Arm, neutral_posture
from ftqp.model.posture import SAMPLES, acceleration_by_torque
from ftqp.model.reading.source import Source
from ftqp.model.reduction import reduced, tips_of
from ftqp.model.shape import dynamics_findings, reach_of

ROWS = ("x", "y", "z", "rx", "ry", "rz")
"""Names of the task rows: linear then angular, along the axes of W."""

LENGTH_FRACTION = 1.0 / 6.0
"""Characteristic length by reach: where a norm mixes units, one radian counts as much as this length."""


class Shape(TypedDict, total=False):
    """What every reader takes by keyword; ``Robot.from_pinocchio`` says what each is."""

    limits: JointLimits | Mapping[str, Any] | None
    acceleration: Any
    neutral: Any
    default_rows: Sequence[str]
    length: float | None


class Wishes(Shape, total=False):
    """What a reader of a model or file takes by keyword."""

    q_locked: Mapping[str, float] | None
    name: str | None
    gravity: Any
    kinematics_only: bool
    mimics: Mapping[str, Any] | None


KEYWORDS = tuple(get_type_hints(Wishes))


def robot_fields(
    source: Source, wanted_tips: Sequence[str], locked: Sequence[str | int], wishes: Wishes
) -> dict[str, Any]:
    """The fields of a ``Robot``."""
    for word in wishes:
        if word not in KEYWORDS:
            near = f"{nearest(word, KEYWORDS)}; there are {', '.join(KEYWORDS)}"
            raise TypeError(f"{word!r} is not a keyword of a reader of robots{near}")
    if isinstance(locked, str):
        raise InputError(f"locked is {locked!r}, expected a list of joints, [{locked!r}]")
    tips, findings = tips_of(source.model, wanted_tips, locked)
    followers = {**source.followers, **_mimics(wishes.get("mimics"), source.model)}
    locked = [*locked, *source.held]
    arm = reduced(source.model, tips, locked, wishes.get("q_locked"), followers, source.rest)
    arm.name = wishes.get("name") or source.model.name or "robot"
    gravity, kinematics_only = wishes.get("gravity"), wishes.get("kinematics_only", False)
    if gravity is not None:
        arm.gravity = pin.Motion(np.concatenate([array("gravity", gravity, (3,), "(3,)"), np.zeros(3)]))
    if kinematics_only:
        for i in range(arm.njoints):
            arm.inertias[i] = pin.Inertia.Zero()
        arm.armature = np.zeros(arm.nv)
    if not has_masses(arm):
        write_friction(arm, 0.0, 0.0)
    given = _given(wishes, arm.nv)
    dropped = {*given, "masses"} if kinematics_only else {*given}
    findings += [f for f in source.findings if f.about not in dropped]
    findings += dynamics_findings(arm, source.bodiless)
    try:
        chain = chain_of(arm, *tips, followers=followers)
    except ModelError as error:
        audit.refuse_unsafe(arm.name, [*map(audit.unsafe, error.findings), *findings])
        raise
    wrong = follower_findings(followers, chain.names, chain.continuous, locked)
    findings += wrong
    written = [source.limits[name] for name in chain.names]
    bounds, crossed = coupled_limits(chain.names, chain, _limits(written, given, chain.names))
    findings += crossed
    bounds, unknown = _without_unknown_torques(arm, chain, bounds, given)
    findings += unknown
    findings += audit.soft_limits(chain.names, written, bounds)
    findings += audit.widened(chain.names, written, given)
    findings += audit.limit_findings(chain.names, bounds, chain.continuous, chain.prismatic)
    findings += audit.friction_findings(chain.names, arm.damping, arm.friction, bounds)
    audit.refuse_unsafe(arm.name, findings)
    led = is_led(chain)
    stated = given.get("a_max", ())
    stated = stated if isinstance(stated, Mapping) or "a_max" not in given else chain.names
    guessed = [
        i for i, name in enumerate(chain.names) if not (led[i] or "a_max" in written[i] or name in stated)
    ]
    if guessed:
        findings.append(_guess(arm, chain, bounds, guessed))
    write_limits(arm, bounds)
    rows = _rows(wishes.get("default_rows", ROWS))
    reach, wanted = reach_of(chain, bounds), wishes.get("length")
    length = LENGTH_FRACTION * reach if wanted is None else positive("length", wanted, "m")
    arms = [Arm(arm, tip, chain, bounds, rows, length) for tip in tips]
    start, said = neutral_posture(arms, wishes.get("neutral"), source.postures)
    return dict(
        name=arm.name, model=arm, tips=tips, chain=chain, limits=bounds,
        neutral=frozen(coupled_places(chain, start)),
        default_rows=rows, length=length, findings=(*findings, *said), shapes=tuple(source.shapes),
    )  # fmt: skip


def _mimics(given: Mapping[str, Any] | None, model: Any) -> dict[str, Follower]:
    """Joints that the user says follow others, (leader, ratio, offset) or some of these, by name."""
    names = [str(name) for name in model.names][1:]
    found: dict[str, Follower] = {}
    for name, how in dict(given or {}).items():
        leader, *numbers = (how,) if isinstance(how, str) else tuple(how)
        for joint in (name, leader):
            if joint not in names:
                raise unknown("joint", joint, model.name, names)
        if len(numbers) > 2 or not all(isinstance(x, (int, float)) for x in numbers):
            raise InputError(
                f"mimics has {how!r:.80} for {name!r}, expected the joint that it follows, or "
                "(joint, ratio, offset) with numbers"
            )
        ratio, offset, *_ = [*numbers, 1.0, 0.0] if not numbers else [*numbers, 0.0]
        found[name] = Follower(leader=leader, ratio=float(ratio), offset=float(offset))
    return found


def _given(wishes: Wishes, count: int) -> dict[str, Any]:
    """The limits that the user gives in place of the model's."""
    limits, changes = wishes.get("limits"), dict[str, Any]()
    if isinstance(limits, JointLimits):
        if len(limits) != count:
            raise InputError(f"limits are of {len(limits)} joints, expected (nv,) = ({count},)")
        changes = {field.name: getattr(limits, field.name) for field in fields(JointLimits)}
    elif isinstance(limits, Mapping):
        changes = dict(limits)
    elif limits is not None:
        raise InputError(f"limits is of type {type(limits).__name__}, expected JointLimits or a mapping")
    if wishes.get("acceleration") is not None:
        changes["a_max"] = wishes["acceleration"]
    return changes


def _limits(
    written: Sequence[Mapping[str, float]], given: Mapping[str, Any], joints: Sequence[str]
) -> JointLimits:
    """The limits as written, replaced by those given; accelerations by rule where nobody gave them."""
    own = {key: np.array([joint[key] for joint in written]) for key in ("q_min", "q_max", "v_max", "tau_max")}
    own["v_max"] = by_joint("v_max", given.get("v_max", own["v_max"]), joints, own["v_max"])
    own["j_max"] = np.array([joint.get("j_max", np.inf) for joint in written])
    rule = JointLimits.of(len(written), **own).a_max
    own["a_max"] = np.array([joint.get("a_max", by) for joint, by in zip(written, rule, strict=True)])
    return JointLimits.of(len(written), **own).replaced({"a_max": own["a_max"], **given}, joints)


def _without_unknown_torques(
    arm: Any, chain: Chain, limits: JointLimits, given: Mapping[str, Any]
) -> tuple[JointLimits, list[Finding]]:
    """Limits without torques of 0 or NaN, unless masses and another joint's torque limit use them."""
    stated = given.get("tau_max", {})
    stated = stated if isinstance(stated, Mapping) else chain.names
    tau, motors = limits.tau_max, ~is_led(chain)
    missing = motors & (np.isnan(tau) | (tau == 0.0)) & ~np.isin(chain.names, list(stated))
    heavy = has_masses(arm)
    if heavy and (np.isfinite(tau) & (tau != 0.0))[motors].any():
        return limits, []
    names = [chain.names[i] for i in np.flatnonzero(missing)]
    kept = limits.replaced({"tau_max": np.where(missing, np.inf, tau)})
    return kept, audit.unknown_torques(names, bool(missing[motors].all()), heavy)


def _guess(arm: Any, chain: Chain, limits: JointLimits, guessed: Sequence[int]) -> Finding:
    """That accelerations follow the rule, with what the torques would allow; a warning where that is less."""
    names = [chain.names[i] for i in guessed]
    joints = "" if len(names) == len(chain.names) else f" for {', '.join(names)}"
    says = f"no acceleration limit is known{joints}; a_max = v_max / {RISE_TIME:g} s is taken"
    remedy = "give acceleration=... to replace it"
    if not has_masses(arm):
        return audit.note(f"{says}; {remedy}", "a_max")
    allowed = acceleration_by_torque(arm, chain, limits)
    figures = ", ".join(
        f"{chain.names[i]} {limits.a_max[i]:.3g} (torque allows {allowed[i]:.3g})"
        if np.isfinite(allowed[i])
        else f"{chain.names[i]} {limits.a_max[i]:.3g} (no torque limit)"
        for i in guessed
    )
    beyond = [chain.names[i] for i in guessed if limits.a_max[i] > allowed[i]]
    more = f", which {', '.join(beyond)} cannot keep up everywhere" if beyond else ""
    said = f"{says}{more}: {figures}, in rad/s2 or m/s2, at the heaviest of {SAMPLES} postures; {remedy}"
    return (audit.warning if beyond else audit.note)(said, "a_max")


def write_limits(arm: Any, limits: JointLimits) -> None:
    """Writes the limits into the pinocchio model, which the tests take for an oracle."""
    for i in range(1, arm.njoints):
        if arm.nqs[i] == 1:
            arm.lowerPositionLimit[arm.idx_qs[i]] = limits.q_min[i - 1]
            arm.upperPositionLimit[arm.idx_qs[i]] = limits.q_max[i - 1]
        arm.velocityLimit[arm.idx_vs[i]] = limits.v_max[i - 1]
        arm.effortLimit[arm.idx_vs[i]] = limits.tau_max[i - 1]


def write_friction(model: Any, viscous: Any, coulomb: Any) -> None:
    """Writes viscous and Coulomb friction into a pinocchio model of a chain; one number holds for all."""
    model.damping = np.broadcast_to(np.asarray(viscous, dtype=np.float64), (model.nv,)).copy()
    model.friction = np.broadcast_to(np.asarray(coulomb, dtype=np.float64), (model.nv,)).copy()


def has_masses(model: Any) -> bool:
    """Whether a body behind a joint has a mass or an inertia."""
    bodies = [model.inertias[i] for i in range(1, model.njoints)]
    return any(body.mass != 0.0 or np.any(body.inertia) for body in bodies)


def _rows(rows: Sequence[str]) -> tuple[str, ...]:
    for row in rows:
        if row not in ROWS:
            raise InputError(f"{row!r} is not a task row; expected some of {', '.join(ROWS)}")
    if not rows:
        raise InputError(f"default_rows is empty; expected some of {', '.join(ROWS)}")
    return tuple(row for row in ROWS if row in rows)
