"""How far links go from where they were when a joint began to swing freely: what endangers people."""

from typing import Any

from ftqp.kernel.jit import jit

WORTH = 10.0
"""Links may go farther than they would if the others held still where that takes so much from an impact
[J]."""
HARMLESS = 5.0
"""An impact below this is not worth moving for [J]: the others hold still."""

ROUGH = 0.02
"""Rollouts of 10 ms are wrong by so much [m]."""


@jit
def mark_places(kinematics: Any, n: int, F: Any) -> None:
    """Remember where the origins of the joints and the tip are: ``places``."""
    for r in range(3):
        for j in range(n):
            F.places[j, r] = kinematics.o[j, r]
        F.places[n, r] = kinematics.o_tip[r]


@jit
def farthest(kinematics: Any, n: int, F: Any) -> float:
    """The largest squared distance of an origin, or of the tip, from its place [m2]."""
    most = 0.0
    for j in range(n + 1):
        away = 0.0
        for r in range(3):
            d = (kinematics.o[j, r] if j < n else kinematics.o_tip[r]) - F.places[j, r]
            away += d * d
        most = max(most, away)
    return most


@jit
def is_worth(F: Any, reach: float, energy: float, spared: float) -> bool:
    """Whether links may go as far as ``reach`` [m] for an impact of ``energy`` [J]; ``spared`` is free."""
    return reach <= F.held_reach + ROUGH + spared or energy <= F.held_energy - WORTH
