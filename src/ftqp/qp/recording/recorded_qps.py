"""Recorded QPs: what a planner asked of its solver, tick by tick, as arrays with names and as a file."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self, final

import numpy as np
from numpy.typing import NDArray

from ftqp.core.checks import BoolArray, FloatArray, IntArray, frozen
from ftqp.core.errors import InputError
from ftqp.qp.adapters.backend import Claim
from ftqp.qp.problem import ANSWER, PARTS, QP, SYMMETRY_TOLERANCE
from ftqp.qp.recording.recording_file import read, write

SHAPES: dict[str, tuple[str, ...]] = {
    "H": ("n", "n"), "g": ("n",), "A": ("m", "n"), "b": ("m",), "C": ("p", "n"), "l": ("p",), "u": ("p",),
    "lb": ("n",), "ub": ("n",), "x": ("n",), "y": ("m",), "z": ("p",), "z_box": ("n",),
    "claim": (), "iterations": (), "cold": (), "tick": (), "time": (),
}  # fmt: skip
"""The arrays and their shapes behind the leading axis of K QPs."""
WHOLE = {"claim": np.int64, "iterations": np.int64, "tick": np.int64, "cold": np.bool_}
"""Arrays that are not of floats."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recording:
    """K consecutive QPs of one shape, an answer to each, and what they mean.

    min 1/2 x'Hx + g'x, Ax = b, l <= Cx <= u, lb <= x <= ub, multipliers of L = f + y'(Ax - b) + z'Cx +
    z_box'x. The arrays are read-only.

    Attributes:
        H: Hessians, (K, n, n).
        g: Linear terms, (K, n).
        A: Equality rows, (K, m, n).
        b: Their right sides, (K, m).
        C: Two-sided rows, (K, p, n).
        l: Their lower bounds, (K, p).
        u: Their upper bounds, (K, p).
        lb: Lower bounds of x, (K, n).
        ub: Upper bounds of x, (K, n).
        x: The answers, (K, n); NaN where there is none.
        y: Multipliers of Ax = b, (K, m); NaN where there is no answer.
        z: Multipliers of the two-sided rows, (K, p); NaN where there is no answer.
        z_box: Multipliers of the bounds of x, (K, n); NaN where there is no answer.
        claim: What the solver said of its answer, a ``Claim`` each, (K,).
        iterations: Iterations of the solver, in its own counting, (K,).
        cold: Whether the solver was told to forget the QP before, (K,).
        tick: Number of the control tick, rising, (K,).
        time: Time of the tick, (K,) [s].
        variables: Names of x, for a planner's QP the joints, ``scale``, ``slack x``, ..., (n,).
        rows: Names of [A; C], for a planner's QP ``x``, ``y``, ..., ``torque panda_joint1``, ..., (m + p,).
        metadata: Robot, scheme, level, faults, versions and whatever else JSON can hold.
    """

    H: FloatArray
    g: FloatArray
    A: FloatArray
    b: FloatArray
    C: FloatArray
    l: FloatArray
    u: FloatArray
    lb: FloatArray
    ub: FloatArray
    x: FloatArray
    y: FloatArray
    z: FloatArray
    z_box: FloatArray
    claim: IntArray
    iterations: IntArray
    cold: BoolArray
    tick: IntArray
    time: FloatArray
    variables: tuple[str, ...]
    rows: tuple[str, ...]
    metadata: Mapping[str, Any]

    def __post_init__(self) -> None:
        """Check the parts against each other.

        Raises:
            InputError: a wrong shape or type, NaN, crossed bounds, ticks that do not rise, names that do not
                fit.
        """
        arrays = {name: _numbers(name, getattr(self, name)) for name in SHAPES}
        _check_shapes(arrays)
        _check_content(arrays)
        for name, value in arrays.items():
            object.__setattr__(self, name, frozen(value))
        n, m, p = self.g.shape[1], self.b.shape[1], self.l.shape[1]
        for name, count in (("variables", n), ("rows", m + p)):
            object.__setattr__(self, name, _names(name, getattr(self, name), count))
        object.__setattr__(self, "metadata", dict(self.metadata))

    def __len__(self) -> int:
        return len(self.tick)

    def __iter__(self) -> Iterator[QP]:
        return (self.problem(k) for k in range(len(self)))

    def problem(self, k: int) -> QP:
        """The QP at a position.

        Args:
            k: The position, 0 to K - 1.

        Raises:
            InputError: Its H is indefinite.
        """
        return QP(**{name: getattr(self, name)[k] for name in PARTS})

    def part(self, begin: int, end: int) -> "Recording":
        """The QPs at positions ``begin`` to ``end - 1``; at least one.

        Args:
            begin: The first position.
            end: One beyond the last position.
        """
        return replace(self, **{name: getattr(self, name)[begin:end] for name in SHAPES})

    def position(self, tick: int) -> int:
        """The position of a tick.

        Args:
            tick: The number of a control tick.

        Raises:
            InputError: The tick was not recorded; the message names what was.
        """
        at = int(np.searchsorted(self.tick, tick))
        if at < len(self) and self.tick[at] == tick:
            return at
        closest = int(self.tick[np.argmin(np.abs(self.tick - tick))])
        gaps = "" if self.tick[-1] - self.tick[0] + 1 == len(self) else f" ({len(self)} of them)"
        raise InputError(
            f"tick {tick} was not recorded, expected one of {self.tick[0]} to {self.tick[-1]}{gaps}; "
            f"the nearest recorded one is {closest}"
        )

    def save(self, path: str | Path) -> None:
        """Write a new file, whole or not at all.

        Args:
            path: The file, which ends in ``.npz`` and does not exist yet.

        Raises:
            InputError: The file exists already or cannot be written.
        """
        about = {"variables": self.variables, "rows": self.rows, "metadata": dict(self.metadata)}
        write(path, {name: getattr(self, name) for name in SHAPES}, about)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """The recording in a file.

        Args:
            path: A file that ``save`` or ``ftqp run --record-qps`` has written.

        Raises:
            InputError: There is no such file, or it is not a recording, of another version, truncated, or
                damaged.
        """
        arrays, about = read(path, tuple(SHAPES))
        content: dict[str, Any] = {**arrays, **about}
        try:
            return cls(**content)
        except InputError as error:
            raise InputError(f"recording {path} is damaged: {error}") from error


