"""Spares a joint that grows hot, or that works near its torque limit for long."""

from math import exp, isfinite
from typing import Final, final

from ftqp.control.planner.planner import Planner
from ftqp.core.checks import as_number, instance, positive
from ftqp.core.errors import InputError
from ftqp.faults.kinds import Degraded
from ftqp.vendors.verdict import GOES_ON, PERSON, RecoveryStep, Verdict

WARM_BELOW: Final = 20.0
"""So far below the maker's limit a joint is warm, unless the user says otherwise [K], ..."""
HOT_BELOW: Final = 5.0
"""... and so far below it is hot [K]."""
HYSTERESIS: Final = 0.2
"""Of the way from warm to hot: what is spared is given back that much later, 3 K of 15."""
LEAST_CHANGE: Final = 0.1
"""A share that has moved by less is not reported, as a report takes as long as many steps."""
ONCE_IN: Final = 1.0
"""At most one report in so long [s]."""
REST: Final = (RecoveryStep(PERSON, "choose: report ftqp.Locked, or planner.stop()"),)


@final
class Spare:
    """Lowers speed and torque of one joint as it grows hot, and gives them back as it cools.

    The share that is left is 1 below ``warm`` and falls linearly to ``still`` at ``hot``. It is reported as
    ``ftqp.Degraded`` when it has moved by 0.1, at most once a second. A fault that somebody else reported
    stays. With ``over`` it looks at a mean: give it \\|tau\\| / tau_max, warm=0.6, hot=0.9, over=10.

    Args:
        planner: The planner that gets the reports.
        joint: Its name.
        warm: From here on it is spared [K or C, or a share]; None is ``limit`` less 20.
        hot: Here it is spared most, and above it the verdict is to rest it; None is ``limit`` less 5.
        still: The share that is left when hot, in (0, 1].
        limit: The maker's limit, where warm and hot are left out [K or C].
        over: The mean is over so long, > 0 [s]; None looks at each value.

    Raises:
        InputError: No planner, an unknown joint, warm not below hot, or a share outside (0, 1].
    """

    __slots__ = (
        "_given",
        "_hot",
        "_joint",
        "_keeps",
        "_mean",
        "_planner",
        "_rests",
        "_share",
        "_since",
        "_still",
        "_warm",
    )  # fmt: skip

    def __init__(
        self, planner: Planner, joint: str, *, warm: float | None = None, hot: float | None = None,
        still: float = 0.3, limit: float | None = None, over: float | None = None,
    ) -> None:  # fmt: skip
        instance("planner", planner, Planner, "an ftqp.Planner, ftqp.Planner(robot)")
        self._planner, self._joint = planner, planner.robot.joints[planner.robot.joint(joint)]
        if limit is None and (warm is None or hot is None):
            raise InputError("warm and hot are not both given, expected them, or the maker's limit")
        top = 0.0 if limit is None else as_number("limit", limit)
        self._warm = top - WARM_BELOW if warm is None else as_number("warm", warm)
        self._hot = top - HOT_BELOW if hot is None else as_number("hot", hot)
        if not self._warm < self._hot:
            raise InputError(f"warm is {self._warm:g}, expected less than hot, {self._hot:g}")
        if not 0.0 < positive("still", still) <= 1.0:
            raise InputError(f"still is {still:g}, expected a share in (0, 1]")
        self._still = float(still)
        self._keeps = 0.0 if over is None else exp(-planner.dt / positive("over", over, "s"))
        self._mean: float | None = None
        self._share = self._given = 1.0
        self._since = ONCE_IN
        self._rests = False

    @property
    def share(self) -> float:
        """The share of speed and torque that is left, in [still, 1]."""
        return self._share

    def look(self, value: float) -> Verdict | None:
        """Look at a temperature or a load, once a ``dt``; the verdict where something is new.

        Args:
            value: What is measured; NaN is no news.

        Raises:
            InputError: It is no number.
        """
        self._since += self._planner.dt
        value = as_number("value", value)
        if not isfinite(value):
            return None
        before = value if self._mean is None else self._mean
        self._mean = mean = value + self._keeps * (before - value)
        later = mean + HYSTERESIS * (self._hot - self._warm)
        self._share = min(max(self._share, self._share_at(later)), self._share_at(mean))
        rested, self._rests = self._rests, mean > self._hot
        report = self._report(mean)
        if self._rests and not rested:
            why = f"{self._joint} is at {mean:.3g}, hot is {self._hot:g}: rest it"
            return Verdict(self._joint, self._fault(), GOES_ON, why, REST)
        return report

    def _share_at(self, value: float) -> float:
        """The share that is left at a value."""
        way = (value - self._warm) / (self._hot - self._warm)
        return min(max(1.0 - (1.0 - self._still) * way, self._still), 1.0)

    def _fault(self) -> Degraded | None:
        share = self._share
        return Degraded(self._joint, velocity=share, torque=share) if share < 1.0 else None

    def _report(self, value: float) -> Verdict | None:
        """Tell the planner where the share has moved far enough, and nothing else stands of the joint."""
        present = self._planner.faults.get(self._joint)
        if present is None:  # somebody has withdrawn what was reported
            self._given = 1.0
        moved = abs(self._share - self._given) >= LEAST_CHANGE - 1e-9
        ends = self._share in (1.0, self._still) and self._share != self._given
        mine = Degraded(self._joint, velocity=self._given, torque=self._given) if self._given < 1.0 else None
        if not (moved or ends) or self._since < ONCE_IN - 1e-9 or present != mine:
            return None
        self._since, self._given, fault = 0.0, self._share, self._fault()
        if fault is None:
            self._planner.withdraw(self._joint)
        else:
            self._planner.report(fault)
        why = f"{self._joint} is at {value:.3g}: {self._share:.2f} of its speed and torque is left"
        return Verdict(self._joint, fault, GOES_ON, why)
