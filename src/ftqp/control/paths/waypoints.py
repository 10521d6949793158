"""A smooth curve through given points."""

from typing import TYPE_CHECKING, Any, final

import numpy as np

from ftqp.control.paths.path import TIME_SLACK, Motion, Path
from ftqp.core.checks import FloatArray, array, positive
from ftqp.core.errors import InputError
from ftqp.core.pose import pose

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

COINCIDENCE = 1e-6
"""A first waypoint nearer to the start than this counts as the start [m and rad]."""


@final
class Waypoints(Path):
    """A twice continuously differentiable motion through waypoints, from rest to rest.

    Positions follow a clamped cubic spline. Orientations follow a rotation spline in a warped time that
    agrees with the time at every waypoint and stands still at both ends. The start pose comes first unless
    the first waypoint is the start pose.

    Args:
        start: The start pose, (4, 4), where the arm stands at time 0.
        positions: The waypoints in W, (N, 3) [m].
        orientations: Quaternions x, y, z, w of E in W, (N, 4); without them the start orientation is kept.
        times: When each waypoint is reached, rising, (N,) [s]; a waypoint at time 0 must be the start.
        duration: A time over which the waypoints are spread evenly, in place of ``times``, > 0 [s]. A longer
            one is slower.
        relative: Whether positions count from the start position, along W's axes, and not from W's origin.

    Raises:
        InputError: Shapes are wrong, times do not rise, neither or both of times and duration are given, or a
            first waypoint at time 0 is not the start.
    """

    __slots__ = ("_knots", "_position", "_rotation")

    def __init__(
        self,
        start: Any,
        positions: Any,
        *,
        orientations: Any = None,
        times: Any = None,
        duration: float | None = None,
        relative: bool = False,
    ) -> None:
        from scipy.interpolate import CubicSpline  # slow to load, needed for such a path only
        from scipy.spatial.transform import Rotation, RotationSpline

        first = pose(start, "start pose of the path")
        points = _rows("positions of the waypoints", positions, 3) + (first[:3, 3] if relative else 0.0)
        turns = None if orientations is None else _rotations(orientations, len(points))
        distance = float(np.linalg.norm(points[0] - first[:3, 3]))
        upright = Rotation.from_matrix(first[:3, :3])
        angle = 0.0 if turns is None else float((upright.inv() * turns[0]).magnitude())
        at_start = distance <= COINCIDENCE and angle <= COINCIDENCE
        knots = _knots(times, duration, len(points), at_start)
        if knots[0] <= TIME_SLACK and not at_start:
            raise InputError(
                f"the first waypoint has time 0 but is {distance:.4g} m and {angle:.4g} rad from the start "
                "pose; give it a later time, start the arm there, or use relative = true"
            )
        keep = slice(1, None) if at_start else slice(None)
        knots = np.concatenate([[0.0], knots[keep]])
        if len(knots) < 2:
            raise InputError("the only waypoint is the start pose, expected somewhere to go")
        if (np.diff(knots) <= TIME_SLACK).any():
            at = int(np.argmax(np.diff(knots) <= TIME_SLACK))
            raise InputError(
                f"times of the waypoints do not rise after {knots[at]:g} s "
                f"(next is {knots[at + 1]:g} s); sort them"
            )
        super().__init__(first, knots[-1])
        self._knots = knots
        self._position = CubicSpline(knots, np.vstack([first[:3, 3], points[keep]]), bc_type="clamped")
        self._rotation: RotationSpline | None = None
        if turns is not None:
            matrices = np.concatenate([first[None, :3, :3], turns.as_matrix()[keep]])
            self._rotation = RotationSpline(knots, Rotation.from_matrix(matrices))

    def _motion(self, t: FloatArray) -> Motion:
        position, velocity, acceleration = (self._position(t, order) for order in (0, 1, 2))
        if self._rotation is None:
            return Motion(position, velocity, acceleration)
        tau, rate, rate_change = _warp(t, self._knots)
        rotation = self._rotation(tau)
        body_rate, body_change = self._rotation(tau, 1), self._rotation(tau, 2)
        return Motion(
            position=position,
            velocity=velocity,
            acceleration=acceleration,
            rotation=rotation.as_matrix(),
            angular_velocity=rotation.apply(body_rate * rate[:, None]),
            angular_acceleration=rotation.apply(
                body_change * rate[:, None] ** 2 + body_rate * rate_change[:, None]
            ),
        )


def _warp(t: FloatArray, knots: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A time tau(t), and two derivatives, equal to t at every knot, at rest at the first and the last.

    On the first segment tau = t0 + d f(u), f = 6 u^3 - 8 u^4 + 3 u^5, with f' = f'' = 0 at 0, f' = 1 and
    f'' = 0 at 1, on the last one its mirror image, on a single one the quintic law; tau = t between.
    """
    tau, rate, rate_change = t.copy(), np.ones_like(t), np.zeros_like(t)
    rising, falling = t < knots[1], t >= knots[-2]
    if len(knots) == 2:
        d = knots[1] - knots[0]
        u = (t - knots[0]) / d
        return (
            knots[0] + d * u**3 * (10.0 - 15.0 * u + 6.0 * u**2),
            30.0 * u**2 * (1.0 - u) ** 2,
            60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / d,
        )
    for mask, origin, sign, d in (
        (rising, knots[0], 1.0, knots[1] - knots[0]),
        (falling, knots[-1], -1.0, knots[-1] - knots[-2]),
    ):
        u = sign * (t[mask] - origin) / d
        tau[mask] = origin + sign * d * u**3 * (6.0 - 8.0 * u + 3.0 * u**2)
        rate[mask] = u**2 * (18.0 - 32.0 * u + 15.0 * u**2)
        rate_change[mask] = sign * u * (36.0 - 96.0 * u + 60.0 * u**2) / d
    return tau, rate, rate_change


def _knots(times: Any, duration: float | None, count: int, at_start: bool) -> FloatArray:
    """Times of the waypoints as given, or spread evenly over the duration."""
    if (times is None) == (duration is None):
        got = "neither" if times is None else "both"
        raise InputError(f"waypoints got {got} of times and duration, expected exactly one of them")
    if times is not None:
        knots = array("times of the waypoints", times, (count,), "(N,)")
        if knots[0] < -TIME_SLACK:
            raise InputError(f"times of the waypoints start at {knots[0]:g} s, expected times >= 0")
        return knots
    end, least = positive("duration of the path", duration, "s"), (count + 1) * TIME_SLACK
    if end <= least:
        raise InputError(
            f"duration of the path is {end:g} s, expected more than {least:g} s for {count} waypoints"
        )
    return np.linspace(0.0, end, count) if at_start else np.linspace(0.0, end, count + 1)[1:]


def _rows(name: str, value: Any, width: int) -> FloatArray:
    count = len(value) if isinstance(value, list | tuple | np.ndarray) and np.ndim(value) > 0 else 0
    if count == 0:
        raise InputError(f"{name} are {value!r:.60}, expected at least one row of {width} numbers")
    return array(name, value, (count, width), f"(N, {width})")


def _rotations(value: Any, count: int) -> "Rotation":
    from scipy.spatial.transform import Rotation

    quaternions = array("orientations of the waypoints", value, (count, 4), "(N, 4)")
    lengths = np.linalg.norm(quaternions, axis=1)
    if (np.abs(lengths - 1.0) > 1e-3).any():
        worst = int(np.argmax(np.abs(lengths - 1.0)))
        raise InputError(
            f"quaternion {worst} of the waypoints has the length {lengths[worst]:.4g}, expected 1"
        )
    return Rotation.from_quat(quaternions)
