"""A replayed QP for a person: what was solved, what holds the answer, who sees it otherwise."""

from collections.abc import Mapping, Sequence
from typing import Any

from ftqp.app.output.console import Shown, Table
from ftqp.app.output.words import fault_sentence
from ftqp.kernel.layout.rows import TORQUE
from ftqp.qp.adapters.registry import PREFIX

MOST_TICKS = 12
"""Ranges of ticks that are listed one by one."""


def overview(facts: Mapping[str, Any]) -> Shown:
    """What a recording holds."""
    first, last = facts["ticks"]
    claims = ", ".join(f"{count} {word}" for word, count in facts["claims"].items())
    lines = [
        f"{facts['file']}: {_run(facts['metadata'])}",
        *_faults(facts["metadata"], float("inf")),
        f"  {facts['qps']} QPs of {len(facts['variables'])} variables and {len(facts['rows'])} rows, "
        f"ticks {first} to {last}, {facts['time'][0]:g} s to {facts['time'][1]:g} s",
        f"  the solver's claims: {claims}",
    ]
    if facts["ticks_not_solved"]:
        lines.append(f"  not solved at ticks {_ranges(facts['ticks_not_solved'])}")
    tick = (facts["ticks_not_solved"] or [last])[0]
    return [*lines, f"  look at one: ftqp replay {facts['file']} --tick {tick}"]


def replay(facts: Mapping[str, Any]) -> Shown:
    """One QP of it, solved again."""
    about, answer, recorded, size = (facts[key] for key in ("metadata", "solution", "recorded", "size"))
    lines = [
        f"tick {facts['tick']} at {facts['time']:g} s of {_run(about)}",
        *_faults(about, facts["time"]),
        f"  {size['variables']} variables, {size['equality_rows']} task rows, "
        f"{size['two_sided_rows']} two-sided rows",
        f"  in the run: {recorded['backend'] or 'the solver'} claimed {recorded['claim']}, "
        f"iterations {recorded['iterations']}, {recorded['start']} start",
        "",
        f"{answer['backend']}: {answer['sentence']}",
        f"  it claims {answer['claim'] or 'nothing, it was not asked'}, iterations {answer['iterations']}, "
        "cold start",
    ]
    if answer["residuals"] is not None:
        shown = ", ".join(f"{name} {_number(value, 2)}" for name, value in answer["residuals"].items())
        lines += [f"  residuals: {shown}", f"  objective: {answer['objective']:.9g}"]
    held = _answer(facts) if answer["variables"] else []
    if answer["certificate"] is not None:
        lines.append(f"  {answer['certificate']['sentence']}")
    return [*lines, *held, *_backends(facts)]


def _answer(facts: Mapping[str, Any]) -> Shown:
    """The three tables of an answer, and in a sentence what holds it."""
    answer = facts["solution"]
    columns = ("", "lower", "value", "upper", "unit", "at", "multiplier")
    flush = ("lower", "value", "upper", "multiplier")
    variables = Table("Variables", columns, [_bounded(row) for row in answer["variables"]], flush)
    shown: list[str | Table] = ["", _holding(answer), variables]
    if answer["torques"]:
        named = all(row["name"].startswith(TORQUE.prefix) for row in answer["torques"])
        prefix = TORQUE.prefix if named else ""
        rows = [_bounded(row | {"name": row["name"].removeprefix(prefix)}) for row in answer["torques"]]
        shown.append(Table("Torques" if named else "Two-sided rows", columns, rows, flush))
    if answer["task"]:
        asked = [
            (
                row["name"],
                _number(row["asked"]),
                _number(row["done"]),
                _number(row["lost"], 2),
                row["unit"],
                _number(row["multiplier"], 3),
            )
            for row in answer["task"]
        ]
        headings = ("", "asked", "done", "done - asked", "unit", "multiplier")
        shown.append(Table("Task rows", headings, asked, ("asked", "done", "done - asked", "multiplier")))
        if facts["metadata"].get("task_mode") == "lexicographic":
            shown.append("Mode lexicographic: a row asks for what its first stage has found to be possible.")
    return shown


