"""The tables that the command line prints: robots, backends, schemes, keys of a scenario."""

from inspect import Parameter, getdoc, signature
from typing import Any

from ftqp.app.schema import Scenario
from ftqp.app.schema.reading import plain
from ftqp.control.task import schemes as recipes
from ftqp.core.setting import REQUIRED, every_key, keys_of
from ftqp.model import catalog
from ftqp.qp import backends as known_backends


def robots() -> list[dict[str, str]]:
    """One row a robot of the catalog."""
    return [{"name": name, "what": what} for name, what in catalog.CATALOG.items()]


def backends() -> list[dict[str, str]]:
    """One row a QP backend, with what is missing and how to install it."""
    return [
        {
            "name": info.name,
            "kind": info.kind,
            "licence": info.licence,
            "version": info.version or "",
            "state": "ready" if info.available else f"{info.reason}; {info.install}",
        }
        for info in known_backends()
    ]


def schemes() -> list[dict[str, str]]:
    """One row a scheme: what it minimises, from its recipe's docstring, and its gains with their defaults."""
    rows = []
    for name in recipes.names():
        recipe = recipes.recipe(name)
        gains = [_gain(gain) for gain in signature(recipe).parameters.values()]
        rows.append(
            {"name": name, "what": (getdoc(recipe) or "").partition("\n")[0], "gains": ", ".join(gains)}
        )
    return rows


def _gain(gain: Parameter) -> str:
    """A parameter of a recipe with its default; its name alone when it has none."""
    if gain.default is None:
        return gain.name
    default = f"{gain.default:g}" if isinstance(gain.default, float) else gain.default
    return f"{gain.name} = {default}"


def keys() -> list[dict[str, str]]:
    """One row a key of a scenario: dotted path, default, unit, meaning."""
    return [
        {
            "key": path,
            "default": "needed" if key.default is REQUIRED else _default(key.default),
            "unit": key.says.unit,
            "meaning": key.says.about,
        }
        for path, key in every_key(keys_of(Scenario))
    ]


def _default(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, dict) and set(value) == {"name"}:
        return str(value["name"])
    return str(plain(value))
