"""The section of a report on what ``ftqp campaign`` found."""

import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any, Final

from ftqp.app.campaign.found_failures import share_interval
from ftqp.app.run.runs import SUMMARY, summary_with
from ftqp.app.study.disk_trouble import reason
from ftqp.app.study.results_file import FILE_NAME, read_only, refuse_other_tables
from ftqp.core.errors import InputError, MissingPackage
from ftqp.referee.laws import LAWS
from ftqp.viz.pages.page import drawing, heading, paragraph, table

NEEDED: Final = ("campaign", "episodes", "sound", "broken", "raised", "refused", "laws", "by_key")
"""What the summary of a campaign has at least."""
LISTED: Final = 200
"""Episodes that are listed at most."""
HISTOGRAM: Final = (
    "How many episodes had which largest distance of the tip from its target while OK was claimed."
)
SHARES: Final = (
    "Of the values that were drawn: which share of the episodes broke a law (dot) and the shares that are "
    "compatible with that at 95 % (bar). Values that broke none are grey."
)


def read_campaign(folder: Path) -> dict[str, Any] | None:
    """The facts of a campaign with its rows; None where a folder holds none.

    Args:
        folder: Made by ``ftqp campaign``.

    Raises:
        InputError: Its summary or its results are not readable.
    """
    facts = summary_with(folder, NEEDED)
    if facts is None:
        return None
    return facts | {"bad": _bad(folder), "errors": _errors(folder)}


def _asked(folder: Path, question: str) -> list[tuple[Any, ...]]:
    """What the results file answers; nothing where there is none."""
    file = folder / FILE_NAME
    if not file.is_file():
        return []
    try:
        with closing(read_only(file)) as connection:
            connection.execute("PRAGMA trusted_schema = OFF")
            refuse_other_tables(connection, file)
            return connection.execute(question).fetchall()
    except (sqlite3.Error, UnicodeDecodeError) as error:
        raise InputError(f"{file} is not readable as results of a campaign: {reason(error):.200}") from error


def _bad(folder: Path) -> list[tuple[Any, ...]]:
    return _asked(
        folder,
        "SELECT item, outcome, sentences FROM results WHERE outcome IN ('broken', 'raised') ORDER BY item "
        f"LIMIT {LISTED + 1}",
    )


def _errors(folder: Path) -> list[float]:
    rows = _asked(
        folder, "SELECT largest_ok_error FROM results WHERE outcome IN ('sound', 'broken') LIMIT 2000000"
    )
    return [float(value) for (value,) in rows if isinstance(value, int | float) and 0.0 <= value < 1e300]


def campaign_parts(label: str, facts: dict[str, Any], folder: Path) -> list[str]:
    """The section.

    Args:
        label: Names the campaign in the report.
        facts: As `read_campaign` gives them.
        folder: Of the campaign.

    Raises:
        InputError: The facts are not as ``ftqp campaign`` writes them.
    """
    try:
        parts = [
            heading(f"{label}: how often was any law broken?"),
            *(paragraph(line) for line in _sentences(facts)),
            _laws(facts),
            *_detection(facts.get("detection")),
            *_pictures(facts),
            *(_by_key(key, values) for key, values in facts["by_key"].items()),
            _listed(facts),
        ]
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError, ZeroDivisionError) as error:
        raise InputError(
            f"{folder / SUMMARY} is not as `ftqp campaign` writes it: a part is missing or of another kind; "
            "make it anew by the same command"
        ) from error
    return [part for part in parts if part]


def _sentences(facts: dict[str, Any]) -> list[str]:
    run, bad = facts["sound"] + facts["broken"], facts["broken"] + facts["raised"]
    lines = [
        f"{facts['campaign']}: {facts['episodes']} random episodes, {facts['steps']} steps, each judged from "
        f"outside by the plant's truth and the arm's model file. {facts['sound']} broke no law, "
        f"{facts['broken']} broke one, {facts['raised']} ended in an exception; {facts['refused']} were not "
        "run, for what was drawn is no scenario."
    ]
    if run + facts["raised"]:
        low, high = share_interval(bad, run + facts["raised"]) or (0.0, 1.0)
        lines.append(
            f"The share of all such episodes that break a law is below {_percent(high)} at 95 %."
            if not bad
            else f"The share of all such episodes that break a law is {_percent(low)} to {_percent(high)} "
            "at 95 % (Clopper and Pearson)."
        )
    return lines


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %"


