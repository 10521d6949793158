"""What a planner is told between its steps, and what of its making that depends on."""

from functools import cache
from typing import Any, Final

import numpy as np

from ftqp.kernel.layout.field_kinds import floats, scalars

WORKS_STILL, IS_LOCKED_NOW, SWINGS_NOW = 0, 1, 2
"""What becomes of a joint that a planner is told of: it works, within limits that may be lower, or not."""

FAULT: Final = np.dtype(
    [
        *scalars("i4", "joint kind mode reset"),
        *scalars("f8", "deceleration damping friction velocity acceleration torque q_min q_max"),
    ]
)
"""A fault as it is told, the layout of ``ftqp_fault`` in C; NaN for what is not said.

``kind``: WORKS_STILL, IS_LOCKED_NOW or SWINGS_NOW. ``mode``: 0 brakes, 1 is at rest at once; ``reset``: what
the others' velocities do then, a ``Reset``. ``velocity``, ``acceleration`` and ``torque``: shares of the
healthy limits that are left; ``q_min`` and ``q_max``: the range that is left.
"""

LOAD: Final = np.dtype([("mass", "f8"), ("com", "f8", (3,)), ("inertia", "f8", (9,))])
"""A load in the frame of the robot's own tip, the layout of ``ftqp_load`` in C; mass 0 is none.

``inertia``: about its centre of mass, by rows.
"""

RESERVE: Final = np.dtype([("share", "f8"), ("guard", "f8")])
"""Shares of the acceleration limits: that braking may count on, and up to which torque limits hold."""


@cache
def given_dtype(capacity: int) -> np.dtype[Any]:
    """What a planner was made with, as far as what it is told later needs it, for so many joints.

    ``torque_limits``: motors have limits that count; ``dynamic`` and ``on_demand`` as in the room ``limits``,
    of a healthy arm; ``external``: another solver takes the QP; ``rich``: as of ``step_rich``;
    ``may_swing``: a joint that swings freely is served; ``allowed``: as in the room ``free``;
    ``has_posture``: ``posture`` is where the null space leads, else the start is.
    ``samples``: of the braking reserve. The limits are those of the healthy arm, ``coulomb`` its own
    friction; ``swings``: a joint swings freely now.

    ``tip_``, ``body_``: where the robot's own tip is in the frame of its joint, and the body that moves with
    it, without the load.
    """
    names = ("q_min", "q_max", "v_max", "a_max", "tau_max", "coulomb", "posture")
    return np.dtype(
        [
            *scalars("i8", "torque_limits dynamic on_demand external rich may_swing allowed has_posture"),
            *scalars("i8", "samples swings body"),
            *scalars("f8", "body_mass body_lever body_stoutness"),
            *floats({"tip_rotation": (9,), "tip_translation": (3,), "body_com": (3,), "body_inertia": (6,)}),
            *floats(dict.fromkeys(names, (capacity,))),
        ],
        align=True,
    )
