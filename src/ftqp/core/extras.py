"""How to install what is optional: from the place that ftqp itself came from, as no index has it."""

from pathlib import Path

NAME = "ftqp"


def remedy_for_extra(extra: str) -> str:
    """The command that installs an extra of this ftqp, for example ``pip install -e "/home/me/ftqp[viz]"``.

    It names the checkout that this module belongs to, else what pip installed ftqp from; where neither is
    known any more it says to go to a clone.

    Args:
        extra: Its name in ``pyproject.toml``.
    """
    checkout = Path(__file__).parents[3]
    if (checkout / "pyproject.toml").is_file() and (checkout / "src" / NAME / "core").is_dir():
        return f'pip install -e "{checkout}[{extra}]"'
    return _from_origin(extra) or f'pip install ".[{extra}]" in a clone of its repository'


def _from_origin(extra: str) -> str | None:
    """The command by what pip noted when it installed ftqp (PEP 610); None where that is gone."""
    import json
    from importlib.metadata import PackageNotFoundError, distribution
    from urllib.parse import urlsplit
    from urllib.request import url2pathname

    try:
        origin = json.loads(distribution(NAME).read_text("direct_url.json") or "{}")
        url = str(origin["url"])
        version_control = origin.get("vcs_info", {}).get("vcs")
    except (PackageNotFoundError, OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
    if url.startswith("file:"):
        place = Path(url2pathname(urlsplit(url).path))
        if not place.exists():
            return None
        if place.is_dir():
            return f'pip install "{place}[{extra}]"'
    return f'pip install "{NAME}[{extra}] @ {f"{version_control}+" if version_control else ""}{url}"'
