"""What happened in a run, in words; lengths in the unit that reads best."""

from collections.abc import Mapping
from math import degrees
from typing import Any

from ftqp.control.drive.learned_servos import UNKNOWN
from ftqp.faults.kinds import kind_of

KEPT = 1e-9
"""A limit exceeded by less than this was kept; less is rounding [SI units]."""

RUBS = 0.01
"""Dry friction below this [N m] is not said."""


def report(facts: Mapping[str, Any]) -> list[str]:
    """A summary, line by line."""
    times = facts["step_time_us"]
    return [
        f"{facts['scenario']}: {facts['robot']}, scheme {facts['scheme']}, backend {facts['backend']}, "
        f"{facts['level']} level, dt {1e3 * facts['dt']:g} ms",
        *(f"  {_happened(fault, facts)}" for fault in facts["faults"]),
        f"  {ending(facts)}",
        *(f"  {said}" for said in kept_sentences(facts)),
        *(
            []
            if times["p50"] is None
            else [f"  a step took {times['p50']:.1f} us, at most {times['max']:.0f} us"]
        ),
        f"  files: {facts['folder']}",
        *([recording_sentence(facts["recording"])] if "recording" in facts else []),
    ]


def kept_sentences(facts: Mapping[str, Any]) -> list[str]:
    """How near the tool stayed to its path, whether limits were kept, and what else was asked for."""
    turned = facts["max_rotation_error"]
    return [
        f"the tool was at most {length(facts['max_position_error'])} from its path"
        + (f" and turned away by at most {turned:.2g} rad" if turned else ""),
        limits_sentence(facts["max_limit_violation"]),
        *further_sentences(facts),
    ]


def ending(facts: Mapping[str, Any]) -> str:
    """How the run ended."""
    if facts["interrupted"]:
        return f"interrupted after {facts['steps']} steps"
    if facts["completed"]:
        relaxed = facts["status_counts"].get("RELAXED", 0)
        part = f", {relaxed} of them RELAXED: the task was kept in part" if relaxed else ""
        return f"completed in {facts['steps']} steps{part}"
    if facts["stopped_at"] is not None:
        return f"stopped at {facts['stopped_at']:.2f} s: the task could not go on"
    if facts.get("blocked"):
        return f"blocked: {facts['blocked']}"
    return f"not completed: {facts['final_status']}"


def fault_sentence(fault: Mapping[str, Any]) -> str:
    """A fault of the summary in words."""
    what = kind_of(fault["kind"]).happens
    at = fault["announced"]
    if at is None:
        heard = "nobody reports it"
    elif at > fault["at"]:
        heard = f"reported at {at:g} s"
    else:
        heard = "reported at once"
    return f"{fault['joint']} {what} at {fault['at']:g} s; {heard}{found_sentence(fault)}"


def _happened(fault: Mapping[str, Any], facts: Mapping[str, Any]) -> str:
    """A fault in words, or that the run has ended before it."""
    end = facts["steps"] * facts["dt"]
    if fault["at"] <= end:
        return fault_sentence(fault)
    what = kind_of(fault["kind"]).happens
    return f"{fault['joint']} {what} at {fault['at']:g} s only, behind the end of the run at {end:g} s"


def late_sentence(joint: str, at: float, end: float, *, may_take_longer: bool) -> str:
    """That a fault of a scenario comes behind the end of its run."""
    ends = f"the path ends at {end:g} s" if may_take_longer else f"the run ends at {end:g} s"
    then = "it happens only where the arm is so much slower" if may_take_longer else "it never happens"
    return f"the fault of {joint} at {at:g} s comes too late: {ends}, so that {then}; give it an earlier at"


def found_sentence(fault: Mapping[str, Any]) -> str:
    """What the planner's detector made of a fault, after a comma; nothing without a detector."""
    if "detected_at" not in fault:
        return ""
    if fault["detected_at"] is None:
        return ", and the planner does not detect it"
    after = 1e3 * (fault["detected_at"] - fault["at"])
    return f", and the planner detects it as {fault['detected_as'].replace('_', ' ')} after {after:.0f} ms"


def limits_sentence(violation: Mapping[str, float]) -> str:
    """Whether the limits were kept, in words."""
    names = {"q": "position", "v": "velocity", "a": "acceleration", "tau": "torque"}
    broken = [f"{names[key]} by {value:.2g}" for key, value in violation.items() if value > KEPT]
    return f"limits exceeded: {', '.join(broken)}" if broken else "every joint limit was kept"


