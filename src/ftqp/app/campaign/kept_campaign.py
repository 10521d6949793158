"""What a campaign's folder holds, finished or not: facts from its rows, whatever its summary says."""

import shlex
import sqlite3
import tomllib
from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Final

from ftqp.app.campaign.campaign_summary import Row, summary
from ftqp.app.campaign.episode_study import COLUMNS, KIND
from ftqp.app.run.runs import summary_with
from ftqp.app.study.results_file import FILE_NAME, facts_of, read_only
from ftqp.core.errors import printable, reading

STUDY: Final = "campaign.toml"
"""The campaign as it was asked for last, every default filled in."""
NEEDED: Final = ("campaign", "episodes", "sound", "broken", "raised", "refused", "laws", "by_key")
"""What the summary of a campaign has at least."""
GIVEN_UP: Final = "given up"
"""What is said in place of an outcome where the worker died each time."""

Listed = tuple[int, str, str]
"""An episode that is named: its number, its outcome, and what went wrong."""


def command_of(study: str, overrides: Sequence[str]) -> str:
    """The command that runs a campaign, to which ``--replay N`` can be added."""
    named = f"./{study}" if study.startswith("-") else study
    return shlex.join(["ftqp", "campaign", named, *(word for one in overrides for word in ("--set", one))])


def kept_campaign(folder: Path) -> dict[str, Any] | None:
    """The facts of a campaign, as its summary has them, and more; None where a folder holds none.

    ``listed`` are the episodes that went wrong, ``errors`` the largest distances from the target while OK was
    claimed, ``given_up`` says at how many the worker died, ``missing`` how many more were asked for and have
    no result, and ``command`` runs the campaign. Without its rows there is what the summary says.
    """
    file = folder / FILE_NAME
    if not file.is_file():
        facts = summary_with(folder, NEEDED)
        return None if facts is None else {"listed": [], "errors": [], "given_up": 0, "missing": 0} | facts
    with (
        reading(file, "as `ftqp campaign` writes it", "make it anew in another folder"),
        closing(read_only(file)) as connection,
    ):
        about = facts_of(connection, file)
        if about.get("kind") != KIND:
            return None
        crashed = connection.execute("SELECT item, reason FROM crashed ORDER BY item").fetchall()
        listed = [(int(item), GIVEN_UP, str(reason)) for item, reason in crashed]
        return _facts(folder, about, _rows(connection), listed)


def _rows(connection: sqlite3.Connection) -> list[Row]:
    """All rows by column; None where an older file does not have one."""
    asked = connection.execute("SELECT * FROM results ORDER BY item")
    names = ["episode" if name == "item" else name for name, *_ in asked.description]
    none = dict.fromkeys(COLUMNS)
    return [none | dict(zip(names, row, strict=True)) for row in asked]


def _facts(
    folder: Path, about: Mapping[str, Any], rows: Sequence[Row], crashed: Sequence[Listed]
) -> dict[str, Any]:
    name = printable(str(about.get("name") or folder.resolve().name), keep="")
    wanted = _wanted(folder, str(about.get("study", "")))
    known = {row["episode"] for row in rows} | {item for item, *_ in crashed}
    bad = [
        (row["episode"], str(row["outcome"]), str(row["sentences"] or ""))
        for row in rows
        if row["outcome"] in ("broken", "raised")
    ]
    errors = [row["largest_ok_error"] for row in rows if row["outcome"] in ("sound", "broken")]
    return summary(name, rows) | {
        "listed": sorted([*bad, *crashed]),
        "errors": [float(x) for x in errors if isinstance(x, int | float) and 0.0 <= x < 1e300],
        "given_up": len(crashed),
        "missing": max(0, wanted - sum(item < wanted for item in known)),
        "command": str(about.get("command") or command_of(str(folder / STUDY), ())),
    }


def _wanted(folder: Path, text: str) -> int:
    """How many episodes were asked for last; 0 where nothing says it."""
    file = folder / STUDY
    try:
        if file.is_file():
            text = file.read_text(encoding="utf-8")
        return int(tomllib.loads(text)["campaign"]["episodes"])
    except (OSError, ValueError, KeyError, TypeError):
        return 0