def _numbers(name: str, value: Any) -> NDArray[Any]:
    kind: Any = WHOLE.get(name, np.float64)
    array = np.asarray(value)
    wanted = "fiu" if kind is np.float64 else "b" if kind is np.bool_ else "iu"
    if array.dtype.kind not in wanted:
        words = {"fiu": "numbers", "b": "true or false", "iu": "whole numbers"}[wanted]
        raise InputError(f"{name} holds {array.dtype.name}, expected {words}")
    return np.array(array, dtype=kind, order="C")


def _check_shapes(arrays: Mapping[str, NDArray[Any]]) -> None:
    g, b, l = arrays["g"], arrays["b"], arrays["l"]
    for name, value in (("g", g), ("b", b), ("l", l)):
        if value.ndim != 2:
            raise InputError(f"{name} has shape {value.shape}, expected one row a QP")
    sizes = {"n": g.shape[1], "m": b.shape[1], "p": l.shape[1]}
    if len(g) == 0 or sizes["n"] == 0:
        raise InputError(f"g has shape {g.shape}, expected at least one QP of at least one variable")
    for name, shape in SHAPES.items():
        expected = (len(g), *(sizes[size] for size in shape))
        if arrays[name].shape != expected:
            symbols = f"({', '.join(('K', *shape))})"
            raise InputError(f"{name} has shape {arrays[name].shape}, expected {symbols} = {expected}")


def _check_content(arrays: Mapping[str, NDArray[Any]]) -> None:
    for name in ("H", "g", "A", "b", "C", "time"):
        if not np.isfinite(arrays[name]).all():
            raise InputError(f"{name} is not finite in QP {_first(~np.isfinite(arrays[name]))}")
    H = arrays["H"]
    off = np.abs(H - H.transpose(0, 2, 1)) > SYMMETRY_TOLERANCE * np.abs(H).max(axis=(1, 2), keepdims=True)
    if off.any():
        raise InputError(f"H is not symmetric in QP {_first(off)}")
    for low, high in (("l", "u"), ("lb", "ub")):
        lows, highs = arrays[low], arrays[high]
        crossed = ~(lows <= highs) | (lows == np.inf) | (highs == -np.inf)
        if crossed.any():
            raise InputError(f"{low} and {high} leave nothing between them in QP {_first(crossed)}")
    claim = arrays["claim"]
    unknown = (claim < min(Claim)) | (claim > max(Claim))
    if unknown.any():
        raise InputError(f"claim is {claim[unknown][0]}, expected {min(Claim):d} to {max(Claim):d}")
    for name in ANSWER:
        lost = ~np.isfinite(arrays[name]).reshape(len(claim), -1).all(axis=1) & (claim == Claim.SOLVED)
        if lost.any():
            raise InputError(f"{name} is not finite in QP {_first(lost)}, which counts as solved")
    if (np.diff(arrays["tick"]) <= 0).any():
        raise InputError(f"tick does not rise after QP {_first(np.diff(arrays['tick']) <= 0)}")


def _first(wrong: BoolArray) -> int:
    """The first QP that something is wrong with."""
    return int(np.argwhere(wrong)[0][0])


def _names(what: str, names: Any, count: int) -> tuple[str, ...]:
    if not isinstance(names, list | tuple) or not all(isinstance(name, str) for name in names):
        raise InputError(f"{what} are {names!r:.60}, expected {count} names")
    if len(names) != count or len(set(names)) != count:
        raise InputError(f"{what} has {len(set(names))} different names, expected {count}")
    return tuple(names)