def further_sentences(facts: Mapping[str, Any]) -> list[str]:
    """How well each soft task was done, and how near what is kept came to its boundary; none without any."""
    said = []
    for name, task in facts.get("tasks", {}).items():
        last, most = (_error(task[key], task["unit"]) for key in ("final_error", "max_error"))
        said.append(f"the task {name} was {last} off at the end, and {most} at most")
    said += [_kept_sentence(name, kept) for name, kept in facts.get("constraints", {}).items()]
    said += [_clear_sentence(name, one) for name, one in facts.get("clearance", {}).items()]
    return said + ([_learned_sentence(facts["learned"])] if "learned" in facts else [])


def _learned_sentence(learned: Mapping[str, Any]) -> str:
    """What was learned of servos, or beside a torque arm's model, joints that hardly moved left out."""
    if "joints" in learned:
        known = [one["lag"] for one in learned["joints"].values() if one["lag"][1] < UNKNOWN]
        if not known:
            return "nothing of the servos was estimated, because no joint moved enough"
        most = max((1e3 * lag for lag, error in known if lag > 2.0 * error), default=None)
        return f"servos were found to lag by up to {most:.3g} ms" if most else "no servo was found to lag"
    pairs = zip(learned["rotors"], learned["rotors_error"], strict=True)
    rotors = [rotor for rotor, error in pairs if abs(rotor) > 2.0 * error]
    load, friction = learned["payload"], max(learned["friction"], default=0.0)
    parts = [f"rotors of {min(rotors):.2g} to {max(rotors):.2g} kg m2"] if rotors else []
    parts += [f"dry friction of up to {friction:.2g} N m"] if friction > RUBS else []
    parts += [f"a load of {load['mass']:.3g} kg"] if load is not None else []
    what = " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts) or "nothing"
    return f"compared with its model the arm was found to have {what}"


def _clear_sentence(name: str, one: Mapping[str, Any]) -> str:
    """How near the arm came to something, or to itself."""
    nearest = one["min_distance"]
    if nearest is None:
        return f"how near the arm came to {name} is unknown"
    if nearest < 0.0:
        return f"the arm was up to {length(-nearest)} inside {name}"
    return f"the arm stayed {length(nearest)} away from {name} at the nearest"


def away_of(kept: Mapping[str, Any]) -> str:
    """How far something that is kept was from its boundary, in the unit that reads best."""
    far, unit = abs(kept["min_distance"]), kept.get("unit", "rad" if kept.get("shape") == "cone" else "m")
    if unit == "m":
        return length(far)
    return f"{degrees(far):.2g} deg" if unit == "rad" else f"{far:.3g} {unit}"


def _kept_sentence(name: str, kept: Mapping[str, Any]) -> str:
    """How near something that is kept came to its plane, box or cone."""
    nearest, shape = kept["min_distance"], kept.get("shape", "plane")
    if nearest is None:
        return f"how near {name} came to its {shape} is unknown"
    away = away_of(kept)
    if nearest < 0.0:
        return f"{name} was up to {away} {'beyond' if shape == 'plane' else 'outside'} its {shape}"
    if shape == "plane":
        return f"{name} stayed on its side of its plane, {away} away at the nearest"
    return f"{name} stayed inside its {shape}, {away} from its boundary at the nearest"


def _error(size: float | None, unit: str | None) -> str:
    """The size of an error in its unit; a length in the unit that reads best."""
    if size is None:
        return "an unknown amount"
    if unit == "m":
        return length(size)
    return f"{size:.2g} {unit or ''}".rstrip()


def recording_sentence(facts: Mapping[str, Any]) -> str:
    """What became of the QPs of a run that was to be recorded."""
    if facts["file"] is None:
        return "  recorded no QP: none was handed to the solver in the ticks asked for; no file was written"
    first, last = facts["ticks"]
    gone = f"; {facts['dropped']} older ones did not fit into memory" if facts["dropped"] else ""
    return (
        f"  recorded {facts['qps']} QPs of ticks {first} to {last}{gone}; look at one: "
        f"ftqp replay {facts['file']} --tick {last}"
    )


def length(metres: float | None) -> str:
    """A length in the unit that reads best."""
    if metres is None:
        return "an unknown distance"
    for factor, unit, least in ((1.0, "m", 1.0), (1e3, "mm", 0.1)):
        if metres * factor >= least:
            return f"{metres * factor:.3g} {unit}"
    return f"{metres * 1e6:.2g} um"
