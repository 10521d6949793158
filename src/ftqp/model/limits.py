"""Joint limits: the record, and the rule that fills in accelerations nobody published."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np

from ftqp.core.checks import FloatArray, IntArray, as_number, frozen, instance, numbers
from ftqp.core.errors import InputError, unknown

RISE_TIME = 0.2
"""Time [s] from rest to v_max where no acceleration limit is known, a_max = v_max / RISE_TIME.

Few URDFs have one. Arms whose makers publish both figures take 0.13 s to 0.29 s (Panda) and
0.16 s (xArm7); 0.2 s is the middle of that range.
"""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointLimits:
    """Limits of every joint, read-only; infinity means no limit.

    Attributes:
        q_min: The lowest position, (nv,) [rad or m].
        q_max: The highest position, (nv,) [rad or m], above q_min.
        v_max: The largest speed, (nv,), > 0 [rad/s or m/s].
        a_max: The largest acceleration, (nv,), > 0 [rad/s2 or m/s2]; it also says how late a joint may brake.
        tau_max: The largest torque or force, (nv,), > 0 [N m or N].
        j_max: The largest jerk, (nv,), > 0 [rad/s3 or m/s3]. Motions to a posture (``ftqp.GoTo``) keep it; a
            tick of the planner has no bound on jerk.
    """

    q_min: FloatArray
    q_max: FloatArray
    v_max: FloatArray
    a_max: FloatArray
    tau_max: FloatArray
    j_max: FloatArray = np.inf  # type: ignore[assignment]  # one number becomes one each

    def __post_init__(self) -> None:
        count = np.size(self.q_min)
        for field in fields(self):
            value = one_each(field.name, getattr(self, field.name), count)
            object.__setattr__(self, field.name, frozen(value))

    @classmethod
    def of(
        cls,
        count: int,
        *,
        q_min: Any = -np.inf,
        q_max: Any = np.inf,
        v_max: Any = np.inf,
        a_max: Any = None,
        tau_max: Any = np.inf,
        j_max: Any = np.inf,
    ) -> Self:
        """Limits of ``count`` joints from arrays (nv,) or one number for all joints.

        Args:
            count: The number of joints nv.
            q_min: The lowest position [rad or m].
            q_max: The highest position [rad or m].
            v_max: The largest speed [rad/s or m/s].
            a_max: The largest acceleration [rad/s2 or m/s2]; None is ``v_max / RISE_TIME``, or no limit
                without v_max.
            tau_max: The largest torque or force [N m or N].
            j_max: The largest jerk [rad/s3 or m/s3].

        Raises:
            InputError: These are no numbers, or as many as neither one nor nv.
        """
        if a_max is None:
            speed = one_each("v_max", v_max, count)
            with np.errstate(over="ignore"):  # such a speed is refused later, in a sentence
                a_max = np.where(speed > 0.0, speed / RISE_TIME, np.inf)
        low = one_each("q_min", q_min, count)
        return cls(q_min=low, q_max=q_max, v_max=v_max, a_max=a_max, tau_max=tau_max, j_max=j_max)

    def __len__(self) -> int:
        """The number of joints nv."""
        return int(self.q_min.size)

    def replaced(self, changes: Mapping[str, Any], joints: Sequence[str] = ()) -> Self:
        """These limits with some of them replaced.

        A new v_max brings the acceleration limit ``v_max / RISE_TIME`` to joints that have none.

        Args:
            changes: New limits by name, each an array (nv,), one number for all joints, or a mapping of
                names of joints to numbers, which leaves the others as they are.
            joints: The names of the joints, (nv,).

        Raises:
            InputError: A limit or a joint is unknown, or a value is not one number or nv of them.
        """
        names = [field.name for field in fields(self)]
        for name in changes:
            if name not in names:
                raise unknown("limit", name, "a robot", names)
        changes = {name: by_joint(name, new, joints, getattr(self, name)) for name, new in changes.items()}
        if "v_max" in changes and "a_max" not in changes and np.isinf(self.a_max).any():
            speed = one_each("v_max", changes["v_max"], len(self))
            changes = {**changes, "a_max": np.where(np.isinf(self.a_max), speed / RISE_TIME, self.a_max)}
        if "q_min" in changes:
            changes = {**changes, "q_min": one_each("q_min", changes["q_min"], len(self))}
        return replace(self, **changes)


def part_of(limits: JointLimits, joints: IntArray) -> JointLimits:
    """The limits of some of the joints."""
    return JointLimits(**{field.name: getattr(limits, field.name)[joints] for field in fields(limits)})


def joined(first: JointLimits, *others: JointLimits) -> JointLimits:
    """The limits of some joints and then of others."""
    parts = (first, *others)
    return JointLimits(
        **{
            field.name: np.concatenate([getattr(part, field.name) for part in parts])
            for field in fields(JointLimits)
        }
    )


def by_joint(name: str, value: Any, joints: Sequence[str], now: Any) -> Any:
    """``value``, or where it is a mapping of names of joints to numbers, ``now`` with those replaced."""
    if not isinstance(value, Mapping):
        return value
    result = np.array(now, dtype=np.float64)
    for joint, number in value.items():
        if joint not in joints:
            raise unknown("joint", joint, f"the limits {name}", joints)
        result[joints.index(joint)] = as_number(f"{name} of {joint}", number)
    return result


def one_each(name: str, value: Any, count: int) -> FloatArray:
    """``value``, one number or one a joint, as a new array (count,); NaN is for the audit to find."""
    result = numbers(name, value, f"; expected shape (nv,) = ({count},)")
    if result.shape == ():
        return np.full(count, float(result))
    if result.shape != (count,):
        raise InputError(f"{name} has shape {result.shape}, expected (nv,) = ({count},)")
    return result


def within_branch(robot: Any, limits: Mapping[str | int, Any]) -> Any:
    """The robot with some joints kept in a range inside their own, (low, high) by name or index."""
    instance("branch_limits", limits, Mapping, "joints with their (low, high), {joint: (low, high)}")
    low, high = robot.limits.q_min.copy(), robot.limits.q_max.copy()
    for joint, ends in limits.items():
        i = robot.joint(joint)
        name = robot.joints[i]
        try:
            first, last = (float(end) for end in ends)
        except (TypeError, ValueError, OverflowError) as error:
            raise InputError(f"branch limits of {name} are {ends!r:.60}, expected (low, high)") from error
        if np.isnan(first) or np.isnan(last):
            raise InputError(f"branch limits of {name} are ({first:g}, {last:g}), expected numbers")
        low[i], high[i] = max(low[i], first), min(high[i], last)
        if not low[i] < high[i]:
            raise InputError(
                f"branch limits of {name} leave nothing: ({first:g}, {last:g}) of its range "
                f"[{robot.limits.q_min[i]:g}, {robot.limits.q_max[i]:g}]"
            )
    return robot.with_limits(q_min=low, q_max=high)
