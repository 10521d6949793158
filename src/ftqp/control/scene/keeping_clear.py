"""Clearance: how far an arm keeps from itself and from what stands around it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ftqp.core.errors import InputError
from ftqp.core.setting import refuse_out_of_range, setting

LARGEST = 3.0
"""Who keeps farther away than this [m] has written millimetres. A convention."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Clearance:
    """How far an arm keeps from itself and from what stands around it.

    Args:
        keep: Bodies are kept so far apart, > 0 [m]. Larger is safer and leaves less of the task.
        stop: An arm that is nearer than this to something and still comes nearer is stopped, >= 0 [m].
        gain: How fast a body may come near: no faster than so many times what is left of its way to ``keep``,
            > 0 [1/s]. A larger one comes nearer faster, and brakes later and harder.
        share: Share of what the joints can brake that is counted on, > 0 and <= 1. A larger one lets the arm
            come near faster, and leaves less for what else it has to do meanwhile.
        self_pairs: Whether bodies of the arm are kept apart from each other.
        ignore: Pairs of names that need not be kept apart, of capsules and of what stands in the scene.

    Raises:
        InputError: A number is out of its range, or ``ignore`` is no list of pairs.
    """

    keep: float = setting(0.02, unit="m", above=0.0)
    stop: float = setting(0.005, unit="m", least=0.0)
    gain: float = setting(20.0, unit="1/s", above=0.0)
    share: float = setting(0.5, above=0.0, most=1.0)
    self_pairs: bool = setting(True)
    ignore: Any = setting((), of=tuple[tuple[str, str], ...])

    def __post_init__(self) -> None:
        refuse_out_of_range(self)
        if self.keep > LARGEST:
            raise InputError(
                f"keep is {self.keep:g} m, expected at most {LARGEST:g} m; are these millimetres?"
            )
        if self.share > 1.0:
            raise InputError(f"share is {self.share:g}, expected at most 1, all that they can")
        if self.stop >= self.keep:
            raise InputError(
                f"stop is {self.stop:g} m and keep {self.keep:g} m, expected stop < keep; the arm would stop "
                "where it is to keep"
            )
        pairs = self.ignore
        sound = isinstance(pairs, Sequence) and not isinstance(pairs, str)
        if not sound or any(
            isinstance(pair, str) or len(pair) != 2 or not all(isinstance(name, str) for name in pair)
            for pair in pairs
        ):
            raise InputError(
                f"ignore is {pairs!r:.80}, expected pairs of names, [('panda_link1', 'table'), ...]"
            )
        object.__setattr__(self, "ignore", tuple((str(one), str(other)) for one, other in pairs))
