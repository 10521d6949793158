"""What a campaign draws: distributions as a file writes them, and the scenario of one episode.

A key of ``[vary]`` is a key of the scenario (``planner.dt``, ``faults.0.at``), its value one of

    [a, b, c]                               one of these, equally likely
    { one_of = [a, b], weights = [3, 1] }   one of these
    { uniform = [low, high] }, { log_uniform = [low, high] }, { normal = [mean, deviation] }
    { integers = [low, high] }              both ends included
    { joint = "any" }                       the index of a joint of the arm that was drawn
    { start = 0.2 }                         neutral, each joint off by up to that share of its range
    { away = [0.9, 1.1] }                   the way from the tip at the start to a point in a random direction
                                            from the shoulder, so far away in lengths of the stretched arm

A number may be ``times`` or ``plus`` another key that was drawn before or is fixed:
``"faults.0.at" = { uniform = [0.1, 0.9], times = "path.duration" }``. With ``chance = 0.3`` a key is drawn in
three episodes of ten, and in the others it is as the scenario has it. Keys of an entry that the list of this
episode does not have, for it was drawn shorter, are left out: ``faults.0.at`` where ``faults`` is ``[]``.
"""

import copy
from collections.abc import Callable, Iterable, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from ftqp.app.scenario import document
from ftqp.app.scenario.setup import arm_from, shoulder
from ftqp.app.schema.reading import read
from ftqp.app.schema.robot_section import RobotTable
from ftqp.core.checks import is_number
from ftqp.core.errors import InputError, ScenarioError, unknown
from ftqp.model.robot import Robot

MARGIN = 0.02
"""A start stays away from the ends of a joint's range by this share of it."""
LARGEST = 1e15
"""Numbers of a distribution are no larger; whole ones are exact up to here."""
OPEN = 2.0
"""What counts as the range of a joint without ends [rad or m]."""
RELATED: Final = ("times", "plus")
BESIDE: Final = (*RELATED, "weights", "chance")
"""What may stand beside a distribution."""


def _pair(name: str, value: Any) -> tuple[float, float]:
    """Two numbers that rise."""
    if not isinstance(value, list) or len(value) != 2 or not all(is_number(x, LARGEST) for x in value):
        raise InputError(f"{name} is {value!r:.60}, expected two numbers from -{LARGEST:g} to {LARGEST:g}")
    return float(value[0]), float(value[1])


def _rising(name: str, value: Any, least: float = -np.inf, words: str = "") -> tuple[float, float]:
    low, high = _pair(name, value)
    if not least <= low <= high:
        raise InputError(f"{name} is [{low:g}, {high:g}], expected [low, high] with {words}low <= high")
    return low, high


def _uniform(name: str, value: Any, rng: np.random.Generator) -> float:
    return float(rng.uniform(*_rising(name, value)))


def _log_uniform(name: str, value: Any, rng: np.random.Generator) -> float:
    low, high = _rising(name, value, least=np.nextafter(0.0, 1.0), words="0 < ")
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _normal(name: str, value: Any, rng: np.random.Generator) -> float:
    mean, deviation = _pair(name, value)
    if deviation < 0.0:
        raise InputError(f"{name} has the deviation {deviation:g}, expected [mean, deviation] with one >= 0")
    return float(rng.normal(mean, deviation))


def _integers(name: str, value: Any, rng: np.random.Generator) -> int:
    low, high = _rising(name, value)
    if low % 1.0 or high % 1.0:
        raise InputError(f"{name} is [{low:g}, {high:g}], expected whole numbers")
    return int(rng.integers(int(low), int(high) + 1))


NUMBERS: dict[str, Callable[[str, Any, np.random.Generator], float]] = {
    "uniform": _uniform,
    "log_uniform": _log_uniform,
    "normal": _normal,
    "integers": _integers,
}
"""Distributions of numbers by name."""
OTHERS = ("one_of", "joint", "start", "away")
OF_THE_ARM: Final = ("joint", "start", "away")
"""Distributions that take the arm that was drawn."""


def episode(
    scenario: Mapping[str, Any],
    vary: Mapping[str, Any],
    seed: int,
    number: int,
    arms: Callable[[RobotTable, Path], Robot] = arm_from,
    folder: Path = Path(),
) -> tuple[dict[str, Any], dict[str, Any]]:
    """The scenario of an episode, and what was drawn for it, by key.

    The same seed and number give the same episode, whichever others are drawn.
    """
    rng = np.random.default_rng([seed, number])
    tables: dict[str, Any] = copy.deepcopy(dict(scenario))
    drawn: dict[str, Any] = {}
    later = []
    for key, what in vary.items():
        kind = _kind(key, what)
        if not _happens(key, what, rng):
            continue
        if kind in OF_THE_ARM:
            later.append((key, kind, what))
            continue
        if _left_out(key, drawn):
            continue
        drawn[key] = _one(key, what, rng) if kind == "one_of" else _number(key, what, kind, rng, tables)
        put(tables, key, copy.deepcopy(drawn[key]))
    robot = _robot(tables, arms, folder) if later else None
    for key, kind, what in sorted(later, key=lambda one: one[1] == "away"):  # which takes the start
        if robot is not None and not _left_out(key, drawn):
            drawn[key] = _of_the_arm(key, kind, what[kind], robot, tables, rng)
            put(tables, key, copy.deepcopy(drawn[key]))
    return tables, drawn


