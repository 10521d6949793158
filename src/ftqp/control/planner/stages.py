"""What takes part in a planner's life beside the kernel's tick, as one ordered list."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final

from ftqp.core.checks import FloatArray
from ftqp.faults.belief import Belief
from ftqp.model.robot import Robot

Tick = Callable[..., int]
"""From what a step was given, the measured configuration first, to a status or mistake."""
CLOCK: Final = "clock"
"""Ticks whose targets come with the step."""
FREE: Final = "free"
"""The same beside a joint that swings freely."""
LED: Final = ("path", "base", "joints")
"""Ticks that a follower leads in place of the clock."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stage:
    """One part of a planner: what it does at which moment; None is nothing."""

    ticks: tuple[str, ...] = ()  # The kinds of ticks that it takes part in
    before: Callable[[], object] | None = None  # What it does before each of them
    # What it does after each of them, of its status or mistake and what the step was given
    after: Callable[[int, tuple[Any, ...]], object] | None = None
    mount: Callable[[Robot], object] | None = None  # What it does when the arm gets another load or tool
    # What it does when other joints are believed to have failed; it may be called again
    believe: Callable[[Belief], object] | None = None
    # What it does at a reset to joint positions, (nv,) [rad or m], of the arm as it is fitted and with what
    # is believed; it may be called again
    begin: Callable[[FloatArray, Robot, Belief], object] | None = None


def staged(tick: Tick, kind: str, stages: Iterable[Stage]) -> Tick:
    """A tick with what its stages do before and after it, in their order; itself where they do nothing."""
    own: Sequence[Stage] = [stage for stage in stages if kind in stage.ticks]
    before = tuple(stage.before for stage in own if stage.before is not None)
    after = tuple(stage.after for stage in own if stage.after is not None)
    if not before and not after:
        return tick

    def whole(*inputs: Any) -> int:
        for act in before:
            act()
        code = tick(*inputs)
        for look in after:
            look(code, inputs)
        return code

    return whole
