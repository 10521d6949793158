"""How a robot comes together: joints held, limits completed, audited, then refused or built."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, TypedDict, get_type_hints

import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray, IntArray, array, frozen, positive
from ftqp.core.errors import InputError, ModelError, nearest, unknown
from ftqp.kernel.layout.thresholds import LENGTH_FRACTION
from ftqp.model import audit
from ftqp.model.audit import Finding, note
from ftqp.model.chain import Chain, chain_of, configuration_of, frame_id
from ftqp.model.followers import (
    Follower,
    coupled_columns,
    coupled_limits,
    coupled_places,
    follower_findings,
    is_led,
)
from ftqp.model.limits import RISE_TIME, JointLimits, by_joint
from ftqp.model.posture import (
    NEAR_SINGULAR,
    SAMPLES,
    acceleration_by_torque,
    gravity_torques,
    least_singular_value,
    scaled_jacobian,
)
from ftqp.model.reading.source import Source
from ftqp.model.reduction import reduced, tips_of
from ftqp.model.shape import dynamics_findings, neutral_of, reach_of

NAMES = ("home", "neutral", "ready", "default", "half_sitting")
"""Names under which models keep the posture to start from, the most telling first."""

GOOD = 0.15
"""A simple posture is kept when its sigma_min is at least this share of the characteristic length."""

CANDIDATES = 300
SPREAD = 0.35
"""Candidates lie within this share of the range on either side of its middle."""
FARTHEST = 2.0
"""Largest distance of a candidate from the middle [rad]."""
SLIDE = 0.5
"""Largest distance of a candidate from the middle of an endless slide [m]."""
ROUND = 0.05
"""Candidates are multiples of this [rad or m] ..."""
NARROW = 0.2
"""... but for joints with less range [rad or m], such as fingers: they keep off their limits unrounded, and
do not make a posture regular, as there is little that they can do. Rounding moves a wider one by ROUND/2 at
most, which is less than the (0.5 - SPREAD) NARROW that its candidates are away from its limits."""
WORTH = 0.85
"""A joint goes back to its simple position when that keeps this share of the merit."""
HANDICAP = 0.5
"""Merit of a posture that a motor cannot hold, or that reaches below the base, beside one that is neither."""


class Arm:
    """What the search needs of the joints on the way to one tip."""

    def __init__(
        self, model: Any, tip: str, chain: Chain, limits: JointLimits, rows: Sequence[str], length: float
    ) -> None:
        self.model, self.chain, self.limits = model, chain, limits
        self._rows, self._length = rows, length
        self._data, self._tip = model.createData(), frame_id(model, tip)
        way = chain.way(int(model.frames[self._tip].parentJoint) - 1)
        self.way = np.unique(chain.lead[way])  # who follows is where the leader puts it
        wide = self.way[(limits.q_max - limits.q_min)[self.way] >= NARROW]
        self._useful = wide if wide.size else self.way
        bounded = np.isfinite(limits.q_min) & np.isfinite(limits.q_max)
        self._bounded = self.way[bounded[self.way]]

    def regularity(self, q: FloatArray) -> float:
        """sigma_min of the task's Jacobian over the characteristic length; 0 is singular."""
        q = configuration_of(self.model, self.chain.continuous, coupled_places(self.chain, q))
        J = scaled_jacobian(self.model, self._data, self._tip, q, self._rows, self._length)
        return least_singular_value(coupled_columns(self.chain, J)[:, self._useful]) / self._length

    def merit(self, q: FloatArray) -> float:
        """The regularity, less in the outer quarters of a range, with a motor too weak, or below the base."""
        worth = self.regularity(q) * self._room(q)
        return worth if self.holds(q) and not self._is_low() else worth * HANDICAP

    def holds(self, q: FloatArray) -> bool:
        """Whether every motor can hold the arm at rest at q."""
        q = coupled_places(self.chain, q)
        configuration = configuration_of(self.model, self.chain.continuous, q)
        tau = coupled_columns(self.chain, gravity_torques(self.model, self._data, configuration))
        return bool((np.abs(tau) <= self.limits.tau_max)[self.way].all())

    def _room(self, q: FloatArray) -> float:
        low, high, bounded = self.limits.q_min, self.limits.q_max, self._bounded
        if not bounded.size:
            return 1.0
        nearest = np.minimum(q - low, high - q)[bounded] / (high - low)[bounded]
        return float(np.clip(4.0 * nearest.min(), 0.0, 1.0))

    def _is_low(self) -> bool:
        """Whether a joint behind the second, or the tip, is below the first joint."""
        pull, data = self.chain.gravity, self._data
        frame = self.model.frames[self._tip]
        end = data.oMi[frame.parentJoint] * frame.placement
        places = [data.oMi[i + 1].translation for i in self.way[2:].tolist()] + [end.translation]
        first = data.oMi[int(self.way[0]) + 1].translation
        return any(float(pull @ (place - first)) > 1e-9 for place in places)


