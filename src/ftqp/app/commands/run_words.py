"""What happened in a run, for a reader who was not there: whole sentences, from its log alone."""

import tomllib
from typing import Any

from ftqp import __version__
from ftqp.app.output import words
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.metrics import summary
from ftqp.viz.report.numbers import carried

LEVELS = {"acceleration": "accelerations", "velocity": "velocities"}
"""What a planner commands at each level."""


def sentences(log: Log) -> list[str]:
    """What happened, a paragraph each."""
    about, facts = log.metadata, summary(log)
    facts["interrupted"] = about.get("state") == "interrupted"
    said = [*_description(log), _who(about), *_cut(log)]
    said += [f"{words.fault_sentence(fault)}." for fault in facts["faults"] if fault["at"] <= log["t"][-1]]
    if about.get("state", "finished") in ("finished", "interrupted"):
        said.append(f"The task: {words.ending(facts)}.")
    turned = facts["max_rotation_error"]
    said.append(
        f"The tool was at most {words.length(facts['max_position_error'])} from its target"
        + (f" and turned away by at most {turned:.2g} rad" if turned else "")
        + f"; {words.limits_sentence(facts['max_limit_violation'])}."
    )
    said += [f"{one[0].upper()}{one[1:]}." for one in words.further_sentences(facts)]
    slides = dict(zip(about["joints"], about["prismatic"], strict=True))
    said += [
        f"The brake of {joint} carried up to {top:.3g} {'N' if slides[joint] else 'N m'}, by the arm's model."
        for joint, top in carried(log).items()
    ]
    return [*said, *_versions(about)]


def _description(log: Log) -> list[str]:
    """What the scenario says of itself."""
    text = log.metadata.get("resolved")
    try:
        found = tomllib.loads(text).get("description") if isinstance(text, str) else None
    except tomllib.TOMLDecodeError:
        return []
    return [" ".join(found.split())] if isinstance(found, str) and found.strip() else []


def _who(about: dict[str, Any]) -> str:
    """Which arm, led by what."""
    commanded = LEVELS.get(str(about.get("level")), "commands")
    period = 1e3 * about["dt"]
    scheme = f", scheme {about['scheme']}" if about.get("scheme") else ""
    backend = f", solver {about['backend']}" if about.get("backend") else ""
    planner = f"every {period:g} ms the planner commands joint {commanded}{scheme}{backend}"
    return f"The arm is {about['robot']}; {planner}."


def _cut(log: Log) -> list[str]:
    """That the log ends before the run did."""
    state, end = log.metadata.get("state", "finished"), float(log["t"][-1])
    if state in ("finished", "interrupted"):
        return []
    return [
        f"This log is cut short: its last row is of {end:.4g} s, and the run did not end in order "
        f"(its state is {state!s:.40}). What follows is what the log has."
    ]


def _versions(about: dict[str, Any]) -> list[str]:
    """That another version made the run."""
    made_by = (about.get("versions") or {}).get("ftqp")
    if made_by in (None, __version__):
        return []
    return [f"The run was made by ftqp {made_by}; ftqp {__version__} made this report of it."]
