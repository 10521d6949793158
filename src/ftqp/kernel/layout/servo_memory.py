"""Memory of the servos of a simulated arm: what they take, may give, and ask of their motors."""

from functools import cache
from typing import Any

import numpy as np

from ftqp.kernel.layout.field_kinds import floats, scalars


@cache
def servo_dtype(capacity: int) -> np.dtype[Any]:
    """The type of the memory for arms of up to ``capacity`` joints.

    ``stiffness`` and ``damping`` are the gains on positions and velocities, ``q`` and ``v`` the command.
    ``limit`` is what each motor may give now and ``tau_max`` what it could give when it was healthy;
    ``unresponsive`` is 1.0 for a joint that does not do what its servo wants although its motor may be on.
    ``a`` is what each servo wants its joint to do, ``demand`` what it asks of its motor, ``tau`` what it
    gets.
    """
    names = ("q", "v", "limit", "tau_max", "unresponsive", "a", "demand", "tau")
    return np.dtype(
        [*scalars("f8", "stiffness damping"), *floats(dict.fromkeys(names, (capacity,)))], align=True
    )
