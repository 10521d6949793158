"""The figures of paths: hold, line, point to point, circle, Lissajous figure and square."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, final

import numpy as np

from ftqp.control.paths import laws
from ftqp.control.paths.path import DURATION, Motion, Path
from ftqp.core.checks import FloatArray, array, positive
from ftqp.core.errors import InputError, unknown
from ftqp.core.pose import pose
from ftqp.core.setting import Setting, Settings
from ftqp.kernel.layout.thresholds import TIME_SLACK

_NAMED: dict[str, tuple[float, float, float]] = {
    "x": (1.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0),
    "z": (0.0, 0.0, 1.0),
    "-x": (-1.0, 0.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
    "-z": (0.0, 0.0, -1.0),
}
PERPENDICULAR_TOLERANCE = 1e-6
"""Largest cosine between two axes of a plane that still counts as perpendicular [-]. A convention, so that
numbers which a file gives to six digits pass."""

Axis = str | Sequence[float] | FloatArray
"""A direction in W: x, y, z, -x, -y, -z, or a vector (3,) whose length does not matter."""
_WRITTEN = Literal["x", "y", "z", "-x", "-y", "-z"] | tuple[float, ...]
AXES = Setting(
    "two perpendicular directions in W, each x, y, z, -x, -y, -z or a vector", of=tuple[_WRITTEN, _WRITTEN]
)
_SIDES = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
_CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def axis(value: Any, name: str = "axis") -> FloatArray:
    """The unit vector (3,) of a named or given direction in W."""
    if isinstance(value, str):
        if value not in _NAMED:
            raise unknown("direction", value, f"the {name}", _NAMED)
        return np.array(_NAMED[value])
    vector = array(name, value, (3,))
    length = float(np.linalg.norm(vector))
    if length == 0.0:
        raise InputError(f"{name} is the zero vector, expected a direction")
    unit: FloatArray = vector / length
    return unit


def plane(axes: Any) -> tuple[FloatArray, FloatArray]:
    """The two perpendicular unit vectors, (3,) each, that span the plane of a path."""
    if isinstance(axes, str) or not isinstance(axes, Sequence | np.ndarray) or len(axes) != 2:
        raise InputError(f'axes is {axes!r:.60}, expected two directions such as ("x", "y")')
    first, second = axis(axes[0], "first axis"), axis(axes[1], "second axis")
    cosine = float(first @ second)
    if abs(cosine) > PERPENDICULAR_TOLERANCE:
        raise InputError(f"axes of the plane have the cosine {cosine:.3g}, expected perpendicular directions")
    return first, second


class Figure(Path):
    """A path whose way is gone by a law of motion."""

    __slots__ = ("_law",)

    def __init__(self, start: Any, duration: float, law: str | Mapping[str, Any] | laws.Law) -> None:
        super().__init__(start, duration)
        self._law = laws.by_name(law)

    def _motion(self, t: FloatArray) -> Motion:
        return self._along(*self._law.sample(t / self.duration))

    @abstractmethod
    def _along(self, s: FloatArray, ds: FloatArray, dds: FloatArray) -> Motion:
        """The motion at shares s of the way, (K,), with their derivatives by the share of the time."""


@final
class Hold(Path):
    """The end effector keeps its start pose: p(t) = p0, R(t) = R0.

    It serves a base that moves, or a joint that fails at rest.

    Args:
        start: The start pose, (4, 4), where the arm stands at time 0.
        duration: How long the pose is held, > 0 [s].
    """

    __slots__ = ()

    settings: ClassVar[Settings] = {"duration": DURATION}

    def __init__(self, start: Any, *, duration: float) -> None:
        super().__init__(start, duration)

    def _motion(self, t: FloatArray) -> Motion:
        still = np.zeros((len(t), 3))
        return Motion(position=still + self.start[:3, 3], velocity=still, acceleration=still)


@final
class Line(Figure):
    """p(t) = p0 + s(t/T) d, with the start orientation kept.

    Args:
        start: The start pose, (4, 4), where the arm stands at time 0.
        displacement: The way d from start to end along W's axes, (3,) [m].
        duration: How long the motion lasts, T, > 0 [s]. A longer one is slower: speeds fall with 1/T and
            accelerations with 1/T^2.
        law: How the way depends on the time: a name, a table, or a ``laws.Law``. Laws that begin and end at
            rest ask for higher peak speeds than ``constant``, which jumps.
    """

    __slots__ = ("_displacement",)

    settings: ClassVar[Settings] = {
        "duration": DURATION,
        "displacement": Setting(unit="m", of=tuple[float, float, float]),
        "law": laws.LAW,
    }

    def __init__(
        self,
        start: Any,
        displacement: Any,
        *,
        duration: float,
        law: str | Mapping[str, Any] | laws.Law = "quintic",
    ) -> None:
        super().__init__(start, duration, law)
        self._displacement = array("displacement of the line", displacement, (3,))
        if not self._displacement.any():
            raise InputError("displacement of the line is zero, expected a way to go [m]")

    def _along(self, s: FloatArray, ds: FloatArray, dds: FloatArray) -> Motion:
        return Motion(
            position=self.start[:3, 3] + np.outer(s, self._displacement),
            velocity=np.outer(ds / self.duration, self._displacement),
            acceleration=np.outer(dds / self.duration**2, self._displacement),
        )


@final
class PointToPoint(Figure):
    """p(t) = p0 + s (p1 - p0), R(t) = R0 exp(s log(R0' R1)): straight line, rotation about one fixed axis.

    Half a turn has two shortest ways; one of them is taken.

    Args:
        start: The start pose, (4, 4), where the arm stands at time 0.
        goal: The end pose, (4, 4), another than the start.
        duration: How long the motion lasts, T, > 0 [s]. A longer one is slower: speeds fall with 1/T and
            accelerations with 1/T^2.
        law: How the way depends on the time: a name, a table, or a ``laws.Law``. Laws that begin and end at
            rest ask for higher peak speeds than ``constant``, which jumps.
    """

    __slots__ = ("_displacement", "_first", "_turn")

    def __init__(
        self, start: Any, goal: Any, *, duration: float, law: str | Mapping[str, Any] | laws.Law = "quintic"
    ) -> None:
        from scipy.spatial.transform import Rotation  # slow to load, needed for such a path only

        super().__init__(start, duration, law)
        end = pose(goal, "goal pose")
        self._displacement = end[:3, 3] - self.start[:3, 3]
        self._first = Rotation.from_matrix(self.start[:3, :3])
        self._turn = (self._first.inv() * Rotation.from_matrix(end[:3, :3])).as_rotvec()
        if not self._displacement.any() and not self._turn.any():
            raise InputError("goal pose equals the start pose, expected somewhere to go")

    def _along(self, s: FloatArray, ds: FloatArray, dds: FloatArray) -> Motion:
        from scipy.spatial.transform import Rotation

        rate, rate_change = ds / self.duration, dds / self.duration**2
        axis = self._first.apply(self._turn)
        return Motion(
            position=self.start[:3, 3] + np.outer(s, self._displacement),
            velocity=np.outer(rate, self._displacement),
            acceleration=np.outer(rate_change, self._displacement),
            rotation=(self._first * Rotation.from_rotvec(np.outer(s, self._turn))).as_matrix(),
            angular_velocity=np.outer(rate, axis),
            angular_acceleration=np.outer(rate_change, axis),
        )


@final
class Circle(Figure):
    """p(t) = c + r (cos(phi) a + sin(phi) b), c = p0 - r a, phi = 2 pi n s(t/T), the start orientation kept.

    The phase 2 pi sin^2(pi t / 2T) of the literature on redundant arms is the law ``sine_squared``.

    Args:
        start: The start pose, (4, 4), the point of the circle farthest along a.
        radius: The radius r, > 0 [m]. A larger one makes the end effector faster in proportion.
        duration: How long the motion lasts, T, > 0 [s]. A longer one is slower: speeds fall with 1/T and
            accelerations with 1/T^2.
        law: How the way depends on the time: a name, a table, or a ``laws.Law``. Laws that begin and end at
            rest ask for higher peak speeds than ``constant``, which jumps.
        axes: The directions a and b in W, perpendicular to each other.
        turns: How many times round, n, > 0 and at most 1e6; it need not be whole.
    """

    __slots__ = ("_angle", "_basis")

    settings: ClassVar[Settings] = {
        "duration": DURATION,
        "radius": Setting(unit="m", above=0.0),
        "axes": AXES,
        "turns": Setting(above=0.0, most=1e6),
        "law": laws.LAW,
    }

    def __init__(
        self,
        start: Any,
        radius: float,
        *,
        duration: float,
        law: str | Mapping[str, Any] | laws.Law = "quintic",
        axes: tuple[Axis, Axis] = ("x", "y"),
        turns: float = 1.0,
    ) -> None:
        super().__init__(start, duration, law)
        self._basis = positive("radius of the circle", radius, "m") * np.stack(plane(axes))
        self._angle = 2.0 * np.pi * positive("turns of the circle", turns)

    def _along(self, s: FloatArray, ds: FloatArray, dds: FloatArray) -> Motion:
        phase = self._angle * s
        rate = (self._angle / self.duration * ds)[:, None]
        rate_change = (self._angle / self.duration**2 * dds)[:, None]
        outward = np.stack([np.cos(phase), np.sin(phase)], axis=1)
        along = np.stack([-np.sin(phase), np.cos(phase)], axis=1)
        return Motion(
            position=self.start[:3, 3] + (outward - np.array([1.0, 0.0])) @ self._basis,
            velocity=(rate * along) @ self._basis,
            acceleration=(rate_change * along - rate**2 * outward) @ self._basis,
        )


@final
class Lissajous(Figure):
    """p(t) = p0 + A_a (sin(w_a s) a) + A_b (sin(w_b s + d) - sin(d)) b, w = 2 pi n; the orientation is kept.

    Args:
        start: The start pose, (4, 4), where the arm stands at time 0.
        amplitudes: A_a and A_b, (2,), >= 0 and not both 0 [m]. Larger ones are faster in proportion.
        cycles: How often each direction swings, n_a and n_b, (2,), > 0, without unit; whole numbers close the
            figure.
        phase: The phase d of the second direction [rad]; cycles (1, 2) with 0 give the figure eight.
        duration: How long the motion lasts, T, > 0 [s]. A longer one is slower: speeds fall with 1/T and
            accelerations with 1/T^2.
        law: How the way depends on the time: a name, a table, or a ``laws.Law``. Laws that begin and end at
            rest ask for higher peak speeds than ``constant``, which jumps.
        axes: The directions a and b in W, perpendicular to each other.
    """

    __slots__ = ("_basis", "_frequency", "_phase")

    settings: ClassVar[Settings] = {
        "duration": DURATION,
        "amplitudes": Setting("how far each direction swings, >= 0", unit="m", of=tuple[float, float]),
        "cycles": Setting(of=tuple[float, float]),
        "phase": Setting(unit="rad"),
        "axes": AXES,
        "law": laws.LAW,
    }

    def __init__(
        self,
        start: Any,
        amplitudes: Any,
        *,
        duration: float,
        cycles: Any = (1.0, 2.0),
        phase: float = 0.0,
        law: str | Mapping[str, Any] | laws.Law = "quintic",
        axes: tuple[Axis, Axis] = ("x", "y"),
    ) -> None:
        super().__init__(start, duration, law)
        amplitude = array("amplitudes of the Lissajous figure", amplitudes, (2,))
        if (amplitude < 0.0).any() or not amplitude.any():
            raise InputError(
                f"amplitudes of the Lissajous figure are {amplitude}, expected two lengths >= 0 m, not both 0"
            )
        count = array("cycles of the Lissajous figure", cycles, (2,))
        if (count <= 0.0).any():
            raise InputError(f"cycles of the Lissajous figure are {count}, expected two numbers > 0")
        self._basis = amplitude[:, None] * np.stack(plane(axes))
        self._frequency = 2.0 * np.pi * count
        self._phase = np.array([0.0, float(array("phase of the Lissajous figure", phase, ()))])

    def _along(self, s: FloatArray, ds: FloatArray, dds: FloatArray) -> Motion:
        angle = np.outer(s, self._frequency) + self._phase
        rate = np.outer(ds / self.duration, self._frequency)
        rate_change = np.outer(dds / self.duration**2, self._frequency)
        sine, cosine = np.sin(angle), np.cos(angle)
        return Motion(
            position=self.start[:3, 3] + (sine - np.sin(self._phase)) @ self._basis,
            velocity=(cosine * rate) @ self._basis,
            acceleration=(cosine * rate_change - sine * rate**2) @ self._basis,
        )


@final
class Square(Path):
    """p(t) = P_k + s(u) (P_{k+1} - P_k) with the sides in the order +a, +b, -a, -b, a quarter of T each.

    Args:
        start: The start pose and first corner, (4, 4).
        side: The length of a side, > 0 [m]. A longer one makes the end effector faster in proportion.
        duration: How long all four sides take, T, > 0 [s]. A longer one is slower.
        law: How the way along each side depends on the time: a name, a table, or a ``laws.Law``. Laws that
            begin and end at rest ask for higher peak speeds than ``constant``, which jumps.
        axes: The directions a and b in W, perpendicular to each other.

    Source: the square task of Jin et al. 2017, with each side at rest at its corners
    (``docs/evidence/jin2017.md``).
    """

    __slots__ = ("_basis", "_law")

    settings: ClassVar[Settings] = {
        "duration": DURATION,
        "side": Setting(unit="m", above=0.0),
        "axes": AXES,
        "law": laws.LAW,
    }

    def __init__(
        self,
        start: Any,
        side: float,
        *,
        duration: float,
        law: str | Mapping[str, Any] | laws.Law = "quintic",
        axes: tuple[Axis, Axis] = ("x", "y"),
    ) -> None:
        super().__init__(start, duration)
        self._law = laws.by_name(law)
        self._basis = positive("side of the square", side, "m") * np.stack(plane(axes))

    def _motion(self, t: FloatArray) -> Motion:
        quarter = 0.25 * self.duration
        index = np.minimum(np.floor((t + TIME_SLACK) / quarter), 3.0)
        u = np.maximum(t / quarter - index, 0.0)
        u[t >= self.duration] = 1.0
        k = index.astype(np.int64)
        s, ds, dds = self._law.sample(u)
        direction = _SIDES[k] @ self._basis
        way = _CORNERS[k] + s[:, None] * _SIDES[k]
        return Motion(
            position=self.start[:3, 3] + way @ self._basis,
            velocity=(ds / quarter)[:, None] * direction,
            acceleration=(dds / quarter**2)[:, None] * direction,
        )
