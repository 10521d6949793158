"""Whatever a planner hands out is written into, and so is the record behind it."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

import ftqp
from ftqp.kernel.layout.enums import JOINTS
from ftqp.kernel.layout.rooms import ROOMS
from fuzz.inside.world import World
from fuzz.world import last_line

Array = np.ndarray[Any, Any]
TRUSTED = ("gate", "chain", "limits")
"""The rooms that the gate judges by, and the arm itself."""
PERIOD = ("state", "dt")
"""The sampling period, by which it judges, too."""
ANOTHER = (np.nan, np.inf, -np.inf, 1e300, -1e4, 0.3, 0.0, 1e-310)


def _another(x: Array, rng: Any) -> None:
    x[...] = ANOTHER[int(rng.integers(len(ANOTHER)))]


def _one(x: Array, rng: Any) -> None:
    x.flat[int(rng.integers(x.size))] = ANOTHER[int(rng.integers(len(ANOTHER)))]


def _degrees(x: Array, rng: Any) -> None:
    x *= 180.0 / np.pi


def _noise(x: Array, rng: Any) -> None:
    x += rng.normal(0.0, 1e-4, x.shape)


def _mixed(x: Array, rng: Any) -> None:
    x[...] = rng.permutation(x.ravel()).reshape(x.shape)


def _out(x: Array, rng: Any) -> None:
    np.multiply(x, -3.0, out=x)


def _filled(x: Array, rng: Any) -> None:
    x.fill(np.nan)


def _copied(x: Array, rng: Any) -> None:
    np.copyto(x, 1e300)


def _partitioned(x: Array, rng: Any) -> None:
    np.ndarray.sort(x, axis=-1)
    x[...] = x[..., ::-1] + 1.0


WAYS = (_another, _another, _one, _degrees, _noise, _mixed, _out, _filled, _copied, _partitioned)


def fields(session: Any) -> list[tuple[str, Array]]:
    """Every float of a record but those that are trusted, by room and name."""
    found = []
    for room, made in ROOMS.items():
        for name, kind, *_ in made(JOINTS):
            if room not in TRUSTED and (room, name) != PERIOD and kind == "f8":
                found.append((f"{room}.{name}", session.field(room, name)))
    return found


def into_record(world: World, places: list[tuple[str, Array]]) -> None:
    """Write straight into what the planner remembers."""
    rng = world.rng
    for _ in range(1 + int(rng.integers(3)) ** 2):
        _, x = places[int(rng.integers(len(places)))]
        with np.errstate(all="ignore"):
            WAYS[int(rng.integers(len(WAYS)))](x, rng)


@cache
def _targets() -> Any:
    poses = np.tile(np.eye(4), (5, 1, 1))
    return ftqp.Targets(poses)


HANDED_OUT: dict[str, Callable[[World], Any]] = {
    "step": lambda world: world.step,
    "step.reference": lambda world: world.step.reference,
    "step.copy()": lambda world: world.step.copy(),
    "planner": lambda world: world.planner,
    "planner.session()": lambda world: world.planner.session().K,
    "planner.view()": lambda world: world.planner.view(),
    "planner.view().limits": lambda world: world.planner.view().limits,
    "planner.view().command": lambda world: world.planner.view().command,
    "planner.diagnosis": lambda world: world.planner.diagnosis,
    "robot": lambda world: world.planner.robot,
    "robot.limits": lambda world: world.planner.robot.limits,
    "robot.chain": lambda world: world.planner.robot.chain,
    "target": lambda world: world.target,
    "targets": lambda world: _targets(),
}
"""What is walked; attributes of each that are arrays are written into, others are set."""
SET = (np.nan, None, 1e300, "home", np.zeros(7), True)
MAY_BE_SET = {"planner.speed", "target.pose", "target.position", "target.twist", "target.acceleration",
              "targets.row", "targets.packed"}  # fmt: skip
FORCED = ("step", "step.reference", "step.copy()", "planner.view()", "planner.session()", "target", "targets")
"""Whose arrays are written into where numpy lets one make them writable: no model, which others share."""


SINGULAR = ("measures", "sigma_min", "manipulability", "condition", "certificate")
"""Numbers of a step that LAPACK makes of the Jacobian, which prints a line where that is not finite."""


@cache
def _names(kind: type) -> tuple[str, ...]:
    """Public attributes of a kind that are no methods."""
    slots = [name for one in kind.__mro__ for name in getattr(one, "__slots__", ())]
    names = dict.fromkeys([*slots, *dir(kind)])
    return tuple(
        name for name in names if not name.startswith("_") and not callable(getattr(kind, name, None))
    )


def into_what_is_handed_out(world: World) -> None:
    """Pick an attribute of what was handed out, and spoil it in some way."""
    rng, names = world.rng, tuple(HANDED_OUT)
    owner_name = names[int(rng.integers(len(names)))]
    owner = HANDED_OUT[owner_name](world)
    names = _names(type(owner)) if type(owner).__module__ != "numpy" else ()
    if not names:
        return
    name = names[int(rng.integers(len(names)))]
    path = f"{owner_name}.{name}"
    if name in SINGULAR:
        return
    value = getattr(owner, name)
    if isinstance(value, np.ndarray):
        if value.dtype == np.float64 and value.size:
            _into_array(world, owner_name, path, value)
    elif isinstance(value, dict):
        value.clear()  # a copy of the planner's own
    elif path not in MAY_BE_SET and owner_name != "planner.session()":
        _set(world, owner, name, path)
    if isinstance(value, np.ndarray) and path not in MAY_BE_SET and rng.random() < 0.3:
        _set(world, owner, name, path)


def _set(world: World, owner: Any, name: str, path: str) -> None:
    """Nothing that is handed out takes another object for one of its attributes."""
    value = SET[int(world.rng.integers(len(SET)))]
    before = getattr(owner, name)
    try:
        setattr(owner, name, value)
    except (AttributeError, TypeError, ftqp.FtqpError):
        return
    except Exception as error:
        world.watch.say_disagreement(f"{path} = {value!r}: {last_line(error)}")
        return
    world.watch.say_disagreement(f"{path} could be set to {value!r}")
    setattr(owner, name, before)


def _into_array(world: World, owner: str, path: str, x: Array) -> None:
    """An array that cannot be written refuses every way; one that can is spoilt."""
    rng = world.rng
    way = WAYS[int(rng.integers(len(WAYS)))]
    with np.errstate(all="ignore"):
        if x.flags.writeable:
            way(x, rng)
            return
        before = x.tobytes()
        try:
            way(x, rng)
        except ValueError:
            pass
        else:
            world.watch.say_disagreement(f"{path} is read-only, and {way.__name__} did not raise")
        if x.tobytes() != before:
            world.watch.say_disagreement(f"{path} is read-only, and was written")
        try:
            x.resize((x.size + 1,))
        except ValueError:
            pass
        else:
            world.watch.say_disagreement(f"{path} is read-only, and was resized")
        if owner in FORCED:
            _by_force(world, x, way)


def _by_force(world: World, x: Array, way: Callable[[Array, Any], None]) -> None:
    """Write through an array that numpy lets one make writable, or through the memory it is a view of."""
    if world.rng.random() < 0.5:
        try:
            x.setflags(write=True)
        except ValueError:
            return
        try:
            way(x, world.rng)
        finally:
            x.setflags(write=False)
    else:
        base = x.base
        while isinstance(base, np.ndarray) and not base.flags.writeable and base.base is not None:
            base = base.base
        if isinstance(base, np.ndarray) and base.flags.writeable and base.dtype == np.float64:
            way(base, world.rng)
