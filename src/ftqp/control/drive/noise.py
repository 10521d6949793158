"""How noisy the measurements are."""

from dataclasses import dataclass

from ftqp.core.setting import refuse_out_of_range, setting


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise:
    """Standard deviations of what is measured; zero says that nothing is known.

    Attributes:
        q: Of joint positions, >= 0 [rad or m]. A larger one lets samples differ more from what is expected
            and corrects the tip more slowly; where it is stated, a sensor that repeats its number while the
            joint moves counts as frozen sooner.
        tau: Of joint torques, >= 0 [N m or N].

    Raises:
        InputError: A number is negative or not finite.
    """

    q: float = setting(0.0, "of positions, >= 0", unit="rad or m", least=0.0)
    tau: float = setting(0.0, "of torques, >= 0", unit="N m or N", least=0.0)

    def __post_init__(self) -> None:
        refuse_out_of_range(self, " of the noise")
