"""N-1: what the loss of any one joint would cost from here, as it is asked of power grids."""

from dataclasses import dataclass

from ftqp.core.setting import refuse_out_of_range, setting


@dataclass(frozen=True, slots=True, kw_only=True)
class NMinusOne:
    """Lock each joint in thought, over and over, and lead the null space to where that costs least.

    Attributes:
        horizon: How far it is looked ahead, > 0 [s]. A longer one sees losses sooner and takes more time.
        rate: How often, 1 to 200 [Hz]. A higher one takes more of a processor.
        tolerance: The largest error of the end effector with which a loss counts as survived, > 0 [m].
        rotation_tolerance: The same of its rotation, > 0 [rad].
        leads: Whether the null space is led; else it is only looked.
        waits: Whether a step waits for what the thread computes, so that the same ticks have the same
            answers: for studies. False takes it at the first tick that has it, and no step waits.
        budget: So many ticks are rolled out each time at most, >= 1, but never less than one lock; a look
            that takes more is spread over several times, and is as old as that when it is known. A step of a
            Panda takes some 3 us, so that the default is 75 ms of a processor.

    Raises:
        InputError: A number is out of its range.

    Source: docs/theory/ways-out.md, "N-1 on line".
    """

    horizon: float = setting(2.0, unit="s", above=0.0)
    rate: float = setting(20.0, unit="Hz", least=1.0, most=200.0)
    tolerance: float = setting(2e-3, unit="m", above=0.0)
    rotation_tolerance: float = setting(0.02, unit="rad", above=0.0)
    leads: bool = True
    waits: bool = False
    budget: int = setting(25_000, least=1)

    def __post_init__(self) -> None:
        refuse_out_of_range(self, every=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class Loss:
    """What the loss of one joint would cost, were it locked now.

    Attributes:
        joint: Its name.
        survived: Whether the end effector would stay within the tolerances to the end of the horizon, and
            nothing be touched.
        position_error: Largest error of the end effector's position [m].
        rotation_error: Largest error of its rotation [rad].
        clearance: Least distance of two bodies that are kept apart [m]; inf without any.
        after: After how long a step would not be OK any more [s]; the horizon where all would be.
    """

    joint: str
    survived: bool
    position_error: float
    rotation_error: float
    clearance: float
    after: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Security:
    """What the loss of any one joint would cost, as of a tick.

    Attributes:
        tick: The tick at whose begin each joint was locked in thought.
        horizon: How far it was looked ahead [s].
        losses: One for each joint that works, in their order.
        age: How long ago that was when it was asked for [s].
    """

    tick: int
    horizon: float
    losses: tuple[Loss, ...]
    age: float = 0.0

    @property
    def survived(self) -> float:
        """The share of joints whose loss would be survived; 1 of an arm that has no joint to lose."""
        return sum(loss.survived for loss in self.losses) / len(self.losses) if self.losses else 1.0

    @property
    def sentence(self) -> str:
        """The same in words."""
        lost = [loss for loss in self.losses if not loss.survived]
        if not lost:
            return (
                f"any one joint may lock, and the end effector stays on its way for {self.horizon:g} s; as "
                f"of {self.age:.2g} s ago"
            )
        said = [
            f"{loss.joint} (off by {1e3 * loss.position_error:.3g} mm and {loss.rotation_error:.2g} rad, "
            f"from {loss.after:.2g} s on)"
            for loss in lost
        ]
        return f"not secure against a lock of {', '.join(said)}; as of {self.age:.2g} s ago"
