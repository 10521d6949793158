"""The probability that a task is finished, from the failure rates of the joints."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray, positive
from ftqp.core.errors import InputError, unknown
from ftqp.model.robot import Robot

HOUR = 3600.0
"""[s]"""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MissionSurvival:
    """How probably one run of a task is finished although joints may fail.

    Attributes:
        low: At least this: between verified instants the worse neighbour counts, and no second failure is
            survived.
        likely: Between both.
        high: At most this: the better neighbour counts, and second failures do no harm.
        without: The probability that the task is finished where no failure is survived at all.
        coverage: The share of failures that is survived, weighted by their rates.
    """

    low: float
    likely: float
    high: float
    without: float
    coverage: float


def mission_survival(
    robot: Robot, survived: BoolArray, t: FloatArray, end: float, mtbf: Mapping[str | int, float]
) -> MissionSurvival:
    """The probability that a task is finished; joints fail with constant rates, each for itself.

    With lambda_j = 1/mtbf_j, L their sum and S_j(t) whether a failure at t is survived:

        P = exp(-L T) + sum_j  integral_0^T lambda_j exp(-L t) S_j(t) exp(-c (L - lambda_j)(T - t)) dt,

    c = 1 where every second failure ends the task, 0 where none does.
    """
    rates = np.zeros(robot.nv)
    for joint, hours in mtbf.items():
        if isinstance(joint, str) and joint not in robot.joints:
            raise unknown("joint", joint, robot.name, robot.joints)
        rates[robot.joint(joint)] = 1.0 / (HOUR * positive(f"mtbf of {joint!r}", hours, "h"))
    total = float(rates.sum())
    if not total > 0.0:
        raise InputError("mtbf is empty, expected the mean time between failures of a joint at least [h]")
    edges = np.append(t, end)
    later = np.concatenate([survived[:, 1:], survived[:, -1:]], axis=1)
    shares = {"low": survived & later, "high": survived | later}
    without = float(np.exp(-total * end))

    def finished(inside: FloatArray, second: bool) -> float:
        """P with S constant between instants: the integral of each piece in closed form."""
        chance = without
        for j, rate in enumerate(rates):
            others = total - rate if second else 0.0
            slope = total - others  # of the exponent -L t - others (T - t)
            pieces = -np.expm1(-slope * np.diff(edges)) / slope if slope > 0.0 else np.diff(edges)
            chance += float(
                rate * np.exp(-others * end) * (inside[j] * np.exp(-slope * edges[:-1]) * pieces).sum()
            )
        return chance

    both = [shares[name].astype(np.float64) for name in ("low", "high")]
    mean = 0.5 * (both[0] + both[1])
    low, high = finished(both[0], True), min(1.0, finished(both[1], False))
    likely = 0.5 * (finished(mean, True) + finished(mean, False))
    covered = float((mean * np.diff(edges)).sum(axis=1) @ rates / (total * end))
    return MissionSurvival(low=low, likely=likely, high=high, without=without, coverage=covered)
