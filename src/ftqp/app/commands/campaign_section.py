"""What ``ftqp campaign`` found, in words: for the terminal and for a report."""

from pathlib import Path
from typing import Any, Final

from ftqp.app.campaign.campaign_summary import fallback_share, share_interval
from ftqp.app.output.console import Table, page_parts
from ftqp.app.run.runs import SUMMARY
from ftqp.checker.checked_run import LAWS
from ftqp.core.errors import InputError, MissingPackage, printable
from ftqp.viz.pages.page import drawing, heading

LISTED: Final = 200
"""Episodes that are listed at most."""
HISTOGRAM: Final = (
    "How many episodes had which largest distance of the tip from its target while OK was claimed."
)
SHARES: Final = (
    "Of the values that were drawn: which share of the episodes broke a law (dot) and the shares that are "
    "compatible with that at 95 % (bar). Values that broke none are grey."
)


def campaign_told(facts: dict[str, Any]) -> list[str | Table]:
    """How often any law was broken, what came after failures, and what detectors did."""
    return [
        *_sentences(facts),
        _laws(facts),
        *_after_failures(facts.get("after_failures")),
        *_detection(facts.get("detection")),
    ]


def campaign_parts(label: str, facts: dict[str, Any], folder: Path) -> list[str]:
    """The section."""
    try:
        return [
            heading(f"{label}: how often was any law broken?"),
            *page_parts(campaign_told(facts)),
            *_pictures(facts),
            *page_parts([*by_key(facts), *_listed(facts)]),
        ]
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError, ZeroDivisionError) as error:
        raise InputError(
            f"{folder / SUMMARY} is not as `ftqp campaign` writes it: a part is missing or of another kind; "
            "make it anew by the same command"
        ) from error


def _sentences(facts: dict[str, Any]) -> list[str]:
    run, bad = facts["sound"] + facts["broken"], facts["broken"] + facts["raised"]
    lines = [
        f"{facts['campaign']}: {facts['episodes']} random episodes, {facts['steps']} steps, each judged from "
        f"outside by the plant's truth and the arm's model file. {facts['sound']} broke no law, "
        f"{facts['broken']} broke one, {facts['raised']} ended in an exception; {facts['refused']} were not "
        "run, for what was drawn is no scenario."
    ]
    if facts["given_up"]:
        lines.append(
            f"{facts['given_up']} more were given up, as the process that ran them died each time; they are "
            "listed below, and tried again when the campaign goes on."
        )
    if facts["missing"]:
        lines.append(
            f"The campaign is not finished: {facts['missing']} more episodes were asked for and have no "
            "result yet; the command that began it goes on with them."
        )
    if run + facts["raised"]:
        low, high = share_interval(bad, run + facts["raised"]) or (0.0, 1.0)
        lines.append(
            f"With 0 of {run} broken, the share of all such episodes that break a law is below "
            f"{_percent(facts['bound'])} at 95 %."
            if not bad
            else f"The share of all such episodes that break a law is {_percent(low)} to {_percent(high)} "
            "at 95 % (Clopper and Pearson)."
        )
    return lines


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %"


def _laws(facts: dict[str, Any]) -> Table:
    run = facts["sound"] + facts["broken"]
    rows = []
    for law, count in facts["laws"].items():
        low, high = share_interval(count, run) or (0.0, 1.0)
        words = LAWS[law][1] if law in LAWS else ""
        rows.append((law, words, str(count), _percent(low), _percent(high)))
    heads = ("law", "broken where", "episodes", "at least", "at most (95 %)")
    return Table(f"Laws, of {run} episodes that were run", heads, rows, heads[2:])


def _after_failures(found: dict[str, Any] | None) -> list[str | Table]:
    """The table of failures whose rest is feasible, and how many were finished."""
    if not found:
        return []
    rows = []
    for name, one in [("all", found["all"]), *found["by"].items(), ("no motion found", found["unproven"])]:
        low, high = one["interval"] or (0.0, 1.0)
        rows.append((name, str(one["failures"]), str(one["finished"]), _percent(low), _percent(high)))
    words = (
        "After a failure that the planner was told of, a search of the checker's own asks whether the joints "
        "left can do the rest of the task. Of those that can, these were finished, the tip within its "
        f"tolerance at the end; {found['stopped']} of the others were stopped and said so. The last line has "
        "those for which the search found no motion, which proves nothing."
    )
    heads = ("failures", "feasible", "finished", "share, at least", "at most (95 %)")
    return [words, Table("Finished after a failure", heads, rows, heads[1:])]


def _detection(found: dict[str, Any] | None) -> list[Table]:
    """The table of what detectors did."""
    if not found:
        return []
    delay = found["delay"] or {}
    rows = [
        ("failures that nobody announced", str(found["unannounced"])),
        ("of those, failures that made a difference", str(found["showed"])),
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
    return [Table("What the detectors found", ("what", "value"), rows, ("value",))]


def _pictures(facts: dict[str, Any]) -> list[str]:
    """The histogram and the shares; none where figures cannot be drawn."""
    try:
        from ftqp.viz.figures.campaign_pictures import draw_ok_errors, draw_shares
        from ftqp.viz.report.run_report import inline
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


def by_key(facts: dict[str, Any]) -> list[Table]:
    """The same for each value of each key that was drawn."""
    heads = ("value", "episodes", "broke a law", "exceptions", "not run", "at most (95 %)", "FALLBACK ticks")
    tables = []
    for key, values in facts["by_key"].items():
        rows = []
        for value, found in values.items():
            bad, run = found["broken"] + found["raised"], found["episodes"] - found["refused"]
            interval = share_interval(bad, run)
            rows.append(
                (
                    f"{value:.80}", str(found["episodes"]), str(found["broken"]), str(found["raised"]),
                    str(found["refused"]), "-" if interval is None else _percent(interval[1]),
                    fallback_share(found),
                )
            )  # fmt: skip
        tables.append(Table(key, heads, rows, heads[1:]))
    return tables


def _listed(facts: dict[str, Any]) -> list[Table]:
    """The episodes that went wrong, each with the command that runs it alone."""
    bad = facts["listed"]
    if not bad:
        return []
    rows = [
        (str(item), outcome, f"{said.splitlines()[0] if said else '':.200}",
         printable(f"{facts['command']} --replay {item}"))
        for item, outcome, said in bad[:LISTED]
    ]  # fmt: skip
    title = "Episodes that broke a law" + (" or were given up" if facts["given_up"] else "")
    more = f", the first {LISTED}" if len(bad) > LISTED else ""
    heads = ("episode", "outcome", "what was broken first", "alone, with log and figures")
    return [Table(f"{title}{more}", heads, rows, ("episode",))]
