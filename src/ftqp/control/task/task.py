"""Task: which rows of the pose are followed, with which gains, and what gives way when they cannot be."""

from collections.abc import Iterable
from dataclasses import KW_ONLY, dataclass
from math import isfinite
from typing import Any

import numpy as np

from ftqp.control.task.compatibility import refuse
from ftqp.core.checks import FloatArray, array, instance, positive
from ftqp.core.errors import InputError, nearest
from ftqp.core.pose import rotation_to
from ftqp.core.setting import refuse_out_of_range, setting
from ftqp.kernel.layout.enums import Mode
from ftqp.kernel.layout.rows import COMPONENTS

ROW_SETS: dict[str, tuple[str, ...]] = {
    "pose": COMPONENTS,
    "position": COMPONENTS[:3],
    "position_axis": COMPONENTS[:5],
}
MODES = {mode.name.lower(): mode for mode in Mode}
PRIORITIES = {"weighted": (1.0, 1.0, 1.0, 1.0, 1.0, 1.0), "position_first": (1e-2, 1e-2, 1e-2, 1e2, 1e2, 1e2)}
"""Compliance of each component beside that of the task: position_first weighs position 1e4 times more."""
DEFAULT_GAINS = {"acceleration": (100.0, 20.0), "velocity": (10.0, 0.0)}
"""kp, kv at each level: a critically damped error of 10 rad/s; at the velocity level a decay of 10 1/s."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DirectionalDamping:
    """The task gives way along singular directions only, the more the nearer the singularity is.

    With sigma the singular values of the reduced Jacobian of the healthy joints, its linear rows divided by
    the characteristic length, direction k is damped by factor^2 (1 - (sigma_k/threshold)^2)^2 where sigma_k <
    threshold. The rates that the task then asks for stay below about the wanted twist [lengths/s] over 2
    factor; the derivation is in ``docs/theory/singularities.md``.

    Attributes:
        threshold: The singular value below which damping begins, > 0, without unit; 0.2 is a dozen degrees
            from an elbow singularity. A larger one begins earlier and gives up more of the task on the way.
        factor: The damping at the singularity itself, > 0, without unit. A larger one is calmer and gives up
            more of the task; position tasks may need 0.3.
    """

    threshold: float = setting(0.2, above=0.0)
    factor: float = setting(0.2, above=0.0)

    def __post_init__(self) -> None:
        refuse_out_of_range(self, " of the damping")


@dataclass(frozen=True, slots=True)
class Task:
    """What the end effector has to do, and what gives way when it cannot.

    Args:
        rows: What of the pose is followed: ``pose``, ``position``, ``position_axis`` (position and the
            direction of the tool axis), or names among x, y, z, rx, ry, rz. Fewer rows leave more freedom to
            the scheme and to failures. None takes the robot's own; planar arms follow x and y.
        mode: What happens when limits forbid the task: ``slack`` (default) leaves the smallest weighted
            residual, ``hard`` treats the task as an equality and reports RELAXED when it has no solution,
            ``scaled`` slows down and keeps the direction, ``lexicographic`` first makes the residual as small
            as can be and then minimises the objective.
        kp: Gain on the pose error, >= 0, [1/s2] at the acceleration level and [1/s] at the velocity level. A
            larger one corrects errors faster and passes on more measurement noise; kp dt must stay below 2 at
            the velocity level. None is 100 and 10.
        kv: Gain on the error of the twist, >= 0 [1/s], at the acceleration level only. A larger one damps
            more; kv dt must stay below 2. None is 2 sqrt(kp), critical damping.
        length: The characteristic length that angular rows are multiplied by, > 0 [m]. A larger one makes
            rotation count more next to position. None takes the robot's, a sixth of its reach.
        axis: The tool axis in the tip frame, (3,), for ``position_axis``; its length does not matter.
        slack: How soft the task is, 1e-12 to 1, without unit, relative to the QP's own magnitude, for
            ``slack``. A larger one gives up more of the task near limits and singularities.
        priority: What rotation counts next to position: as much with ``weighted``, and ``position_first``
            leaves to it what position does not need.
        damping: How the task gives way along singular directions, see ``DirectionalDamping``; None never
            does. It goes neither with ``scaled``, whose path waits at a singularity instead, nor with
            ``position_first``.
        calm: Whether the arm comes to rest where the target stands, also out of reach, at a singularity or
            with a failed joint, see ``docs/theory/settling.md``. False leaves the feedback as it is, which
            swings there without end.
        degrade: Which sets of rows may be kept in place of ``rows``, of ``pose``, ``position_axis`` and
            ``position``, the largest first: when a joint swings freely, the largest that can be kept, and
            when the task stays infeasible for 0.2 s and comes no nearer, one after the other. The end
            effector is drawn to what is given up, and it is taken back as soon as it can be held; the status
            is RELAXED meanwhile. None allows all that are part of ``rows`` while a joint swings freely, and
            gives up none otherwise; ``()`` gives up none at all. It takes the kernel's own solver.
        tolerance: The largest error of the measured end effector's position that still counts as following
            the task, > 0 [m]. A larger one says OK and goes on at full speed where the arm lags farther
            behind.
        rotation_tolerance: The same of its rotation, > 0 [rad].

    Raises:
        InputError: A name is unknown, a number is out of its range, or two settings exclude each other.
    """

    rows: str | tuple[str, ...] | None = setting(None)
    _: KW_ONLY
    mode: str = setting("slack", choices=tuple(MODES))
    kp: float | None = setting(None, unit="1/s2 or 1/s", least=0.0)
    kv: float | None = setting(None, unit="1/s", least=0.0)
    length: float | None = setting(None, unit="m", above=0.0)
    axis: tuple[float, float, float] = setting((0.0, 0.0, 1.0))
    priority: str = setting("weighted", choices=tuple(PRIORITIES))
    slack: float = setting(1e-6, above=0.0, most=1.0)
    damping: DirectionalDamping | None = setting(None)
    tolerance: float = 0.01
    rotation_tolerance: float = 0.05
    calm: bool = setting(True)
    degrade: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        if self.rows is not None:
            row_indices(self.rows)
        refuse_out_of_range(self)
        if self.damping is not None and not isinstance(self.damping, DirectionalDamping):
            raise InputError(f"damping is {self.damping!r:.60}, expected an ftqp.DirectionalDamping or None")
        refuse(
            mode=self.mode, priority=self.priority, damping="none" if self.damping is None else "directional"
        )
        positive("tolerance", self.tolerance, "m")
        positive("rotation_tolerance", self.rotation_tolerance, "rad")
        if not 1e-12 <= positive("slack", self.slack) <= 1.0:
            raise InputError(f"slack is {self.slack:g}, expected a share in [1e-12, 1]")
        if isinstance(self.degrade, str):
            raise InputError(f"degrade is {self.degrade!r:.60}, expected several names: ('pose', 'position')")
        for name in self.degrade or ():
            if name not in ROW_SETS:
                raise InputError(
                    f"degrade has {name!r}{nearest(str(name), ROW_SETS)}, "
                    f"expected names among {', '.join(ROW_SETS)}"
                )
        given = tuple(self.degrade or ())
        if given != (largest_first := tuple(sorted(given, key=lambda name: -len(ROW_SETS[name])))):
            raise InputError(f"degrade is {given}, expected the largest set first: {largest_first}")
        if not array("axis", self.axis, (3,)).any():
            raise InputError("axis is zero, expected the direction of the tool in the tip frame")

    @property
    def kept_sets(self) -> tuple[str, ...]:
        """The sets of rows that may be kept of the task, the largest first, the whole among them."""
        indices = row_indices("pose" if self.rows is None else self.rows)
        if indices[-1] < 3:
            possible: tuple[str, ...] = ("position",)
        elif self.rows == "position_axis":
            possible = ("position_axis", "position")
        else:
            possible = ("pose", "position_axis", "position")
        if self.degrade is None:
            return possible
        return tuple(name for name in self.degrade if name in possible) or possible[:1]

    def gains(self, level: str) -> tuple[float, float]:
        """The gains kp and kv that the task has at a level.

        Args:
            level: ``acceleration`` or ``velocity``.
        """
        kp, kv = DEFAULT_GAINS[level]
        if self.kp is not None:
            kp = float(self.kp)
            kv = 2.0 * kp**0.5
        if self.kv is not None:
            kv = float(self.kv)
        return kp, kv


def row_indices(rows: Any) -> tuple[int, ...]:
    """0-based components of a row set, in order."""
    instance("rows", rows, str | Iterable, "pose, position, position_axis or names of rows")
    names = ROW_SETS.get(rows) if isinstance(rows, str) else tuple(rows)
    if names is None:
        valid = (*ROW_SETS, *COMPONENTS)
        raise InputError(
            f"task rows {rows!r} are unknown{nearest(rows, valid)}; expected one of {', '.join(ROW_SETS)}, "
            f"or names among {', '.join(COMPONENTS)}"
        )
    for name in names:
        if name not in COMPONENTS:
            raise InputError(
                f"task row {name!r} is unknown{nearest(str(name), COMPONENTS)}; "
                f"rows are {', '.join(COMPONENTS)}"
            )
    if not names or len(set(names)) != len(names):
        raise InputError(f"task rows are {names!r:.80}, expected at least one row and none twice")
    return tuple(sorted(COMPONENTS.index(name) for name in names))


def axis_frame(axis: Any) -> FloatArray:
    """A rotation, (3, 3), whose third column is the unit vector along ``axis``."""
    z = array("axis", axis, (3,))
    z /= np.abs(z).max()  # squares of what is very large or small would be nothing or infinite
    return rotation_to(z / np.linalg.norm(z))


def checked_gains(task: Any, level: str, dt: float, whose: str = "") -> tuple[float, float]:
    """The gains of a task, if the sampled feedback loop that they make is stable."""
    kp, kv = task.gains(level)
    loop = kp * dt if level == "velocity" else kv * dt
    if not isfinite(loop) or loop >= 2.0:
        name, value = ("kp", kp) if level == "velocity" else ("kv", kv)
        raise InputError(
            f"{name}{whose} is {value:g}, but with dt = {dt:g} s the feedback is unstable; "
            f"expected {name} < {2.0 / dt:g}{'; is dt in milliseconds?' if dt >= 0.5 else ''}"
        )
    return kp, kv


@dataclass(frozen=True, slots=True)
class EmergencyStop:
    """The planner stops when the task error is too large and has risen on ``samples`` consecutive ticks.

    Args:
        position: The position error beyond which a rising error counts, > 0 [m]. A larger one stops later;
            Jin et al. 2017 take 0.01, where the arm starts on its path. The default leaves room for poses
            streamed without twists, behind which the end effector lags.
        rotation: The rotation error beyond which a rising error counts, > 0 [rad]. A larger one stops later.
        samples: How many ticks in a row the error has to rise, >= 1. One stops at the first rise, as in Jin
            et al. 2017; more are less sensitive to noise and later by as many ticks.

    Raises:
        InputError: A threshold is not positive, or ``samples`` is not a whole number from 1.
    """

    position: float = setting(0.05, unit="m", above=0.0)
    rotation: float = setting(0.3, unit="rad", above=0.0)
    samples: int = setting(3, least=1.0)

    def __post_init__(self) -> None:
        refuse_out_of_range(self)
