"""What is wrong with a robot model: every finding at once, and refusal of the unsafe ones."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import partial
from typing import Any, Final

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray
from ftqp.core.errors import ModelError
from ftqp.model.limits import JointLimits

TRIANGLE_TOLERANCE = 1e-6
"""Relative slack of the checks of inertias: published figures are rounded to about six digits."""

LARGEST_FIGURE = 1e15
"""No mass, length, inertia or friction of an arm is larger [SI units]; their products stay finite."""
LARGEST_LIMIT = 1e100
"""No limit of a joint that is meant to be one is larger [SI units]."""

IN_DEGREES = 25.0
"""A turning joint with an end stop beyond this, four turns [rad], is probably written in degrees: wrists of
known arms turn by up to 450 deg from their zero, and smaller ranges than +-25 deg are rare."""
MOST_DEGREES = 3600.0
"""Beyond so much a range is no one's degrees but somebody's way to write that there is none. A convention."""
FASTEST = {"turns": 60.0, "slides": 10.0}
"""A joint that is faster [rad/s, m/s] is probably written in degrees or millimetres a second: motors of legs,
the fastest joints of the URDFs at hand, reach 52 rad/s, and linear axes 5 m/s."""
LONGEST = 20.0
"""Joints that are farther apart, and slides that are longer [m], are probably written in millimetres: the
links of the longest arm of the catalog have 7 m. A convention."""

NO_INERTIA = 1e-12
"""Moments of inertia [kg m2] this small are rounding."""

MAGNITUDES = (("v_max", "velocity"), ("a_max", "acceleration"), ("tau_max", "torque"), ("j_max", "jerk"))
"""Limits of a joint that are the same to both sides, with their words."""

FRICTION = "robot.with_friction(viscous=..., coulomb=...)"
CORRECT = "correct the model or drop all masses with kinematics_only=True"


WRONG_TIP: Final = "tip"
"""What a finding is about that says that there is no frame of a name."""
OPEN_TIP: Final = "which tip"
"""What a finding is about that asks which of several ends is the tip."""
UNKNOWN_TORQUE: Final = "tau_max"
"""What a finding is about that says that a file has no torque limits, and that none are kept."""


class Severity(Enum):
    """How bad a finding is."""

    UNSAFE = "the robot is refused"
    WARNING = "the robot can be used, a figure is doubtful"
    NOTE = "nothing is wrong, a choice was made"


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing the audit has to say.

    Attributes:
        severity: How bad it is.
        sentence: What, got, expected, remedy.
        about: What it is about: ``masses``, ``limits``, ``friction``, a limit that a file has or lacks
            (``a_max``, ``j_max``, ``tau_max``), a wrong name of a ``tip``, the question ``which tip``, or
            nothing in particular.
    """

    severity: Severity
    sentence: str
    about: str = ""

    def __str__(self) -> str:
        """The sentence."""
        return self.sentence


unsafe = partial(Finding, Severity.UNSAFE)
"""A finding that makes the robot unusable."""
warning = partial(Finding, Severity.WARNING)
"""A finding that the user should know of."""
note = partial(Finding, Severity.NOTE)
"""A choice that was made for the user."""


def refuse_unsafe(name: str, findings: Iterable[Finding]) -> None:
    """Raises where the robot is unsafe: for a wrong tip alone, a tip to choose first, or every finding."""
    every = sorted(findings, key=lambda finding: finding.severity is not Severity.UNSAFE)
    unsafe_ones = [finding for finding in every if finding.severity is Severity.UNSAFE]
    if not unsafe_ones:
        return
    if all(finding.about == WRONG_TIP for finding in unsafe_ones):
        raise ModelError(f"{name} has no such tip", [finding.sentence for finding in unsafe_ones])
    questions = [finding for finding in unsafe_ones if finding.about == OPEN_TIP]
    if questions:
        others = [finding for finding in unsafe_ones if finding.about != OPEN_TIP]
        raise ModelError(f"{name} needs a tip", [f.sentence for f in (*questions, *others)])
    marks = ["" if f.severity is Severity.UNSAFE else f"({f.severity.name.lower()}) " for f in every]
    sentences = [f"{mark}{f.sentence}" for mark, f in zip(marks, every, strict=True)]
    raise ModelError(f"{name} is unsafe", sentences)