def refuse_wrong(scenario: Mapping[str, Any], vary: Mapping[str, Any]) -> None:
    """Refuse distributions that are wrong, and keys that lead nowhere, whatever their chance.

    What of them depends on what is drawn is not looked at: the arm, and entries of lists that are drawn, too.
    """
    rng = np.random.default_rng(0)
    tables: dict[str, Any] = copy.deepcopy(dict(scenario))
    before: list[str] = []
    kinds = {key: _kind(key, what) for key, what in vary.items()}
    for key, kind in sorted(kinds.items(), key=lambda one: one[1] in OF_THE_ARM):  # which are drawn last
        what, value = vary[key], None
        _chance(key, what)
        if kind == "one_of":
            value = _one(key, what, rng)
        elif kind in OF_THE_ARM:
            ARM[kind](f"vary.{key}.{kind}", what[kind])
        else:
            value = NUMBERS[kind](f"vary.{key}.{kind}", what[kind], rng)
            for relation in RELATED:
                if relation in what and not _touched(str(what[relation]), before):
                    _related(key, what, relation, tables)
        if not _touched(key, before):
            put(tables, key, copy.deepcopy(value))
        before.append(key)


def _touched(key: str, others: Iterable[str]) -> bool:
    """Whether what stands at a key depends on what is drawn for other ones."""
    return any(f"{key}.".startswith(f"{other}.") or other.startswith(f"{key}.") for other in others)


def _chance(key: str, what: Any) -> float | None:
    """In which share of episodes a key is drawn; None where it always is."""
    if not isinstance(what, Mapping) or "chance" not in what:
        return None
    chance = what["chance"]
    if not is_number(chance) or not 0.0 <= chance <= 1.0:
        raise InputError(f"vary.{key} has the chance {chance!r:.60}, expected a number from 0 to 1")
    return chance


def _happens(key: str, what: Any, rng: np.random.Generator) -> bool:
    """Whether a key that has a chance is drawn in this episode."""
    chance = _chance(key, what)
    return chance is None or bool(rng.random() < chance)


def _left_out(key: str, drawn: Mapping[str, Any]) -> bool:
    """Whether a key is one of an entry that the list that was drawn does not have."""
    parts = key.split(".")
    for at, part in enumerate(parts):
        entries = drawn.get(".".join(parts[:at]))
        if isinstance(entries, list) and part.isdigit() and document.entry(part, entries) is None:
            return True
    return False


def _kind(key: str, what: Any) -> str:
    """Which distribution a value of ``[vary]`` is."""
    if isinstance(what, list):
        kind = "one_of"
    elif isinstance(what, Mapping):
        named = [name for name in what if name not in BESIDE]
        if len(named) != 1:
            raise InputError(f"vary.{key} names {len(named)} distributions, expected one")
        kind = named[0]
        if kind not in NUMBERS and kind not in OTHERS:
            raise unknown("distribution", kind, f"vary.{key}", [*NUMBERS, *OTHERS])
        if kind not in NUMBERS and any(name in what for name in RELATED):
            raise InputError(
                f"vary.{key} has times or plus beside {kind}, expected a distribution of numbers"
            )
    else:
        raise InputError(f"vary.{key} is {what!r:.60}, expected a list of values or a distribution")
    return kind


def _one(key: str, what: Any, rng: np.random.Generator) -> Any:
    """One of several values."""
    values, weights = (what, None) if isinstance(what, list) else (what["one_of"], what.get("weights"))
    if not isinstance(values, list) or not values:
        raise InputError(f"vary.{key} is {values!r:.60}, expected a list of at least one value")
    if weights is None:
        return copy.deepcopy(values[int(rng.integers(len(values)))])
    if (
        not isinstance(weights, list)
        or len(weights) != len(values)
        or not all(is_number(share, LARGEST) and share >= 0.0 for share in weights)
        or not any(weights)
    ):
        raise InputError(
            f"vary.{key}.weights is {weights!r:.60}, expected {len(values)} numbers >= 0 up to {LARGEST:g}, "
            "not all 0"
        )
    shares = np.array(weights, dtype=np.float64)
    return copy.deepcopy(values[int(rng.choice(len(values), p=shares / shares.sum()))])