def neutral_posture(
    arms: Sequence[Arm], wanted: Any, named: Mapping[str, Mapping[str, float]]
) -> tuple[FloatArray, list[Finding]]:
    """The neutral configuration, (nv,), as ``Robot.from_pinocchio`` has it, and what is to be said of it."""
    arm = arms[0]
    if isinstance(wanted, str):
        if not named:
            raise InputError(f"{arm.model.name} names no posture, got {wanted!r}; give (nv,) positions")
        if wanted not in named:
            raise unknown("posture", wanted, arm.model.name, list(named))
        q = _posture(arm, named[wanted])
        if q is None:
            raise InputError(
                f"the posture {wanted!r} does not place every joint of {arm.model.name}; give neutral=[...], "
                "(nv,) positions"
            )
        wanted = q
    if wanted is not None:
        return _inside(arm, wanted), []
    simple = neutral_of(arm.limits, None)
    lower = {name.lower(): name for name in named}
    for name in (lower[name] for name in NAMES if name in lower):
        q = _posture(arm, named[name])
        if q is None or ((q < arm.limits.q_min) | (q > arm.limits.q_max)).any():
            continue
        if all(each.regularity(q) >= NEAR_SINGULAR for each in arms):
            return q, [note(f"neutral is the posture {name!r} of the model")]
    start, free = simple, np.ones(len(simple), dtype=np.bool_)
    for each in arms:
        if each.regularity(start) < GOOD or not each.holds(start):
            start = _searched(each, start, np.flatnonzero(free[each.way]))
        free[each.way] = False
    return start, []


def _searched(arm: Arm, simple: FloatArray, free: IntArray) -> FloatArray:
    """The best of the candidates, or ``simple`` where none is better; ``free`` are places in ``arm.way``."""
    joints = arm.way[free]
    best, most = simple, arm.merit(simple)
    for positions in _candidates(arm, simple, joints):
        q = simple.copy()
        q[joints] = positions
        worth = arm.merit(q)
        if worth > most:
            best, most = q, worth
    enough = WORTH * most
    for i in joints:
        tried = best.copy()
        tried[i] = simple[i]
        if arm.merit(tried) >= enough:
            best = tried
    return best


def _candidates(arm: Arm, simple: FloatArray, joints: IntArray) -> FloatArray:
    """Positions of joints round the middle of their range, (CANDIDATES, n): a sequence that fills a box.

    Source: Roberts 2018, the additive (Kronecker) recurrence with the powers of 1/phi, phi^(n + 1) = phi + 1.
    """
    n, limits = len(joints), arm.limits
    phi = 2.0
    for _ in range(60):
        phi = (1.0 + phi) ** (1.0 / (n + 1))
    steps = phi ** -np.arange(1.0, n + 1)
    unit = (0.5 + np.arange(1, CANDIDATES + 1)[:, None] * steps) % 1.0
    bounded = np.isfinite(limits.q_min) & np.isfinite(limits.q_max)
    with np.errstate(invalid="ignore"):
        middle = np.where(bounded, 0.5 * (limits.q_min + limits.q_max), simple)
        open_side = np.minimum(middle - limits.q_min, limits.q_max - middle)
        span = SPREAD * np.where(bounded, limits.q_max - limits.q_min, 2.0 * open_side)
    span = np.minimum(span, np.where(arm.chain.prismatic & ~bounded, SLIDE, FARTHEST))
    q = middle[joints] + span[joints] * (2.0 * unit - 1.0)
    with np.errstate(invalid="ignore"):
        narrow = (limits.q_max - limits.q_min)[joints] < NARROW
    rounded = np.where(narrow, q, ROUND * np.round(q / ROUND))
    result: FloatArray = np.clip(rounded, limits.q_min[joints], limits.q_max[joints])
    return result


def _posture(arm: Arm, positions: Mapping[str, float]) -> FloatArray | None:
    """A named posture as (nv,) positions; None where it leaves a joint out."""
    if not set(arm.chain.names) <= set(positions):
        return None
    return np.array([positions[name] for name in arm.chain.names])


def _inside(arm: Arm, wanted: Any) -> FloatArray:
    """What the user gives, which must lie inside the limits."""
    limits = arm.limits
    start = array("neutral", wanted, (len(limits),), "(nv,)")
    outside = np.flatnonzero((start < limits.q_min) | (start > limits.q_max))
    if outside.size:
        i = int(outside[0])
        raise InputError(
            f"neutral[{i}] is {start[i]:g}, expected a position from {limits.q_min[i]:g} to "
            f"{limits.q_max[i]:g}"
        )
    return start


ROWS = ("x", "y", "z", "rx", "ry", "rz")
"""Names of the task rows: linear then angular, along the axes of W."""


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
