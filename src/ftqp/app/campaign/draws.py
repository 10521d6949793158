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
    { regular = 0.1 }                       a posture inside the ranges, the smallest singular value of whose
                                            Jacobian, in lengths of the arm, is at least this
    { share = [0.1, 0.2], of = "length" }   a number, so many times the length of the stretched arm [m], the
                                            "load" that it holds at its full length [kg], or its "weight" [N]
    { vector = [0.1, 0.2], of = "length" }  a vector in a random direction, so many times as long
    { each = [0.3, 1.5], of = "rotor" }     a number for every joint, so many times its "torque" limit or what
                                            its "rotor" usually has; of 1 where ``of`` is absent

A number may be ``times`` or ``plus`` another key that was drawn before or is fixed:
``"faults.0.at" = { uniform = [0.1, 0.9], times = "path.duration" }``. With ``chance = 0.3`` a key is drawn in
three episodes of ten, and in the others it is as the scenario has it. Keys of an entry that the list of this
episode does not have, for it was drawn shorter, are left out: ``faults.0.at`` where ``faults`` is ``[]``.

What belongs together is drawn together: ``[bundles.GROUP.NAME]`` has keys of the scenario with their values,
and one bundle of every group is drawn, as often as its ``weight`` says (1 if absent). What a bundle has is
not drawn, but keys inside its tables and lists are, those that they have.
"""

import copy
from collections.abc import Callable, Iterator, Mapping
from itertools import islice, pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from ftqp.app.scenario import document
from ftqp.app.scenario.setup import arm_from, shoulder
from ftqp.app.schema.reading import read
from ftqp.app.schema.robot_section import RobotTable
from ftqp.core.checks import FloatArray, is_number
from ftqp.core.errors import InputError, ScenarioError, unknown
from ftqp.model.robot import Robot
from ftqp.model.shape import reach_of

MARGIN = 0.02
"""A start stays away from the ends of a joint's range by this share of it."""
LARGEST = 1e15
"""Numbers of a distribution are no larger; whole ones are exact up to here."""
OPEN = 2.0
"""What counts as the range of a joint without ends [rad or m]."""
AWAY, SPREAD = 0.3, 0.6
"""A regular posture is so far from the ends of ranges, or a fifth of them, and from neutral [rad or m]."""
TRIES, POSTURES = 1000, 32
"""Postures that are tried, and those that say what an arm can hold."""
HEAVY, ROTORS = 0.1, (0.1, 0.02)
"""Behind more inertia than this at the neutral posture stands the rotor of a shoulder, else of a wrist or
of a small arm, as the joint feels them [kg m2 or kg]: geared arms have 0.02 to 0.3."""
GRAVITY = 9.81
"""[m/s2]"""
Bundles = Mapping[str, Mapping[str, Mapping[str, Any]]]
"""Values of keys that are drawn together, by group and name."""
OF_A_BUNDLE: Final = ("weight",)
"""What a bundle says of itself."""
RELATED: Final = ("times", "plus")
BESIDE: Final = (*RELATED, "weights", "chance", "of")
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
OF_THE_ARM: Final = ("joint", "start", "away", "regular", "share", "vector", "each")
OTHERS = ("one_of", *OF_THE_ARM)
"""Distributions that take the arm that was drawn."""


