"""What a log says of its run, believed only where it is of the kind that ftqp writes."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NoReturn, final

from ftqp.core.checks import is_number
from ftqp.core.errors import InputError
from ftqp.faults.kinds import KINDS

TEXTS: Final = (
    "resolved", "robot", "scheme", "backend", "level", "task_mode", "path", "reference", "state",
    "broken",
)  # fmt: skip
NUMBERS: Final = ("dt", "ticks", "duration", "path_duration")
_TASK: Final = {"name": None, "kind": None, "unit": ""}
"""Texts that a soft task has, and what takes the place of one that may be absent."""
_KEPT: Final = {"plane": ("above", "normal"), "box": (), "cone": ("along", "axis_at_zero")}
"""Vectors that something kept has, by its kind."""
_OTHERS: Final = ("rows", "torque")
"""Kinds of constraints of which a log says nothing more."""
LIMITS: Final = ("q_min", "q_max", "v_max", "a_max", "tau_max")


@final
class RunFacts(dict[str, Any]):
    """What a log says of its run, by key; it is an error in a sentence to ask for what it does not say."""

    def __missing__(self, key: str) -> NoReturn:
        raise InputError(
            f"the log does not say {key!r} of its run, as every log of ftqp does; make it anew by ftqp run"
        )


def strange_fact(facts: Mapping[str, Any]) -> str | None:
    """The first of the facts that is not as ftqp writes it, in words; None where all are."""
    for key in TEXTS:
        if not isinstance(facts.get(key, ""), str | None):
            return f"its {key} is {facts[key]!r:.40}, expected a text"
    for key in NUMBERS:
        if key in facts and not is_number(facts[key]):
            return f"its {key} is {facts[key]!r:.40}, expected a number"
    if facts.get("dt", 1.0) <= 0.0:
        return f"its dt is {facts['dt']!r:.40}, expected a number above 0"
    joints = facts.get("joints")
    if joints is not None and not _list(joints, lambda name: isinstance(name, str)):
        return f"its joints are {joints!r:.40}, expected a list of names"
    count = len(joints or ())
    slides = facts.get("prismatic", [False] * count)
    if not (_list(slides, lambda flag: isinstance(flag, bool)) and len(slides) == count):
        return f"its prismatic is {slides!r:.40}, expected true or false for each of {count} joints"
    return (
        _strange_limits(facts, count)
        or _strange_faults(facts, count)
        or _strange_further(facts, joints or ())
        or _strange_rest(facts)
    )


def _strange_limits(facts: Mapping[str, Any], count: int) -> str | None:
    limits = facts.get("limits", {})
    if not isinstance(limits, dict):
        return f"its limits are {limits!r:.40}, expected a table"
    for name, values in limits.items():
        good = _list(values, lambda value: value is None or is_number(value)) and len(values) == count
        if name in LIMITS and not good:
            return f"its limit {name} is {values!r:.40}, expected a number or null for each of {count} joints"
    return None


def _strange_faults(facts: Mapping[str, Any], count: int) -> str | None:
    faults = facts.get("faults", [])
    if not _list(faults, lambda fault: isinstance(fault, dict)):
        return f"its faults are {faults!r:.40}, expected a list of tables"
    for fault in faults:
        index, told = fault.get("index"), fault.get("announced")
        good = (
            isinstance(fault.get("kind"), str)
            and fault["kind"] in KINDS
            and isinstance(fault.get("joint"), str)
            and isinstance(index, int)
            and not isinstance(index, bool)
            and 0 <= index < count
            and is_number(fault.get("at"))
            and (told is None or is_number(told))
        )
        if not good:
            return f"it has the fault {fault!r:.60}, expected its kind, joint, index, at and announced"
    return None


def _strange_further(facts: Mapping[str, Any], joints: Sequence[str]) -> str | None:
    """Soft tasks and kept points, of which only some runs have any."""
    tasks, kept = facts.get("tasks", []), facts.get("constraints", [])
    if not _list(tasks, lambda one: isinstance(one, dict) and _is_task(one)):
        return f"its tasks are {tasks!r:.60}, expected tables with name, kind and unit"
    if not _list(kept, lambda one: isinstance(one, dict) and _is_kept(one, joints)):
        return (
            f"its constraints are {kept!r:.60}, expected tables with name, kind, joint, at_zero, braking and "
            "the plane, box or cone"
        )
    around = facts.get("scene", [])
    if not _list(around, lambda one: isinstance(one, dict) and _is_placed(one)):
        return f"its scene is {around!r:.60}, expected tables with name, kind, extent and pose"
    bodies = facts.get("bodies", [])
    if not _list(bodies, lambda one: isinstance(one, dict) and _is_body(one, joints)):
        return f"its bodies are {bodies!r:.60}, expected tables with name, joint, ends_at_zero and radius"
    return None


def _is_placed(one: Mapping[str, Any]) -> bool:
    """Whether something stands around an arm, or is the arm."""
    if not (isinstance(one.get("name"), str) and isinstance(one.get("kind"), str)):
        return False
    pose = one.get("pose")
    placed = _list(pose, lambda row: _list(row, is_number) and len(row) == 4) and len(pose or ()) == 4
    corners = one.get("corners", [])
    shaped = _three(one.get("extent"), is_number) and _list(corners, lambda row: _three(row, is_number))
    return one["kind"] == "arm" or (placed and shaped and (one["kind"] != "hull" or len(corners) > 3))


def _is_body(one: Mapping[str, Any], joints: Sequence[str]) -> bool:
    """Whether something is a body of the arm."""
    ends = one.get("ends_at_zero")
    return (
        isinstance(one.get("name"), str)
        and (one.get("joint") is None or one["joint"] in joints)
        and is_number(one.get("radius"))
        and _list(ends, lambda end: _three(end, is_number))
        and len(ends or ()) == 2
    )


def _is_task(one: Mapping[str, Any]) -> bool:
    """Whether something is a soft task."""
    place = one.get("place", [0.0] * 3)
    texts = all(isinstance(one.get(key, least), str) for key, least in _TASK.items())
    return texts and _list(place, is_number) and len(place) == 3


def _is_kept(one: Mapping[str, Any], joints: Sequence[str]) -> bool:
    """Whether something is a point or an axis that was kept somewhere, or rows of the user's own."""
    kind = one.get("kind", "plane")
    if not isinstance(one.get("name"), str) or kind not in (*_KEPT, *_OTHERS):
        return False
    return kind in _OTHERS or (
        one.get("joint") in joints
        and is_number(one.get("braking"))
        and all(_three(one.get(key), is_number) for key in ("at_zero", *_KEPT[kind]))
        and (kind != "cone" or is_number(one.get("within")))
        and (kind != "box" or _is_box(one.get("inside")))
    )


