"""A recorded motion with torques, and what it says of position, speed, acceleration and torque at once."""

from dataclasses import dataclass
from typing import Any, NamedTuple, final

import numpy as np

from ftqp.core.checks import FloatArray, as_number, frozen, numbers
from ftqp.core.errors import InputError

WIDTHS = (0.04, 0.06, 0.08, 0.12, 0.16, 0.24)
"""Cubics are laid through so long pieces of the motion [s], the shortest first. Shorter ones show noise only,
and over longer ones the acceleration of an arm is no straight line. A convention, as
``python studies/identify.py`` shows no need of others."""
FEWEST = 8
"""Samples that a piece has at least: twice the unknowns of a cubic."""
CLEAN = 0.01
"""Pieces are long enough when noise is this share of the square of accelerations: it makes every inertia
look smaller by as much."""
GAP, HOLE = 3.5, 0.25
"""A step of time so many times the usual one, and more than this share of a piece, is a gap, and no piece
lies across it: a cubic bridges shorter ones."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TorqueLog:
    """Positions and torques of a motion of the healthy arm, at times of any distance.

    Attributes:
        t: Times, rising, (K,) [s].
        q: Measured positions, (K, nv) [rad or m].
        tau: Torques of the motors, measured or sent, (K, nv) [N m or N].
        late: How much earlier than at ``t`` positions were taken, or how much later torques acted [s]: the
            latency of the samples, and half a period more where the torques are those that were sent.
        name: What it is called in messages.

    Raises:
        InputError: The arrays differ in shape, are not finite, or the times do not rise.
    """

    t: FloatArray
    q: FloatArray
    tau: FloatArray
    late: float = 0.0
    name: str = "the log"

    def __post_init__(self) -> None:
        t = _finite(self.name, "t", self.t, 1)
        q, tau = (_finite(self.name, name, getattr(self, name), 2) for name in ("q", "tau"))
        if q.shape != tau.shape or len(q) != len(t):
            raise InputError(
                f"{self.name} has t of shape {t.shape}, q of {q.shape} and tau of {tau.shape}, expected "
                "(K,), (K, nv) and (K, nv), one row a sample"
            )
        if len(t) < FEWEST:
            raise InputError(f"{self.name} has {len(t)} samples, expected some seconds of motion")
        if (back := np.flatnonzero(np.diff(t) <= 0.0)).size:
            row = int(back[0])
            raise InputError(
                f"t of {self.name} does not rise from row {row} ({t[row]:g} s) to {row + 1} "
                f"({t[row + 1]:g} s); sort the samples by time, and leave out what is there twice"
            )
        for name, value in (("t", t), ("q", q), ("tau", tau)):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "late", as_number("late", self.late, "s"))


class Pieces(NamedTuple):
    """A motion in the middles of pieces of it, S of them."""

    t: FloatArray  # Times, (S,) [s]
    q: FloatArray  # Positions, (S, nv) [rad or m]
    v: FloatArray  # Velocities, (S, nv) [rad/s or m/s]
    a: FloatArray  # Accelerations, (S, nv) [rad/s2 or m/s2]
    tau: FloatArray  # Torques, (S, nv) [N m or N]
    width: float  # How long a piece is [s]
    left_out: float  # Time that lies in gaps [s]


def pieces_of(log: TorqueLog, most: int = 10**6) -> Pieces:
    """The motion by cubics through pieces that overlap by half, each by least squares at its own times.

    Positions and torques go through the same cubics, so that what smoothes one smoothes the other.
    """
    usual = float(np.median(np.diff(log.t)))
    if FEWEST * usual > WIDTHS[-1]:
        raise InputError(
            f"{log.name} has {1.0 / usual:.3g} samples a second, expected {FEWEST / WIDTHS[-1]:.0f} at least,"
            " because accelerations are taken from them; record faster"
        )
    found = None
    for width in WIDTHS:
        if FEWEST * usual > width:
            continue
        found, noise = _fitted(log, width, max(GAP * usual, HOLE * width), most)
        size = float((found.a**2).mean()) if len(found.t) else 0.0
        if noise <= CLEAN * size:
            break
    assert found is not None
    if len(found.t) < FEWEST:
        raise InputError(
            f"{log.name} has no {FEWEST} pieces of {found.width:g} s without a gap; record the motion again"
        )
    return found


def _fitted(log: TorqueLog, width: float, gap: float, most: int) -> tuple[Pieces, float]:
    """Pieces of one width, and the mean square of the noise of their accelerations."""
    t = log.t
    edge = 0.5 * width + abs(log.late)
    middles = np.arange(t[0] + edge, t[-1] - edge, max(0.5 * width, float(t[-1] - t[0]) / most))
    kept, rows, noise = [], [], []
    gaps = np.diff(t) > gap
    before = np.concatenate([[0], np.cumsum(gaps)])
    for middle in middles:
        parts = []
        for values, shift in ((log.q, log.late), (log.tau, 0.0)):
            first, last = np.searchsorted(t, [middle - 0.5 * width + shift, middle + 0.5 * width + shift])
            ends = shift + middle - 0.5 * width, shift + middle + 0.5 * width
            if last - first < FEWEST or before[last - 1] > before[first]:
                break
            if t[first] - ends[0] > gap or ends[1] - t[last - 1] > gap:
                break
            x = (t[first:last] - shift - middle) / (0.5 * width)
            basis = np.stack([np.ones_like(x), x, x * x, x**3], axis=1)
            parts.append((basis, values[first:last]))
        if len(parts) < 2:
            continue
        fits = [np.linalg.lstsq(basis, values, rcond=None)[0] for basis, values in parts]
        basis, values = parts[0]
        left = values - basis @ fits[0]
        of_bend = float(np.linalg.inv(basis.T @ basis)[2, 2]) * (left**2).sum(axis=0) / (len(values) - 4)
        noise.append((2.0 / (0.5 * width) ** 2) ** 2 * of_bend)
        kept.append(middle)
        rows.append(
            (fits[0][0], fits[0][1] / (0.5 * width), 2.0 * fits[0][2] / (0.5 * width) ** 2, fits[1][0])
        )
    n = log.q.shape[1]
    q, v, a, tau = (np.array([row[k] for row in rows]).reshape(-1, n) for k in range(4))
    lost = float(np.diff(t)[gaps].sum())
    pieces = Pieces(np.array(kept), q, v, a, tau, width, lost)
    return pieces, float(np.mean(noise)) if noise else 0.0


def _finite(where: str, name: str, value: Any, dimensions: int) -> FloatArray:
    """A read-only array of finite numbers."""
    result = numbers(f"{name} of {where}", value)
    if result.ndim != dimensions:
        shape = "(K,)" if dimensions == 1 else "(K, nv)"
        raise InputError(f"{name} of {where} has shape {result.shape}, expected {shape}")
    if not np.isfinite(result).all():
        row = int(np.argwhere(~np.isfinite(result))[0][0])
        raise InputError(
            f"{name} of {where} is not finite at row {row}; leave such samples out, for gaps do no harm"
        )
    return frozen(result)