def episode(
    scenario: Mapping[str, Any],
    vary: Mapping[str, Any],
    seed: int,
    number: int,
    arms: Callable[[RobotTable, Path], Robot] = arm_from,
    folder: Path = Path(),
    bundles: Bundles = MappingProxyType({}),
) -> tuple[dict[str, Any], dict[str, Any]]:
    """The scenario of an episode, and what was drawn for it, by key; of bundles by group."""
    rng = np.random.default_rng([seed, number])
    tables: dict[str, Any] = copy.deepcopy(dict(scenario))
    drawn: dict[str, Any] = {}
    tied: dict[str, Any] = {}
    later = []
    for group, choices in bundles.items():
        drawn[group] = name = _bundle(group, choices, rng)
        for key, value in choices[name].items():
            if key not in OF_A_BUNDLE:
                tied[key] = value
                put(tables, key, copy.deepcopy(value))
    for key, what in vary.items():
        kind = _kind(key, what)
        if not _happens(key, what, rng) or key in tied or _without(key, bundles, tables):
            continue
        if kind in OF_THE_ARM:
            later.append((key, kind, what))
            continue
        if _left_out(key, tied | drawn):
            continue
        drawn[key] = _one(key, what, rng) if kind == "one_of" else _number(key, what, kind, rng, tables)
        put(tables, key, copy.deepcopy(drawn[key]))
    robot = _robot(tables, arms, folder) if later else None
    for key, kind, what in sorted(later, key=lambda one: one[1] == "away"):  # which takes the start
        if robot is not None and not _left_out(key, tied | drawn):
            drawn[key] = _of_the_arm(key, kind, what, robot, tables, rng)
            put(tables, key, copy.deepcopy(drawn[key]))
    return tables, drawn


def _bundle(group: str, choices: Mapping[str, Mapping[str, Any]], rng: np.random.Generator) -> str:
    """The name of a bundle of a group."""
    names = list(choices)
    weights = [choices[name].get("weight", 1.0) for name in names]
    return str(_one(group, {"one_of": names, "weights": weights}, rng, "bundles."))


def refuse_wrong(vary: Mapping[str, Any], bundles: Bundles = MappingProxyType({})) -> None:
    """Refuse distributions that are wrong, whatever their chance; what is wrong of a key shows when drawn."""
    rng = np.random.default_rng(0)
    for group, choices in bundles.items():
        _bundle(group, choices, rng)
    for key, what in vary.items():
        kind = _kind(key, what)
        _chance(key, what)
        if kind == "one_of":
            _one(key, what, rng)
        elif kind in OF_THE_ARM:
            ARM[kind](f"vary.{key}.{kind}", what[kind])
        else:
            NUMBERS[kind](f"vary.{key}.{kind}", what[kind], rng)


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


def _without(key: str, bundles: Bundles, tables: Mapping[str, Any]) -> bool:
    """Whether a key is one inside of what bundles have, and the bundle that was drawn does not have it."""
    given = {name for choices in bundles.values() for one in choices.values() for name in one}
    at = key
    while at := at.rpartition(".")[0]:
        if at in given:
            return look_up(tables, key) is None
    return False


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
                f"vary.{key} has times or plus together with {kind}, expected a distribution of numbers"
            )
    else:
        raise InputError(f"vary.{key} is {what!r:.60}, expected a list of values or a distribution")
    return kind


def _one(key: str, what: Any, rng: np.random.Generator, above: str = "vary.") -> Any:
    """One of several values."""
    values, weights = (what, None) if isinstance(what, list) else (what["one_of"], what.get("weights"))
    if not isinstance(values, list) or not values:
        raise InputError(f"{above}{key} is {values!r:.60}, expected a list of at least one value")
    if weights is None:
        return copy.deepcopy(values[int(rng.integers(len(values)))])
    if (
        not isinstance(weights, list)
        or len(weights) != len(values)
        or not all(is_number(share, LARGEST) and share >= 0.0 for share in weights)
        or not any(weights)
    ):
        raise InputError(
            f"{above}{key}.weights is {weights!r:.60}, expected {len(values)} numbers >= 0 up to "
            f"{LARGEST:g}, not all 0"
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
    key: str,
    kind: str,
    given: Mapping[str, Any],
    robot: Robot,
    tables: Mapping[str, Any],
    rng: np.random.Generator,
) -> Any:
    """A joint, a start, a way or a number of an arm."""
    name, what = f"vary.{key}.{kind}", given[kind]
    ARM[kind](name, what)
    of = _measured(name, kind, robot, given.get("of"))
    if kind == "joint":
        return int(rng.integers(robot.nv))
    if kind == "start":
        return _start(robot, what, rng)
    if kind == "regular":
        return _regular(name, robot, what, rng)
    if kind == "vector":
        direction = rng.standard_normal(3)
        return [float(x) for x in rng.uniform(*what) * of / np.linalg.norm(direction) * direction]
    if kind == "share":
        return float(rng.uniform(*what) * of)
    if kind == "each":
        low, high = np.log(what)
        numbers = of * np.exp(rng.uniform(low, high, robot.nv))
        return dict(zip(robot.joints, map(float, numbers), strict=True))
    return _away(name, robot, what, look_up(tables, "start.q"), rng)