def _is_box(inside: Any) -> bool:
    """Whether something is the corners of a box; None is a side that was left out."""
    return (
        _list(inside, lambda corner: _three(corner, lambda place: place is None or is_number(place)))
        and len(inside) == 2
    )


def _three(value: Any, good: Callable[[Any], bool]) -> bool:
    return _list(value, good) and len(value) == 3


def _strange_rest(facts: Mapping[str, Any]) -> str | None:
    found = facts.get("detections")
    if found is not None and not _list(found, _is_detection):
        return f"its detections are {found!r:.40}, expected tables with joint, detected_at and kinds"
    learned = facts.get("learned")
    if learned is not None and not _is_learned(learned, len(facts.get("joints", ()))):
        return f"what was learned is {learned!r:.60}, expected rotors, rotors_error, friction and payload"
    versions, emergency = facts.get("versions"), facts.get("emergency")
    if versions is not None and not (
        isinstance(versions, dict) and _list(list(versions.values()), lambda text: isinstance(text, str))
    ):
        return f"its versions are {versions!r:.40}, expected texts by package"
    if emergency is not None and not (
        isinstance(emergency, dict)
        and _list(list(emergency.values()), lambda value: value is None or is_number(value))
    ):
        return f"its emergency is {emergency!r:.40}, expected numbers"
    return None


def _is_detection(one: Any) -> bool:
    """Whether something is what a detector found."""
    return (
        isinstance(one, dict)
        and isinstance(one.get("joint"), str)
        and is_number(one.get("detected_at"))
        and _list(one.get("kinds"), lambda kind: isinstance(kind, str))
    )


def _is_learned(one: Any, count: int) -> bool:
    """Whether something is what a planner has learned of an arm of so many joints."""
    if not isinstance(one, dict):
        return False
    load = one.get("payload")
    return all(
        _list(one.get(name), is_number) and len(one[name]) == count
        for name in ("rotors", "rotors_error", "friction")
    ) and (
        load is None
        or (isinstance(load, dict) and is_number(load.get("mass")) and _three(load.get("com"), is_number))
    )


def _list(value: Any, of: Callable[[Any], bool]) -> bool:
    return isinstance(value, list) and all(of(item) for item in value)