def _number(
    key: str, what: Mapping[str, Any], kind: str, rng: np.random.Generator, tables: Mapping[str, Any]
) -> float:
    """A number, related to another one or not."""
    value = NUMBERS[kind](f"vary.{key}.{kind}", what[kind], rng)
    for relation in RELATED:
        if relation in what:
            other = _related(key, what, relation, tables)
            value = value * other if relation == "times" else value + other
    return value


def _related(key: str, what: Mapping[str, Any], relation: str, tables: Mapping[str, Any]) -> float:
    """The other number of a number that is related to one."""
    other = look_up(tables, what[relation])
    if not is_number(other, LARGEST):
        raise InputError(
            f"vary.{key} is {relation} {what[relation]!r:.60}, which is no number there, or one "
            f"beyond {LARGEST:g}"
        )
    return other


def _of_the_arm(
    key: str, kind: str, what: Any, robot: Robot, tables: Mapping[str, Any], rng: np.random.Generator
) -> Any:
    """A joint, a start or a way of an arm."""
    name = f"vary.{key}.{kind}"
    ARM[kind](name, what)
    if kind == "joint":
        return int(rng.integers(robot.nv))
    if kind == "start":
        return _start(robot, what, rng)
    return _away(name, robot, what, look_up(tables, "start.q"), rng)


def _any(name: str, what: Any) -> None:
    if what != "any":
        raise InputError(f'{name} is {what!r:.60}, expected "any"; a list names some joints')


def _share(name: str, what: Any) -> None:
    if not is_number(what) or not 0.0 <= what <= 1.0:
        raise InputError(f"{name} is {what!r:.60}, expected a share of the range from 0 to 1")


def _distance(name: str, what: Any) -> tuple[float, float]:
    return _rising(name, what, least=0.0, words="0 <= ")


ARM: Final[dict[str, Callable[[str, Any], object]]] = {"joint": _any, "start": _share, "away": _distance}
"""What refuses a wrong value of a distribution that takes the arm."""


def _away(name: str, robot: Robot, what: Any, q: Any, rng: np.random.Generator) -> list[float]:
    """From the tip at a start to a point in a random direction from the shoulder."""
    share = rng.uniform(*_distance(name, what))
    found = shoulder(robot)
    if found is None:
        raise InputError(
            f"{name} is a distance from the shoulder, and {robot.joints[0]} slides: draw other robots"
        )
    centre, reach = found
    direction = rng.standard_normal(3)
    tip = robot.pose(robot.neutral if q is None else robot.angles(q))[:3, 3]
    way = centre + share * reach * direction / np.linalg.norm(direction) - tip
    return [float(x) for x in way]


def _start(robot: Robot, share: float, rng: np.random.Generator) -> list[float]:
    """The neutral posture, each joint off by up to a share of its range, and inside it."""
    low, high = robot.limits.q_min, robot.limits.q_max
    spread = np.where(np.isfinite(high - low), high - low, OPEN)
    q = robot.neutral + share * rng.uniform(-1.0, 1.0, robot.nv) * spread
    return [float(x) for x in np.clip(q, low + MARGIN * spread, high - MARGIN * spread)]


def _robot(tables: Mapping[str, Any], arms: Callable[[RobotTable, Path], Robot], folder: Path) -> Robot:
    try:
        table = read(RobotTable, tables.get("robot"), "the robot has errors:", "scenario.robot")
    except ScenarioError as error:
        raise InputError("; ".join(error.errors)) from error
    return arms(table, folder)


def look_up(tables: Mapping[str, Any], key: Any) -> Any:
    """The value of a dotted key; None where there is none."""
    at: Any = tables
    for part in str(key).split("."):
        if isinstance(at, Mapping):
            at = at.get(part)
        else:
            index = document.entry(part, at)
            at = None if index is None else at[index]
    return at


def put(tables: dict[str, Any], key: str, value: Any) -> None:
    """Put a value at a dotted key; tables on the way are made."""
    at: Any = tables
    last = key.split(".")[-1]
    for part, after in pairwise(key.split(".")):
        if isinstance(at, dict):
            if part not in at and after.isascii() and after.isdigit():
                raise InputError(
                    f"vary.{key} is of entry {after} of {part}, which the scenario does not have; give it, "
                    f"for example as [[scenario.{part}]], or draw {part} first"
                )
            at = at.setdefault(part, {})
        else:
            index = document.entry(part, at)
            at = None if index is None else at[index]
    index = document.entry(last, at)
    if isinstance(at, dict):
        at[last] = value
    elif index is not None:
        at[index] = value
    else:
        raise InputError(
            f"vary.{key} leads to no table of the scenario; name keys as `ftqp check --keys` does"
        )