def limit_findings(
    names: Sequence[str], limits: JointLimits, continuous: BoolArray, prismatic: BoolArray
) -> list[Finding]:
    """What is wrong with the limits of every joint."""
    found: list[Finding] = []
    for i, joint in enumerate(names):
        low, high = float(limits.q_min[i]), float(limits.q_max[i])
        wrong = _wrong_range(low, high, joint)
        if wrong:
            found.append(unsafe(f"joint {joint!r} {wrong}", "limits"))
        elif not continuous[i] and (low == -np.inf or high == np.inf):
            found.append(note(f"joint {joint!r} has no position limit on {_open(low, high)}", "limits"))
        for field, what in MAGNITUDES:
            wrong = _wrong_magnitude(float(getattr(limits, field)[i]), what, field, joint)
            if wrong:
                found.append(unsafe(f"joint {joint!r} has {wrong}", "limits"))
    endless = ", ".join(names[i] for i in np.flatnonzero(limits.v_max == np.inf).tolist())
    if endless:
        says = f"no velocity limit is known of {endless}; give limits={{'v_max': ...}}"
        found.append(warning(says, "limits"))
    return found + _unit_findings(names, limits, prismatic)


def _unit_findings(names: Sequence[str], limits: JointLimits, prismatic: BoolArray) -> list[Finding]:
    """Ranges and speeds that look like degrees or millimetres, a sentence for all joints of a kind."""
    ends = np.stack([limits.q_min, limits.q_max])
    far = np.max(np.abs(ends), axis=0, where=np.isfinite(ends), initial=0.0)
    fast = np.where(np.isfinite(limits.v_max), limits.v_max, 0.0)
    found = []
    for slides, unit, other, factor in (
        (False, "rad", "degrees", "np.radians(...)"),
        (True, "m", "millimetres", "0.001 times that"),
    ):
        kind = prismatic == slides
        wide = kind & (far > (LONGEST if slides else IN_DEGREES)) & (far <= MOST_DEGREES)
        for these, key, what in (
            (wide, "q_min and q_max", "a range"),
            (kind & (fast > FASTEST["slides" if slides else "turns"]), "v_max", "a speed"),
        ):
            joints = np.flatnonzero(these).tolist()
            if not joints:
                continue
            per = "/s" if key == "v_max" else ""
            figures = ", ".join(
                f"{names[i]} {fast[i]:g}" if per else f"{names[i]} {ends[0, i]:g} to {ends[1, i]:g}"
                for i in joints
            )
            found.append(
                warning(
                    f"{what} looks like {other}{' a second' if per else ''} in place of {unit}{per}: "
                    f"{figures}; correct the file, or give limits={{...}} with {key}, {factor}",
                    "limits",
                )
            )
    return found


def soft_limits(
    joints: Sequence[str], written: Sequence[Mapping[str, float]], limits: JointLimits
) -> list[Finding]:
    """That a file has soft limits within those that are kept, in a sentence for all joints."""
    sides = (("q_min", "soft_min", 1.0), ("q_max", "soft_max", -1.0))
    inside: dict[str, dict[str, float]] = {
        kept: {
            joint: own[soft]
            for i, (joint, own) in enumerate(zip(joints, written, strict=True))
            if sign * own.get(soft, np.nan) > sign * getattr(limits, kept)[i]
        }
        for kept, soft, sign in sides
    }
    given = ", ".join(f"{kept!r}: {values}" for kept, values in inside.items() if values)
    if not given:
        return []
    named = ", ".join(dict.fromkeys(joint for values in inside.values() for joint in values))
    return [
        warning(
            f"the soft limits of {named} (safety_controller) are narrower than the limits, at which "
            f"ROS controllers stop; the limits are kept, and to keep the soft ones give limits={{{given}}}"
        )
    ]


def unknown_torques(joints: Sequence[str], every: bool, has_masses: bool) -> list[Finding]:
    """That a file has no torque limits (effort 0, or none) where nothing uses them: one sentence."""
    if not joints:
        return []
    named = "every joint" if every else ", ".join(joints)
    says = f"no torque limit is known of {named} (effort 0 or missing)"
    if not has_masses:
        return [note(f"{says}; without masses nothing uses one", UNKNOWN_TORQUE)]
    more = "so torques are not limited, and drive 'torque' is refused; give limits={'tau_max': ...}"
    return [warning(f"{says}, {more}", UNKNOWN_TORQUE)]


