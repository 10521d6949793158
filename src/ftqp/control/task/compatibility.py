"""What goes with what: choices that exclude each other."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from ftqp.core.errors import InputError


@dataclass(frozen=True, slots=True, kw_only=True)
class Rule:
    """Two sets of values that exclude each other."""

    of: tuple[str, str]  # choice and value that the rule is about
    excludes: tuple[str, tuple[str, ...]]  # choice and the values that do not go with it
    reason: str  # why, the middle of the sentence
    remedy: str  # what to do instead, its end

    def sentence(self, value: str, given: Mapping[str, str] | None = None) -> str:
        """The error when the excluded choice has a value."""
        said = given or {}
        choice, own = self.of
        other, _ = self.excludes
        first, second = said.get(choice, own), said.get(other, value)
        return f"{choice} {first!r} does not go with {other} {second!r}: {self.reason}; {self.remedy}"


RULES: Final = (
    Rule(
        of=("scheme", "closed form"),
        excludes=("backend", ("dtrnn", "external")),
        reason="a closed form solves no QP and has no backend",
        remedy="leave backend at 'active_set'",
    ),
    Rule(
        of=("scheme", "closed form"),
        excludes=("mode", ("hard", "scaled", "lexicographic")),
        reason="a closed form has no task mode",
        remedy="leave mode at 'slack'",
    ),
    Rule(
        of=("scheme", "closed form"),
        excludes=("level", ("acceleration",)),
        reason="a closed form gives rates",
        remedy="make the planner with level='velocity'",
    ),
    Rule(
        of=("scheme", "closed form"),
        excludes=("damping", ("directional",)),
        reason="a closed form has damping rules of its own",
        remedy="take the scheme 'singularity_robust', or a QP",
    ),
    Rule(
        of=("damping", "directional"),
        excludes=("mode", ("scaled",)),
        reason="a path that is slowed down waits at a singularity instead of giving way",
        remedy="take mode 'slack' or leave damping out",
    ),
    Rule(
        of=("damping", "directional"),
        excludes=("priority", ("position_first",)),
        reason="directions that give way along a singularity mix position and rotation",
        remedy="take priority 'weighted' or leave damping out",
    ),
    Rule(
        of=("priority", "position_first"),
        excludes=("mode", ("hard",)),
        reason="the rows of the mode 'hard' cannot give way",
        remedy="take another mode",
    ),
    Rule(
        of=("leader", "path"),
        excludes=("mode", ("slack", "hard", "lexicographic")),
        reason="a path waits for the arm only where its rate is a variable of the QP",
        remedy='make the planner with task=ftqp.Task(mode="scaled")',
    ),
    Rule(
        of=("leader", "base"),
        excludes=("mode", ("scaled",)),
        reason="an inertial target waits for no path",
        remedy="take mode 'slack'",
    ),
    Rule(
        of=("leader", "base"),
        excludes=("level", ("acceleration",)),
        reason="the loop above a moving base is one of velocities",
        remedy="make the planner with level='velocity'",
    ),
)


def refuse(given: Mapping[str, str] | None = None, /, **chosen: str) -> None:
    """Raise when choices exclude each other; those that are left out break no rule."""
    for rule in RULES:
        choice, value = rule.of
        other, refused = rule.excludes
        if chosen.get(choice) == value and chosen.get(other) in refused:
            raise InputError(rule.sentence(chosen[other], given))