def _measured(name: str, kind: str, robot: Robot, of: Any) -> Any:
    """What shares are of: a number of an arm, or one of every joint, (nv,)."""
    made = OF.get(kind, {})
    if not made or (of is None and kind == "each"):
        return 1.0
    if of is None:
        raise InputError(f"{name} says not of what; give of = one of {', '.join(made)}")
    if of not in made:
        raise unknown("measure", str(of), name, tuple(made))
    return made[of](robot)


def _load(robot: Robot) -> float:
    """The mass that an arm holds at its full length in any of some postures, beside its own weight [kg]."""
    weights = [np.abs(robot.bias(q, np.zeros(robot.nv))) for q in islice(_postures(robot), POSTURES)]
    left = float(np.min(robot.limits.tau_max - np.max(weights, axis=0)))
    if not np.isfinite(left):
        raise InputError(f"{robot.name} has no torque limits, so that it holds any load; draw a mass")
    return max(0.0, left) / (GRAVITY * reach_of(robot.chain, robot.limits))


def _rotor(robot: Robot) -> FloatArray:
    """What rotors behind gears usually have, felt at the joints, (nv,) [kg m2 or kg]."""
    return np.where(np.diag(robot.mass_matrix(robot.neutral)) > HEAVY, *ROTORS)


def _torque(robot: Robot) -> FloatArray:
    return np.asarray(robot.limits.tau_max)


_NUMBERS: Final[dict[str, Callable[[Robot], Any]]] = {
    "length": lambda robot: reach_of(robot.chain, robot.limits),
    "load": _load,
    "weight": lambda robot: GRAVITY * _load(robot),
}
OF: Final[dict[str, dict[str, Callable[[Robot], Any]]]] = {
    "share": _NUMBERS,
    "vector": _NUMBERS,
    "each": {"rotor": _rotor, "torque": _torque},
}
"""What shares may be of, by distribution."""


def _postures(robot: Robot, rng: np.random.Generator | None = None) -> Iterator[FloatArray]:
    """Random postures well inside the ranges."""
    rng = np.random.default_rng(0) if rng is None else rng
    low, high = robot.limits.q_min, robot.limits.q_max
    room = np.minimum(AWAY, 0.2 * (high - low))
    for _ in range(TRIES):
        yield np.clip(robot.neutral + rng.uniform(-SPREAD, SPREAD, robot.nv), low + room, high - room)


def _regular(name: str, robot: Robot, least: float, rng: np.random.Generator) -> list[float]:
    """A posture far from singular ones."""
    for q in _postures(robot, rng):
        J = robot.jacobian(q).copy()
        J[:3] /= robot.length
        if np.linalg.svd(J, compute_uv=False)[min(robot.nv, 6) - 1] >= least:
            return [float(x) for x in q]
    raise InputError(f"{name} is {least:g}, and none of {TRIES} postures of {robot.name} is so regular")


def _any(name: str, what: Any) -> None:
    if what != "any":
        raise InputError(f'{name} is {what!r:.60}, expected "any"; a list names some joints')


def _share(name: str, what: Any) -> None:
    if not is_number(what) or not 0.0 <= what <= 1.0:
        raise InputError(f"{name} is {what!r:.60}, expected a share of the range from 0 to 1")


def _distance(name: str, what: Any) -> tuple[float, float]:
    return _rising(name, what, least=0.0, words="0 <= ")


def _positive(name: str, what: Any) -> tuple[float, float]:
    return _rising(name, what, least=np.nextafter(0.0, 1.0), words="0 < ")


ARM: Final[dict[str, Callable[[str, Any], object]]] = {
    "joint": _any,
    "start": _share,
    "away": _distance,
    "regular": _share,
    "share": _distance,
    "vector": _distance,
    "each": _positive,
}
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


def look_up(tables: Any, key: Any) -> Any:
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