def widened(
    joints: Sequence[str], written: Sequence[Mapping[str, float]], given: Mapping[str, Any]
) -> list[Finding]:
    """One number for all joints that lets some of them go beyond what the model allows."""
    found = []
    for field, sign in (("q_min", -1.0), ("q_max", 1.0), ("v_max", 1.0), ("tau_max", 1.0)):
        value = given.get(field)
        if not isinstance(value, int | float):
            continue
        wider = [i for i, limits in enumerate(written) if sign * limits[field] < sign * value]
        if wider and len(joints) > 1:
            all_of_them = ", ".join(f"{joints[i]} {written[i][field]:g}" for i in wider)
            found.append(
                warning(
                    f"{field} = {value:g} for all joints is beyond that of the model for {all_of_them}; to "
                    f"replace one only, give limits={{{field!r}: {{'<joint>': ...}}}}",
                    "limits",
                )
            )
    return found


def _wrong_range(low: float, high: float, joint: str) -> str:
    """What is wrong with position limits, after the joint's name; empty where nothing is."""
    remedy = _remedy(joint, "q_min", "q_max")
    if np.isnan(low) or np.isnan(high):
        remedy = _remedy(joint, "q_min", "q_max", extra="-inf and inf = no limit")
        return f"has a position limit that is missing or not a number, in rad or m; {remedy}"
    if low > high:
        return f"has crossed limits {low:g} > {high:g}; {remedy}"
    if low == high or low == np.inf or high == -np.inf:
        return f"cannot move: both limits are {low:g}; hold it with locked=[{joint!r}], or {remedy}"
    if any(LARGEST_LIMIT < abs(end) < np.inf for end in (low, high)):
        remedy = _remedy(joint, "q_min", "q_max", extra="inf = no limit")
        return f"has the range {low:g} to {high:g}, which no joint has; {remedy}"
    return ""


def _wrong_magnitude(value: float, what: str, field: str, joint: str) -> str:
    """What is wrong with a limit that is the same to both sides; empty where nothing is."""
    a, unlimited = "an" if what[0] in "aeiou" else "a", _remedy(joint, field, extra="inf = no limit")
    if np.isnan(value):
        return f"{a} {what} limit that is missing or not a number; {_remedy(joint, field)}"
    if value == 0.0:
        return f"a zero {what} limit, so it may never move; {unlimited}"
    if value < 0.0:
        return f"{a} {what} limit of {value:g}, expected > 0; {_remedy(joint, field)}"
    if LARGEST_LIMIT < value < np.inf:
        return f"{a} {what} limit of {value:g}, which no joint has; {unlimited}"
    return ""


def _open(low: float, high: float) -> str:
    if low == -np.inf and high == np.inf:
        return "either side"
    return "its lower side" if low == -np.inf else "its upper side"


def _remedy(joint: str, *fields: str, extra: str = "") -> str:
    given = ", ".join(f"{field!r}: {{{joint!r}: ...}}" for field in fields)
    return f"give limits={{{given}}}{' (' + extra + ')' if extra else ''}"


def body_findings(
    label: str, names: Sequence[str], mass: FloatArray, com: FloatArray, inertia: FloatArray
) -> list[Finding]:
    """What is wrong with the masses of bodies.

    The inertia of a moving body must be positive semidefinite about the centre of mass, else the joint-space
    inertia may be indefinite and the optimisation not convex: unsafe. In a part of a body this is a warning,
    for the whole may be sound. An inertia that breaks the triangle inequality A + B >= C of its principal
    moments belongs to no rigid body, and one without mass to no real one, yet both are safe: warnings.

    ``label`` is ``link`` for parts; masses are (count,) [kg], centres of mass (count, 3) [m], inertias about
    them (count, 3, 3) [kg m2].
    """
    found: list[Finding] = []
    for name, m, c, moment in zip(names, mass, com, inertia, strict=True):
        finding = _body_finding(f"{label} {name!r}", float(m), c, moment)
        found += [replace(finding, about="masses")] if finding else []
    return found


