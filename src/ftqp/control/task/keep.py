"""Keep: points of the arm in half-spaces and boxes, axes in cones; the kinds of tasks and constraints."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, pi
from typing import Any, NamedTuple, final

import numpy as np

from ftqp.control.task.soft_tasks import (
    AXES,
    AxisTask,
    CentreOfMass,
    JointTask,
    PoseTask,
    PositionTask,
    PostureTask,
    RelativeTask,
    SoftTask,
    Three,
    direction,
)
from ftqp.core.checks import FloatArray, array, frozen
from ftqp.core.errors import InputError
from ftqp.core.setting import REQUIRED, refuse_out_of_range, setting
from ftqp.model.robot import Robot

PLANE, BOX, CONE = "plane", "box", "cone"
UP = (0.0, 0.0, 1.0)
"""The vertical of the world, and the z axis of a frame. A convention."""
SHAPES = {"above": PLANE, "inside": BOX, "along": CONE}
"""What a point or an axis is kept to, by the argument that says so."""
OWN = {PLANE: ("normal", "point"), BOX: ("point",), CONE: ("axis", "within")}
"""The further arguments that each takes."""
Corners = tuple[tuple[float, float, float], tuple[float, float, float]] | None


class Side(NamedTuple):
    """A row of the QP: normal'p >= offset of a point p, or an angle to ``normal`` of at most ``offset``."""

    name: str  # Which of several it is, for example ``x low``; empty of one
    normal: FloatArray  # Into the side that is free, or the middle of a cone, of length 1, (3,)
    offset: float  # The plane's distance from the origin along its normal [m], or the angle [rad]


@dataclass(frozen=True, slots=True)
class Keep:
    """A point of the arm stays on its side of a plane or in a box, or an axis of it in a cone.

    One of ``above``, ``inside`` and ``along`` says which: the elbow stays above a table, the tool in its part
    of the cell, a full cup nearly upright. It goes before the task of the end effector, which gives way as
    its mode says. Point and axis are those of the arm as the planner commands it; a link has a size, and an
    arm lags, so that a plane has to keep a distance.

    Args:
        frame: A frame, link or joint of the robot's model, whose origin is meant.
        above: A place on the plane, (3,) [m].
        normal: Across the plane, into the side that is free, (3,); its length does not matter. None is the
            vertical, so that the point stays above the place.
        inside: The lowest and the highest corner of the box, along the axes of the world, (2, 3), -inf
            and inf where a side is left out [m].
        along: The middle of the cone, a direction in the world, (3,); its length does not matter.
        within: How far the axis may lean from ``along``, > 0 and < pi [rad].
        axis: The axis that stays in the cone, in the frame, (3,); its length does not matter. None is z.
        point: Another point of that frame, (3,) [m]; None is its origin.
        braking: How hard the arm can surely brake the point, or the axis, > 0 [m/s2 or rad/s2]. A larger
            number lets it come nearer faster, and is not kept where the joints cannot brake so hard.
        name: What ``planner.constraints`` and explanations call it; None is the frame.

    Raises:
        InputError: A number is out of range, a shape is wrong, or what is given does not belong together.
    """

    frame: str = setting(REQUIRED)
    above: Any = setting(None, of=Three, unit="m", kw_only=True)
    normal: Any = setting(None, of=Three, kw_only=True)
    inside: Any = setting(None, of=Corners, unit="m", infinite=True, kw_only=True)
    along: Any = setting(None, of=Three, kw_only=True)
    within: float | None = setting(None, unit="rad", above=0.0, below=pi, kw_only=True)
    axis: Any = setting(None, of=Three, kw_only=True)
    point: Any = setting(None, of=Three, unit="m", kw_only=True)
    braking: float = setting(1.0, unit="m/s2 or rad/s2", above=0.0, kw_only=True)
    name: str | None = setting(None, kw_only=True)

    def __post_init__(self) -> None:
        refuse_out_of_range(self)
        if self.name is not None and not (isinstance(self.name, str) and self.name):
            raise InputError(f"name is {self.name!r:.60}, expected a word such as 'elbow', or None")
        self._refuse_mixtures()
        found: dict[str, Any] = {}
        if self.shape == CONE:
            found["along"] = direction("along", self.along)
            found["axis"] = direction("axis", UP if self.axis is None else self.axis)
        else:
            point = (0.0, 0.0, 0.0) if self.point is None else self.point
            found["point"] = frozen(array("point", point, (3,), "(3,)"))
        if self.shape == PLANE:
            found["above"] = frozen(array("above", self.above, (3,), "(3,)"))
            found["normal"] = direction("normal", UP if self.normal is None else self.normal)
        elif self.shape == BOX:
            found["inside"] = _corners(self.inside)
        for name, value in found.items():
            object.__setattr__(self, name, value)

    def _refuse_mixtures(self) -> None:
        given = [name for name in SHAPES if getattr(self, name) is not None]
        if len(given) != 1:
            raise InputError(
                f"{self.label} has {' and '.join(given) or 'neither above, inside nor along'}, expected one "
                "of them: above=(x, y, z) for a plane, inside=(low, high) for a box, along=(x, y, z) for a "
                "cone of an axis"
            )
        for name in sorted({one for every in OWN.values() for one in every} - set(OWN[self.shape])):
            if getattr(self, name) is not None:
                belongs = next(by for by, shape in SHAPES.items() if name in OWN[shape])
                raise InputError(
                    f"{self.label} has {name} together with {given[0]}, expected it only with {belongs}; "
                    "leave it out"
                )
        if self.shape == CONE and self.within is None:
            raise InputError(
                f"{self.label} has along without within, expected how far the axis may lean from it [rad], "
                "for example within=0.3"
            )
        if self.within is not None and self.within >= pi:
            raise InputError(
                f"within is {self.within:g} rad, expected less than pi, any direction; are these degrees?"
            )

    @property
    def label(self) -> str:
        """What it is called."""
        return self.name or str(self.frame)

    @property
    def shape(self) -> str:
        """``plane``, ``box`` or ``cone``."""
        return next(shape for name, shape in SHAPES.items() if getattr(self, name) is not None)

    @property
    def unit(self) -> str:
        """The unit of its distance."""
        return "rad" if self.shape == CONE else "m"

    @property
    def sides(self) -> tuple[Side, ...]:
        """Its rows of the QP: one of a plane or a cone, of a box one for each side that is not left out."""
        if self.shape == PLANE:
            return (Side("", self.normal, float(np.dot(self.normal, self.above))),)
        if self.shape == CONE:
            assert self.within is not None
            return (Side("", self.along, float(self.within)),)
        every = (
            Side(f"{axis} {end}", frozen(sign * np.eye(3)[k]), float(sign * corner[k]))
            for k, axis in enumerate(AXES)
            for end, sign, corner in (("low", 1.0, self.inside[0]), ("high", -1.0, self.inside[1]))
        )
        return tuple(side for side in every if side.offset > -inf)

    def distance(self, T: FloatArray) -> float:
        """How far it is from the nearest of its sides, positive where it should be [m, of a cone rad].

        Args:
            T: The pose of the frame in the world, (4, 4) [m].
        """
        if self.shape == CONE:
            axis, (side,) = T[:3, :3] @ self.axis, self.sides
            away = np.linalg.norm(np.cross(axis, side.normal))
            return side.offset - float(np.arctan2(away, axis @ side.normal))
        point = T[:3, :3] @ self.point + T[:3, 3]
        return min(float(side.normal @ point) - side.offset for side in self.sides)


