"""Files that come with another package: ``wheel:NAME/path`` stands for one of the installed package NAME."""

from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any, Final

from ftqp.core.errors import ScenarioError

PREFIX: Final = "wheel:"


def located(value: Any) -> Any:
    """The value, whatever it holds, with the paths of such files."""
    if isinstance(value, Mapping):
        return {key: located(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [located(inner) for inner in value]
    if not isinstance(value, str) or not value.startswith(PREFIX):
        return value
    name, _, path = value.removeprefix(PREFIX).partition("/")
    try:
        file = Path(str(distribution(name).locate_file(path)))
    except PackageNotFoundError as error:
        raise FileNotFoundError(f"package {name} is not installed") from error
    if not file.is_file():
        raise FileNotFoundError(f"package {name} has no file {path}")
    return str(file.resolve())


def with_files(bundles: Mapping[str, Any], origin: str) -> tuple[dict[str, Any], list[str]]:
    """The bundles whose files there are, and a sentence for those of each group that are left out."""
    kept: dict[str, Any] = {}
    shown = []
    for group, choices in bundles.items():
        absent: dict[str, list[str]] = {}
        kept[group] = {}
        for name, one in choices.items():
            try:
                kept[group][name] = located(one)
            except FileNotFoundError as error:
                absent.setdefault(str(error), []).append(name)
        shown += [
            f"{group} {', '.join(names)} of {origin} left out, as {why}" for why, names in absent.items()
        ]
        if not kept[group]:
            why = "; ".join(absent) or "there is none"
            raise ScenarioError(f"{origin} has errors:", [f"bundles.{group} has nothing left to draw: {why}"])
    return kept, shown