def rotor_findings(names: Sequence[str], armature: FloatArray) -> list[Finding]:
    """What is wrong with rotor inertias: each stands on the diagonal of the joint-space inertia."""
    said = "has a rotor inertia (armature) of"
    return [
        unsafe(f"joint {name!r} {said} {value:g}, expected >= 0; {CORRECT}", "masses")
        for name, value in zip(names, armature, strict=True)
        if not 0.0 <= value <= LARGEST_FIGURE
    ]


def length_findings(names: Sequence[str], offset: FloatArray) -> list[Finding]:
    """What is wrong with the places of joints and frames in the joint before them, (count, 3) [m]."""
    found = [
        unsafe(f"{name!r} is {np.abs(place).max():g} m from the joint before it; correct the model")
        for name, place in zip(names, offset, strict=True)
        if not (np.abs(place) <= LARGEST_FIGURE).all()
    ]
    far = np.abs(offset).max(axis=1, initial=0.0)
    most = int(np.argmax(far)) if len(far) else 0
    if not found and len(far) and far[most] > LONGEST:
        found.append(
            warning(
                f"{names[most]!r} is {far[most]:g} m from the joint before it, which looks like millimetres; "
                "lengths are in m: correct the file, as by a scale of 0.001"
            )
        )
    return found


def _body_finding(what: str, mass: float, com: FloatArray, inertia: FloatArray) -> Finding | None:
    if not (np.isfinite(mass) and np.isfinite(com).all() and np.isfinite(inertia).all()):
        return unsafe(f"{what} has a mass, centre of mass or inertia that is not finite; {CORRECT}")
    largest = max(abs(mass), float(np.abs(com).max()), float(np.abs(inertia).max()))
    if largest > LARGEST_FIGURE:
        return unsafe(f"{what} has the figure {largest:g} among its masses, which no arm has; {CORRECT}")
    if mass < 0.0:
        return unsafe(f"{what} has a mass of {mass:g} kg, expected > 0; {CORRECT}")
    principal = np.linalg.eigvalsh(0.5 * (inertia + inertia.T))
    slack = TRIANGLE_TOLERANCE * float(np.abs(principal).max()) + NO_INERTIA
    figures = ", ".join(f"{p:.3g}" for p in principal)
    if principal[0] < -slack:
        sentence = (
            f"{what} has a negative principal moment of inertia ({figures} kg m2), expected >= 0; {CORRECT}"
        )
        return warning(sentence) if what.startswith("link ") else unsafe(sentence)
    if mass == 0.0:
        return warning(f"{what} has no mass")
    if principal[0] + principal[1] < principal[2] - slack:
        return warning(
            f"{what} has principal moments of inertia ({figures} kg m2) that break the triangle inequality: "
            "no rigid body has them"
        )
    return None


def friction_findings(
    names: Sequence[str], viscous: FloatArray, coulomb: FloatArray, limits: JointLimits
) -> list[Finding]:
    """What there is to say about the friction of joints, which is none without masses."""
    found = [
        unsafe(f"joint {name!r} has a {what} of {value:g}, expected >= 0", "friction")
        for what, values in (("viscous friction (damping)", viscous), ("Coulomb friction", coulomb))
        for name, value in zip(names, values, strict=True)
        if not 0.0 <= value <= LARGEST_FIGURE
    ]
    if found or not (viscous.any() or coulomb.any()):
        return found
    sentence = (
        f"joint friction is known: viscous {_span(viscous)} N m s/rad, Coulomb {_span(coulomb)} N m; torques "
        f"count the viscous part; replace it with {FRICTION}"
    )
    found.append(note(sentence, "friction"))
    for i, name in enumerate(names):
        needed = viscous[i] * limits.v_max[i] if viscous[i] else 0.0
        if np.isfinite(needed) and needed > limits.tau_max[i]:
            sentence = (
                f"joint {name!r} needs {needed:.3g} N m against its viscous friction at its speed limit, "
                f"beyond its torque limit of {limits.tau_max[i]:g} N m; correct one of them, {FRICTION}"
            )
            found.append(warning(sentence, "friction"))
    return found


def _span(values: FloatArray) -> str:
    low, high = f"{values.min():.3g}", f"{values.max():.3g}"
    return low if low == high else f"{low} to {high}"
