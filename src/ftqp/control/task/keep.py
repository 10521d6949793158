"""Keep: a point of the arm stays on its side of a plane."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ftqp.control.task.soft_tasks import WHICH, Three, direction
from ftqp.core.checks import array, frozen
from ftqp.core.errors import InputError
from ftqp.core.setting import REQUIRED, refuse_out_of_range, setting


@dataclass(frozen=True, slots=True)
class Keep:
    """A point of the arm stays on its side of a plane, for example the elbow above a table.

    It goes before the task of the tip, which gives way as its mode says. The point is that of the arm as the
    planner commands it; a link has a size, and an arm lags, so that the plane has to keep a distance.

    Args:
        frame: A frame, link or joint of the robot's model, whose origin is meant.
        above: A place on the plane, (3,) [m].
        normal: Across the plane, into the side that is free, (3,); its length does not matter. The vertical
            by default, so that the point stays above the place.
        point: Another point of that frame, (3,) [m].
        braking: How hard the arm can surely brake the point, > 0 [m/s2]. A larger number lets it come
            nearer faster, and is not kept where the joints cannot brake so hard.
        name: What ``planner.constraints`` and explanations call it; None is the frame.

    Raises:
        InputError: A number is out of its range, or an array has a wrong shape.
    """

    frame: str = setting(REQUIRED, WHICH)
    above: Any = setting(
        REQUIRED, "a place on the plane", of=tuple[float, float, float], unit="m", kw_only=True
    )
    normal: Any = setting((0.0, 0.0, 1.0), "across the plane, into the free side", of=Three, kw_only=True)
    point: Any = setting((0.0, 0.0, 0.0), "another point of the frame", of=Three, unit="m", kw_only=True)
    braking: float = setting(
        1.0, "how hard the arm can surely brake the point, > 0", unit="m/s2", above=0.0, kw_only=True
    )
    name: str | None = setting(None, "what it is called; its frame if absent", kw_only=True)

    def __post_init__(self) -> None:
        refuse_out_of_range(self)
        if self.name is not None and not (isinstance(self.name, str) and self.name):
            raise InputError(f"name is {self.name!r:.60}, expected a word such as 'elbow', or None")
        for name in ("above", "point"):
            object.__setattr__(self, name, frozen(array(name, getattr(self, name), (3,), "(3,)")))
        object.__setattr__(self, "normal", direction("normal", self.normal))

    @property
    def label(self) -> str:
        """What it is called."""
        return self.name or str(self.frame)

    @property
    def offset(self) -> float:
        """The plane's distance from the origin along its normal [m]."""
        return float(np.dot(self.normal, self.above))
