"""What the parts of the story have in common: who plays, and what a part comes to."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ftqp.app.scenario.setup import Setup
from ftqp.core.checks import FloatArray
from ftqp.sim.rival import ResolvedRates, Ride, ride

SCENARIO = "panda-unannounced"
FINDS, OWN_TOLD = "ftqp, not told", "ftqp, told at once"
RIVAL_NEVER, RIVAL_TOLD = "damped resolved rates, not told", "the same, told at once"


@dataclass(frozen=True, slots=True, kw_only=True)
class StoryPart:
    """What a part of the story came to.

    Attributes:
        lines: What happened, in plain words.
        facts: The same for a program.
        exit_code: Of the command, as far as this part goes.
        whole: Whether it was played to its end.
    """

    lines: list[str]
    facts: Mapping[str, Any]
    exit_code: int = 0
    whole: bool = True


def ridden(setup: Setup, told: bool, duration: float | None = None) -> Ride:
    """The rival on the arm of a scenario, with the same noise and the same brake.

    Args:
        setup: The scenario.
        told: Whether it is told of the brake at once.
        duration: Simulated time; None is that of the path [s].
    """
    return ride(
        ResolvedRates(setup.robot, setup.planner.dt), setup.robot, setup.path, setup.q, dt=setup.planner.dt,
        plant=setup.plant, sensors=setup.sensors, schedule=setup.schedule, told=told, duration=duration,
    )  # fmt: skip


def errors_of(error: FloatArray, t: FloatArray, at: float) -> dict[str, float]:
    """Errors of one controller before and after a failure, and at the end [m]."""
    before = t < at
    return {
        "before": float(error[before].max()),
        "after": float(error[~before].max()),
        "end": float(error[-1]),
    }