def _laws(facts: dict[str, Any]) -> str:
    run = facts["sound"] + facts["broken"]
    rows = []
    for law, count in facts["laws"].items():
        low, high = share_interval(count, run) or (0.0, 1.0)
        words = LAWS[law][1] if law in LAWS else ""
        rows.append((law, words, str(count), _percent(low), _percent(high)))
    heads = ("law", "broken where", "episodes", "at least", "at most (95 %)")
    return table(f"Laws, of {run} episodes that were run", heads, rows, numbers=heads[2:])


def _detection(found: dict[str, Any] | None) -> list[str]:
    """The table of what detectors did."""
    if not found:
        return []
    delay = found["delay"] or {}
    rows = [
        ("failures that nobody announced", str(found["unannounced"])),
        ("found by their joint", str(found["found"])),
        ("with the right kind among those named", str(found["right_kind"])),
        ("alarms after a failure that name a joint that works", str(found["wrong_joint"])),
        *((f"delay, {name} [s]", f"{value:.3g}") for name, value in delay.items()),
        ("healthy motion [h]", f"{found['healthy_hours']:.3g}"),
        ("false alarms", str(found["false_alarms"])),
    ]
    most = found["false_alarms_per_hour_at_most"]
    if most is not None:
        rows.append(("false alarms an hour, at most (95 %)", f"{most:.2g}"))
    return [table("What the detectors found", ("what", "value"), rows, numbers=("value",))]


def _pictures(facts: dict[str, Any]) -> list[str]:
    """The histogram and the shares; none where figures cannot be drawn."""
    try:
        from ftqp.viz.figures.campaign_pictures import draw_ok_errors, draw_shares
        from ftqp.viz.report.inline_figures import inline
    except MissingPackage:
        return []
    parts = []
    if facts["errors"]:
        title = f"{facts['campaign']}: claimed and true"
        parts.append(drawing(inline(lambda path: draw_ok_errors(path, facts["errors"], title)), HISTOGRAM))
    shares = {
        key: [
            (value, found["episodes"] - found["refused"], found["broken"] + found["raised"], interval)
            for value, found in values.items()
            if (
                interval := share_interval(
                    found["broken"] + found["raised"], found["episodes"] - found["refused"]
                )
            )
        ]
        for key, values in facts["by_key"].items()
    }
    shares = {key: values for key, values in shares.items() if len(values) > 1}
    if shares and facts["broken"] + facts["raised"]:
        title = f"{facts['campaign']}: which values broke laws"
        parts.append(drawing(inline(lambda path: draw_shares(path, shares, title)), SHARES))
    return parts


def _by_key(key: str, values: dict[str, dict[str, int]]) -> str:
    heads = ("value", "episodes", "broke a law", "exceptions", "not run", "at most (95 %)")
    rows = []
    for value, found in values.items():
        bad, run = found["broken"] + found["raised"], found["episodes"] - found["refused"]
        interval = share_interval(bad, run)
        rows.append(
            (
                f"{value:.80}", str(found["episodes"]), str(found["broken"]), str(found["raised"]),
                str(found["refused"]), "-" if interval is None else _percent(interval[1]),
            )
        )  # fmt: skip
    return table(key, heads, rows, numbers=heads[1:])


def _listed(facts: dict[str, Any]) -> str:
    """The episodes that broke a law, each with the command that runs it alone."""
    bad = facts["bad"]
    if not bad:
        return ""
    rows = [
        (str(item), str(outcome), f"{str(said).splitlines()[0] if said else '':.200}",
         f"ftqp campaign {facts['campaign']} --replay {item}")
        for item, outcome, said in bad[:LISTED]
    ]  # fmt: skip
    more = f", the first {LISTED}" if len(bad) > LISTED else ""
    heads = ("episode", "outcome", "what was broken first", "alone, with log and figures")
    return table(f"Episodes that broke a law{more}", heads, rows, numbers=("episode",))
