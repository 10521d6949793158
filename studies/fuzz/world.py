"""What a fuzzed episode consists of while it runs: planners, what they were told, and what was wrong."""

import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, final

import numpy as np

import ftqp
from ftqp.core.errors import InputError
from fuzz.cases import Case

Array = np.ndarray[Any, Any]
LONGEST = 600
"""A sentence of more letters than that is none."""


@final
@dataclass(slots=True, kw_only=True)
class World:
    """An episode as it runs.

    Attributes:
        case: Its planner and arm.
        rng: Draws everything.
        target: The target that is handed in.
        twin: A planner of the same case that is handed the same numbers without form and mistakes, or None.
        told: What was reported of each joint, by index, and not withdrawn.
        begins: Where the planner was said to be by a reset since the last tick, (q, v); None without one.
        changed: Whether what the planner believes has changed since the last tick.
        asked_to_stop: Whether a stop was asked for that was not released since.
        fitted: Whether a load or a tool has changed the arm since the beginning.
        moved: Whether a tool has moved the controlled point.
        done: How often each call was made.
        wrong: What was not as promised, a sentence each.
    """

    case: Case
    rng: np.random.Generator
    target: Any
    twin: Any = None
    told: dict[int, Any] = field(default_factory=dict)
    begins: tuple[Array, Array] | None = None
    changed: bool = False
    asked_to_stop: bool = False
    fitted: bool = False
    moved: bool = False
    done: dict[str, int] = field(default_factory=dict)
    wrong: list[str] = field(default_factory=list)

    @property
    def planner(self) -> Any:
        """The planner that is fuzzed."""
        return self.case.planner

    def both(self, call: Callable[[Any], Any]) -> Any:
        """Make a call that is no mistake, of the planner and of its twin."""
        result = call(self.planner)
        if self.twin is not None:
            call(self.twin)
        return result

    def refused(self, name: str, call: Callable[[], Any], says: str = "") -> None:
        """Make a call that is a mistake: one clear sentence as InputError, or something is wrong."""
        try:
            call()
        except InputError as error:
            sentence = str(error)
            if "\n" in sentence or len(sentence) > LONGEST or says not in sentence:
                self.wrong.append(f"{name}: the sentence does not tell: {sentence[:200]!r}")
        except Exception as error:  # whatever it is, it is not what was promised
            self.wrong.append(f"{name}: {last_line(error)}")
        else:
            self.wrong.append(f"{name}: a mistake was taken without a word")


def last_line(error: BaseException) -> str:
    """Type, message and place of an exception."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    place = frame.filename.rpartition("/ftqp/")[2]
    return f"raises {type(error).__name__}: {error!s:.150} ({place}:{frame.lineno})"


def is_input_error(error: BaseException) -> bool:
    """Whether it is what a mistake is answered with."""
    return isinstance(error, ftqp.FtqpError)
