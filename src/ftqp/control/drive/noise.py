"""How noisy the measurements are."""

import logging
from dataclasses import dataclass

from ftqp.core.setting import refuse_out_of_range, setting

_LOG = logging.getLogger("ftqp")
DOUBTFUL = 0.05
"""Noise of positions above this [rad or m], 3 deg or 5 cm, is no encoder's. A convention."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise:
    """Standard deviations of what is measured; zero says that nothing is known.

    Attributes:
        q: Of joint positions, >= 0 [rad or m]. A larger one lets samples differ more from what is expected
            and corrects the tip more slowly; where it is stated, a sensor that repeats its number while the
            joint moves counts as frozen sooner. More than 0.05 is a warning on the logger ``ftqp``.
        tau: Of joint torques, >= 0 [N m or N].

    Raises:
        InputError: A number is negative or not finite.
    """

    q: float = setting(0.0, "of positions, >= 0", unit="rad or m", least=0.0)
    tau: float = setting(0.0, "of torques, >= 0", unit="N m or N", least=0.0)

    def __post_init__(self) -> None:
        refuse_out_of_range(self, " of the noise")
        if self.q > DOUBTFUL:
            _LOG.warning(
                "Noise(q=%g) is more than any encoder has, so that nearly every sample is believed; it is a "
                "standard deviation in rad or m, such as 1e-4: is it in degrees or in counts?",
                self.q,
            )
