"""A path as a table that the compiled step reads at any progress, as accurate as needed."""

from typing import Any

import numpy as np

from ftqp.control.paths.path import Path, PathSample
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.kernel.layout import flat_arrays as layout

FIRST_INTERVALS = 20
"""Intervals before any is halved; corners at quarters, fifths and tenths of the path fall on their ends."""
TOLERANCE = 2e-10
"""Largest error of the pose at the points that are checked [m, rad]; between them it stays below 1e-9. What
lies between is measured by tests/control/following/test_path_follower.py."""
RATE_TOLERANCE = 1e-8
"""Largest error of the twist there [m/s, rad/s]."""
NARROWEST = 1e-8
"""An interval as short as this holds a jump and is left alone [s]. Some million units of rounding of a path's
time."""
STRAIGHT = 1e-5
"""In an interval shorter than this the path is straight: curvature would be rounding [s]. Rounding, 1e-16 of
a metre, over the square of it is 1e-6 m/s2."""
LEFT = 2e-9
"""How long before an end the twist that holds up to it is taken [s]. Longer than rounding of the path's time,
shorter than NARROWEST."""
JUMP = 1e-6
"""A change of the twist at one time by more than this is a jump [m/s, rad/s]. Two digits above
RATE_TOLERANCE, because errors of the table are no jumps."""
LARGEST = 1 << 18
"""Intervals at most."""
CHECKED = (0.2, 0.5, 0.8)
"""Where in an interval its error is looked at."""


def path_table(path: Path) -> FloatArray:
    """Intervals of the path's time with polynomials, and a last row that rests at the end, (K, 50).

    Position: the quintic with the position, velocity and acceleration of both ends. Rotation: the cubic
    rotation vector with the turn and its rate at both ends. An interval is halved until its error is small;
    what remains is at most 1e-9 m and 1e-9 rad except within 1e-8 s of a jump.
    """
    edges = np.linspace(0.0, path.duration, FIRST_INTERVALS + 1)
    begin, end = edges[:-1], edges[1:]
    done: list[FloatArray] = []
    count = 0
    while len(begin):
        rows = _rows(path, begin, end)
        good = _is_accurate(path, rows, begin, end) | (end - begin <= NARROWEST)
        done.append(np.column_stack([rows[good], end[good]]))
        count += int(good.sum())
        begin, end = begin[~good], end[~good]
        if count + 2 * len(begin) > LARGEST:
            raise InputError(
                f"the path of {path.duration:g} s is too rough for {LARGEST} intervals; "
                "give it fewer corners or a smooth law of motion"
            )
        middle = 0.5 * (begin + end)
        begin, end = np.concatenate([begin, middle]), np.concatenate([middle, end])
    stacked = np.concatenate(done)
    stacked = stacked[np.argsort(stacked[:, layout.BEGIN], kind="stable")]
    table = np.zeros((len(stacked) + 1, layout.COLUMNS))
    table[:-1] = stacked[:, :-1]
    table[-1, layout.BEGIN] = path.duration
    last = path.sample(path.duration).pose[0]
    table[-1, layout.POSITION : layout.POSITION + 3] = last[:3, 3]
    table[-1, layout.ORIENTATION : layout.ORIENTATION + 9] = last[:3, :3].ravel()
    table[:, layout.STOP] = _next_jumps(path, table[:, layout.BEGIN])
    return np.ascontiguousarray(table)


def _next_jumps(path: Path, times: FloatArray) -> FloatArray:
    """For each interval the time of the first jump of the twist after its begin, inf if there is none."""
    earlier, after = path.sample(times - LEFT), path.sample(times).twist
    before = earlier.twist + LEFT * earlier.acceleration
    jumps = np.abs(after - before).max(axis=1) > JUMP
    jumps[0] = False
    narrow = np.diff(times) <= 2.0 * NARROWEST  # the jump lies inside; the interval's end stands for it
    jumps[1:] |= narrow & (np.abs(before[1:] - after[:-1]).max(axis=1) > JUMP)
    stops = np.full(len(times), np.inf)
    upcoming = np.inf
    for k in range(len(times) - 1, -1, -1):
        stops[k] = upcoming
        if jumps[k]:
            upcoming = times[k]
    return stops