def _bounded(row: Mapping[str, Any]) -> tuple[str, ...]:
    ends = (row["lower"], row["value"], row["upper"])
    side = row["active"] or ""
    multiplier = _number(row["multiplier"], 3) if row["multiplier"] else "0"
    return (row["name"], *(_number(end) for end in ends), row["unit"], side, multiplier)


def _holding(answer: Mapping[str, Any]) -> str:
    """Which bounds hold the answer, in one sentence."""
    groups = {
        "fixed": [row["name"] for row in answer["variables"] if row["active"] == "fixed"],
        "at a bound": [_at(row) for row in answer["variables"] if row["active"] in ("lower", "upper")],
        "at a limit": [_at(row) for row in answer["torques"] if row["active"]],
    }
    shown = [f"{what}: {', '.join(names)}" for what, names in groups.items() if names]
    text = "; ".join(shown) if shown else "no bound is active"
    return text[0].upper() + text[1:]


def _at(row: Mapping[str, Any]) -> str:
    return f"{row['name']} ({row['active']})"


def _backends(facts: Mapping[str, Any]) -> Shown:
    rows = []
    for row in facts["backends"]:
        # an adapter does not hear how many iterations its solver took
        count = "-" if row["backend"].startswith(PREFIX) or row["iterations"] is None else row["iterations"]
        numbers = (str(count), _number(row["difference"], 2), _number(row["residual"], 2))
        rows.append((row["backend"], row["claim"] or "-", *numbers, row["verdict"]))
    columns = ("backend", "claim", "iterations", "|x - x_ref|", "residual", "verdict")
    shown: list[str | Table] = [Table("Backends", columns, rows, columns[2:5])]
    if facts["reference"] is not None:
        shown.append(f"x_ref: {facts['reference']}")
        shown.append("|x - x_ref|: largest entry, slacks left out; residual: the largest of the four")
    asked = [row for row in facts["backends"] if row["status"] is not None]
    wrong, silent = facts["disagree"], facts["gave_up"]
    if len(asked) < 2:
        return [*shown, "no other backend was asked"]
    ending = f"{len(asked) - len(wrong) - len(silent)} of {len(asked)} agree"
    ending += f"; disagree: {', '.join(wrong)}" if wrong else "; nobody disagrees"
    return [*shown, ending + (f"; gave up: {', '.join(silent)}" if silent else "")]


def _run(about: Mapping[str, Any]) -> str:
    """The run in a line, as far as the recording says."""
    forms = {"robot": "{}", "scheme": "scheme {}", "level": "{} level", "task_mode": "mode {}"}
    words = [form.format(about[key]) for key, form in forms.items() if key in about]
    name = about.get("scenario", "an unnamed run")
    return f"{name}: {', '.join(words)}" if words else name


def _faults(about: Mapping[str, Any], time: float) -> list[str]:
    """The faults that have happened by ``time``."""
    return [f"  {fault_sentence(fault)}" for fault in about.get("faults", ()) if fault["at"] <= time + 1e-9]


def _ranges(ticks: Sequence[int]) -> str:
    """Ticks as ranges: ``3 to 7, 12``."""
    ranges: list[tuple[int, int]] = []
    for tick in ticks:
        if ranges and tick == ranges[-1][1] + 1:
            ranges[-1] = (ranges[-1][0], tick)
        else:
            ranges.append((tick, tick))
    words = [str(a) if a == b else f"{a} to {b}" for a, b in ranges[:MOST_TICKS]]
    return ", ".join(words) + (f" and {len(ranges) - MOST_TICKS} more ranges" if ranges[MOST_TICKS:] else "")


def _number(value: float | None, digits: int = 5) -> str:
    if value is None:
        return "-"
    return f"{value:.{digits}g}"
