"""A motion past balls, the same for every program; it needs numpy only, as all of them have it."""

import json
from dataclasses import dataclass
from pathlib import Path

from peers.motion_case import MotionCase


@dataclass(frozen=True, slots=True, kw_only=True)
class NearCase(MotionCase):
    """A straight motion of the tip past balls; ``locked`` is -1 of a healthy arm.

    Attributes:
        rods: The arm's bodies: number of the joint, both ends in its frame, radius, (8,) each.
        balls: x, y, z and radius of each, (K, 4).
        keep: How far the arm shall stay away from them [m].
    """

    rods: list
    balls: list
    keep: float


def read_near(file):
    """Cases from a file."""
    return [NearCase(**case) for case in json.loads(Path(file).read_text())]