def _rows(path: Path, begin: FloatArray, end: FloatArray) -> FloatArray:
    """The rows of intervals, (K, 50), without their stops."""
    first, last, before = path.sample(begin), path.sample(end), path.sample(end - LEFT)
    left = PathSample(
        pose=last.pose, twist=before.twist + LEFT * before.acceleration, acceleration=before.acceleration
    )
    h = (end - begin)[:, None]
    rows = np.zeros((len(begin), layout.COLUMNS))
    rows[:, layout.BEGIN] = begin
    p0, p1 = first.pose[:, :3, 3], last.pose[:, :3, 3]
    rows[:, layout.POSITION : layout.ORIENTATION] = _quintic(
        h, p1 - p0, first.twist[:, :3], left.twist[:, :3], first.acceleration[:, :3], left.acceleration[:, :3]
    )
    rows[:, layout.POSITION : layout.POSITION + 3] = p0
    rows[:, layout.ORIENTATION : layout.TURN] = first.pose[:, :3, :3].reshape(-1, 9)
    turn = _turns(first, last)
    w0, w1 = first.twist[:, 3:], left.twist[:, 3:]
    rows[:, layout.TURN : layout.SPIN] = _cubic(h, turn, w0, _turn_rate(turn, w1))[:, 3:]
    spin = _cubic(h, w1 - w0, first.acceleration[:, 3:], left.acceleration[:, 3:])
    rows[:, layout.SPIN :] = spin
    rows[:, layout.SPIN : layout.SPIN + 3] = w0
    short = h[:, 0] < STRAIGHT
    rows[short, layout.POSITION + 3 : layout.ORIENTATION] = 0.0
    rows[short, layout.TURN :] = 0.0
    rows[short, layout.POSITION + 3 : layout.POSITION + 6] = ((p1 - p0) / h)[short]
    rows[short, layout.TURN : layout.TURN + 3] = rows[short, layout.SPIN : layout.SPIN + 3] = (turn / h)[
        short
    ]
    return rows


def _turns(first: PathSample, last: PathSample) -> FloatArray:
    """Rotation vectors along W from the one orientation to the other, (K, 3) [rad]."""
    from scipy.spatial.transform import Rotation  # slow to load, needed by a follower only

    relative = last.pose[:, :3, :3] @ np.swapaxes(first.pose[:, :3, :3], 1, 2)
    turns: FloatArray = Rotation.from_matrix(relative).as_rotvec()
    return turns


def _turn_rate(turn: FloatArray, w: FloatArray) -> FloatArray:
    """Rate of the rotation vector with angular velocity w along W, by the inverse left Jacobian, (K, 3)."""
    angle = np.linalg.norm(turn, axis=1, keepdims=True)
    safe = np.maximum(angle, 1e-3)
    factor = 1.0 / safe**2 - (1.0 + np.cos(safe)) / (2.0 * safe * np.sin(safe))
    factor = np.where(angle < 1e-3, 1.0 / 12.0, factor)
    once = np.cross(turn, w)
    rate: FloatArray = w - 0.5 * once + factor * np.cross(turn, once)
    return rate


def _quintic(h: Any, d: Any, v0: Any, v1: Any, a0: Any, a1: Any) -> FloatArray:
    """Coefficients of the quintic from 0 to d in time h, (K, 18), the constant left zero."""
    c3 = (20.0 * d - (8.0 * v1 + 12.0 * v0) * h - (3.0 * a0 - a1) * h**2) / (2.0 * h**3)
    c4 = (-30.0 * d + (14.0 * v1 + 16.0 * v0) * h + (3.0 * a0 - 2.0 * a1) * h**2) / (2.0 * h**4)
    c5 = (12.0 * d - 6.0 * (v1 + v0) * h - (a0 - a1) * h**2) / (2.0 * h**5)
    return np.concatenate([0.0 * d, v0, 0.5 * a0, c3, c4, c5], axis=1)


def _cubic(h: Any, d: Any, v0: Any, v1: Any) -> FloatArray:
    """Coefficients of the cubic from 0 to d in time h, (K, 12), the constant left zero."""
    c2 = (3.0 * d - (2.0 * v0 + v1) * h) / h**2
    c3 = (-2.0 * d + (v0 + v1) * h) / h**3
    return np.concatenate([0.0 * d, v0, c2, c3], axis=1)


def _is_accurate(path: Path, rows: FloatArray, begin: FloatArray, end: FloatArray) -> Any:
    """Whether the polynomials meet the path at the points that are checked, (K,)."""
    from scipy.spatial.transform import Rotation

    good = np.ones(len(begin), dtype=np.bool_)
    for share in CHECKED:
        t = share * (end - begin)
        exact = path.sample(begin + t)
        powers = t[:, None] ** np.arange(6)
        position = np.einsum(
            "ki,kij->kj", powers, rows[:, layout.POSITION : layout.ORIENTATION].reshape(-1, 6, 3)
        )
        slopes = np.arange(1, 6) * powers[:, :5]
        velocity = np.einsum(
            "ki,kij->kj", slopes, rows[:, layout.POSITION + 3 : layout.ORIENTATION].reshape(-1, 5, 3)
        )
        turn = np.einsum("ki,kij->kj", powers[:, 1:4], rows[:, layout.TURN : layout.SPIN].reshape(-1, 3, 3))
        spin = np.einsum("ki,kij->kj", powers[:, :4], rows[:, layout.SPIN :].reshape(-1, 4, 3))
        begun = Rotation.from_matrix(rows[:, layout.ORIENTATION : layout.TURN].reshape(-1, 3, 3))
        missing = (
            Rotation.from_matrix(exact.pose[:, :3, :3]) * (Rotation.from_rotvec(turn) * begun).inv()
        ).as_rotvec()
        worst = np.maximum(np.abs(position - exact.pose[:, :3, 3]), np.abs(missing)).max(axis=1)
        rate = np.maximum(np.abs(velocity - exact.twist[:, :3]), np.abs(spin - exact.twist[:, 3:])).max(
            axis=1
        )
        good &= (worst <= TOLERANCE) & (rate <= RATE_TOLERANCE)
    return good
