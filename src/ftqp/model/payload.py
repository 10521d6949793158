"""Payload: a rigid body that is carried at the tip."""

from dataclasses import dataclass
from typing import Any, final

import numpy as np

from ftqp.core.checks import FloatArray, array, frozen, positive
from ftqp.core.errors import InputError
from ftqp.core.setting import REQUIRED, setting

SHAPE_TOLERANCE = 1e-9
"""Largest asymmetry, and largest violation of what a rigid body can have, relative to the inertia."""
HEAVIEST = 1e6
"""No arm carries more [kg]. A convention, far beyond cranes: with what is heavier torques are no numbers."""
FARTHEST = 1e3
"""Nor anything whose centre of mass is farther from its tip [m], likewise ..."""
STOUTEST = HEAVIEST * FARTHEST**2
"""... or whose inertia is larger [kg m2] than that of the one at the other."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class Payload:
    """A load at the end effector, for ``robot.with_payload`` and ``planner.carry``.

    Attributes:
        mass: The mass, > 0 and at most 1e6 [kg]. A heavier load leaves less torque to accelerate and brake
            with.
        com: The centre of mass in the frame of the robot's tip, (3,), at most 1e3 from it along each axis
            [m].
        inertia: The inertia about the centre of mass, along the axes of the tip's frame, (3, 3), at most 1e12
            [kg m2]; None is a point mass.

    Raises:
        InputError: The mass is not above zero, a number is not finite or too large, or no rigid body has that
            inertia.
    """

    mass: float = setting(REQUIRED, "mass, > 0", unit="kg", above=0.0, most=HEAVIEST)
    com: Any = setting(
        (0.0, 0.0, 0.0), "centre of mass in the tip frame", unit="m", of=tuple[float, float, float]
    )
    inertia: Any = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "mass", positive("mass", self.mass, "kg"))
        object.__setattr__(self, "com", frozen(array("com", self.com, (3,))))
        moments = np.zeros((3, 3)) if self.inertia is None else array("inertia", self.inertia, (3, 3))
        _refuse_enormous("mass", self.mass, HEAVIEST, "kg")
        _refuse_enormous("com", self.com, FARTHEST, "m")
        _refuse_enormous("inertia", moments, STOUTEST, "kg m2")
        _refuse_unreal(moments)
        object.__setattr__(self, "inertia", frozen(moments))


def _refuse_enormous(name: str, value: Any, most: float, unit: str) -> None:
    """Refuses what is larger than anything that an arm carries."""
    largest = float(np.abs(value).max())
    if largest > most:
        raise InputError(
            f"{name} of a payload is {largest:.3g} {unit}, expected at most {most:g} {unit}; look at its unit"
        )


def _refuse_unreal(inertia: FloatArray) -> None:
    """Refuses an inertia that is not symmetric, or whose principal moments no rigid body has."""
    slack = SHAPE_TOLERANCE * float(np.abs(inertia).max())
    if np.abs(inertia - inertia.T).max() > slack:
        raise InputError("inertia is not symmetric; expected xx xy xz, xy yy yz, xz yz zz [kg m2]")
    least, middle, most = np.linalg.eigvalsh(inertia)
    if least < -slack or least + middle < most - slack:
        raise InputError(
            f"inertia has the principal moments {least:.3g}, {middle:.3g}, {most:.3g} kg m2, which no rigid "
            "body has; expected all >= 0 and none above the sum of the others"
        )