def _corners(value: Any) -> FloatArray:
    """The corners of a box, (2, 3)."""
    found = array("inside", value, (2, 3), "(2, 3)", finite=False)
    low, high = found
    if not (low < high).all():
        k = int(np.flatnonzero(low >= high)[0])
        raise InputError(
            f"inside goes from {low[k]:g} to {high[k]:g} along {AXES[k]}, expected the lowest corner first "
            "and room between them"
        )
    if not np.isfinite(found).any() or (low == inf).any() or (high == -inf).any():
        raise InputError(
            f"inside is {found.tolist()}, expected a finite side at least, -inf only in the lowest corner "
            "and inf only in the highest"
        )
    return frozen(found)


@final
@dataclass(frozen=True, slots=True)
class TorqueLimits:
    """No joint needs more torque than its ``tau_max``: |M a + h| <= tau_max.

    This is what ``ftqp.Planner(torque_limits=True)`` asks for, as an entry of ``constraints``. Every planner
    of an arm with masses and torque limits has them unless ``torque_limits=False``; who lists them gets a
    warning where they could have no effect.
    """

    @property
    def label(self) -> str:
        """What it is called."""
        return "torque limits"

    def refuse_without_effect(self, robot: Robot, wanted: bool) -> None:
        """Refuse what could not be kept.

        Args:
            robot: The arm.
            wanted: The planner's ``torque_limits``.

        Raises:
            InputError: The planner is to leave torque limits out, or the arm has no masses or no limits.
        """
        if not wanted:
            raise InputError(
                "constraints has TorqueLimits together with torque_limits=False, expected one of them; leave "
                "torque_limits out to have torque limits, or TorqueLimits to have none"
            )
        if not robot.has_inertia:
            raise InputError(
                f"constraints has TorqueLimits, which need masses, and {robot.name} has none; leave them out "
                "or give the model its masses"
            )
        if not np.isfinite(robot.limits.tau_max).any():
            raise InputError(
                f"constraints has TorqueLimits, and {robot.name} has no torque limit; leave them out or give "
                "it some by robot.with_limits(tau_max=...)"
            )


KINDS: Mapping[str, type[SoftTask]] = {
    "pose": PoseTask,
    "relative": RelativeTask,
    "position": PositionTask,
    "axis": AxisTask,
    "centre_of_mass": CentreOfMass,
    "posture": PostureTask,
    "joints": JointTask,
}
"""Of tasks, ``[[tasks]]``; a function of one's own can only be given in Python."""

KEPT = "keep"
"""The kind of a constraint that does not say its kind."""

CONSTRAINT_KINDS: Mapping[str, type[Any]] = {KEPT: Keep}
"""Of constraints, ``[[constraints]]``."""
