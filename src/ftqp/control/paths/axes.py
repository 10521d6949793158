"""Directions that a user gives by name or by vector."""

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from ftqp.core.checks import FloatArray, array
from ftqp.core.errors import InputError, unknown
from ftqp.core.setting import Setting

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
    "two perpendicular directions in W, each x, y, z, -x, -y, -z or a vector",
    of=tuple[_WRITTEN, _WRITTEN],
)


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
