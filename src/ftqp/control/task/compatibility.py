"""What goes with what: choices that exclude each other, for errors and docs/compatibility.md."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from ftqp.core.errors import InputError

CHOICES: Final[dict[str, tuple[str, ...]]] = {
    "level": ("acceleration", "velocity"),
    "mode": ("slack", "hard", "scaled", "lexicographic"),
    "priority": ("weighted", "position_first"),
    "damping": ("none", "directional"),
    "scheme": ("criterion", "closed form"),
    "backend": ("active_set", "dtrnn", "external"),
    "leader": ("clock", "path", "base"),
}
"""Every choice with its values; the default comes first."""


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


ROBOTS: Final = ("serial", "branches", "mimic joints", "floating base")
"""Kinds of robots: one arm, joints beside the way to a tip, joints that follow others, a body in space."""
NEEDS: Final[dict[str, tuple[str, ...]]] = {
    "targets, tasks, constraints, a scene": ROBOTS,
    "locked and degraded joints, `NMinusOne`": ROBOTS,
    "`PathFollower`, `GoTo`": ROBOTS,
    "drives `position` and `velocity`": ROBOTS,
    "a detector": ROBOTS,
    "drive `torque`": ("serial", "branches", "mimic joints"),
    "schemes without a QP": ("serial", "branches", "mimic joints"),
    "`planner.ways_out`": ("serial", "branches", "mimic joints"),
    "`MujocoPlant`": ("serial", "branches", "mimic joints"),
    "`ServoPlant`": ("serial", "branches", "mimic joints"),
    "a free-swinging joint that is reported": ("serial",),
    "`approximate_pseudoinverse`": ("serial",),
    "`ftqp.postures`, `ftqp.analysis.plan`": ("serial", "branches"),
}
"""What serves which of them; the others are refused in a sentence, by what they ask for.

A joint that swings freely is led by what all links of one chain sweep and where its stops are, which on a
tree, or through a joint that another one drags along, is another study. ``approximate_pseudoinverse`` is a
formula for arms with a spherical wrist. A body that floats has no motor that could give torque or hold it,
and a scheme without a QP has no rows for its momentum. Plans and postures are of one chain at a time.
"""


def broken_rule(**chosen: str) -> tuple[Rule, str] | None:
    """The first rule that choices break, with the excluded value; choices that are left out break none."""
    for rule in RULES:
        choice, value = rule.of
        other, refused = rule.excludes
        if chosen.get(choice) == value and chosen.get(other) in refused:
            return rule, chosen[other]
    return None


def refuse(given: Mapping[str, str] | None = None, /, **chosen: str) -> None:
    """Raise when choices exclude each other."""
    found = broken_rule(**chosen)
    if found is not None:
        rule, value = found
        raise InputError(rule.sentence(value, given))


def robots_table() -> str:
    """What serves which kinds of robots, as a table in Markdown."""
    rows = [f"| | {' | '.join(ROBOTS)} |", "|---|" + "---|" * len(ROBOTS)]
    for what, served in NEEDS.items():
        rows.append(f"| {what} | {' | '.join('yes' if one in served else 'no' for one in ROBOTS)} |")
    return "\n".join(rows)


def table() -> str:
    """The rules as a table in Markdown."""
    rows = ["| this | does not go with | because | instead |", "|---|---|---|---|"]
    for rule in RULES:
        choice, value = rule.of
        other, refused = rule.excludes
        values = ", ".join(f"`{name}`" for name in refused)
        rows.append(f"| {choice} `{value}` | {other} {values} | {rule.reason} | {rule.remedy} |")
    return "\n".join(rows)
