"""What ``ftqp campaign`` does: all episodes of a campaign, or one alone; and what a report says of it."""

import json
from pathlib import Path
from typing import Any, Final

from ftqp import __version__
from ftqp.app.campaign.beside_rival import WHO
from ftqp.app.campaign.campaign_summary import fallback_share, share_interval, summary
from ftqp.app.campaign.episode_study import COLUMNS, KIND, Campaign, EpisodeWork, quietly
from ftqp.app.output.console import ExitCode, Shown, Table, answer, json_text, page_parts
from ftqp.app.run import runs
from ftqp.app.run.runs import CAMPAIGN, SUMMARY, summary_with, write
from ftqp.app.study.results_file import ResultsFile
from ftqp.app.study.runner import refuse_wrong_workers, run_study, study_folder, told_how_to_go_on
from ftqp.checker.checked_run import LAWS
from ftqp.core.errors import reading
from ftqp.sim.log.log_file import load_log
from ftqp.viz.pages.page import heading

NEEDED: Final = ("campaign", "episodes", "sound", "broken", "raised", "refused", "laws", "by_key", "crashed")
"""What the summary of a campaign has at least."""
ALONE: Final = "the same command with --replay {}, and with no --out or another one"
"""Runs an episode alone; a run's folder is a new one."""


def read_campaign(folder: Path) -> dict[str, Any] | None:
    """The facts of a campaign; None where a folder holds none."""
    return summary_with(folder, NEEDED)


def campaign_summary(facts: dict[str, Any]) -> list[str | Table]:
    """How often any law was broken, what came after failures, and what detectors did."""
    if beside := facts.get("beside"):
        return [*_sentences(facts), *_beside(beside)]
    return [
        *_sentences(facts),
        _laws(facts),
        *_after_failures(facts.get("after_failures")),
        *_detection(facts.get("detection")),
    ]


def campaign_parts(label: str, facts: dict[str, Any], folder: Path) -> list[str]:
    """The section of a report: what the command has said, and value by value."""
    with reading(folder / SUMMARY, "as `ftqp campaign` writes it", "make it anew by the same command"):
        shown = page_parts(_shown(facts, whole=True))
    return [heading(f"{label}: how often was any law broken?"), *shown]


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
            f"With 0 of {run} broken, the share of all such episodes that break a law is below "
            f"{_percent(facts['bound'])} at 95 %."
            if not bad
            else f"The share of all such episodes that break a law is {_percent(low)} to {_percent(high)} "
            "at 95 % (Clopper and Pearson)."
        )
    return lines


def _percent(share: float) -> str:
    return f"{float(f'{100.0 * share:.2g}'):g} %"  # 100, not 1e+02


def _laws(facts: dict[str, Any]) -> Table:
    run = facts["sound"] + facts["broken"]
    rows = []
    for law, count in facts["laws"].items():
        low, high = share_interval(count, run) or (0.0, 1.0)
        words = LAWS[law][1] if law in LAWS else ""
        rows.append((law, words, str(count), _percent(low), _percent(high)))
    heads = ("law", "broken where", "episodes", "at least", "at most (95 %)")
    return Table(f"Laws, of {run} episodes that were run", heads, rows, heads[2:])


def _beside(rows: list[dict[str, Any]]) -> list[str | Table]:
    """The tables of what ftqp and damped least squares made of the same episodes."""
    words = (
        "Each cell of two is of ftqp / damped least squares. Finished: the end effector ends within 10 mm "
        "and 0.1 rad of its target, no stop is latched, and no joint that obeys was faster than 1.02 times "
        "its limit or more than 0.02 rad out of its range. A leap: after a hold a joint is faster than 1.1 "
        "times the larger of its limit and its speed before. Accused: a healthy joint is believed to have "
        "failed, or its brake is asked for. Stops are of arms without a failure. Locks count if the joint "
        "would have gone 20 mrad within 2 s."
    )
    heads = (
        "", "episodes", "finished", "limits broken", "leaps", "accused", "of healthy arms", "stopped",
        "locks", "found", "after [s]", "error at the end [mm]", "fastest",
    )  # fmt: skip
    tables: list[str | Table] = [words]
    for group in dict.fromkeys(row["group"] for row in rows):
        lines = [_line_beside(row) for row in rows if row["group"] == group]
        title = f"By {group}" if group else "All"
        tables.append(Table(title, (group, *heads[1:]), lines, heads[1:]))
    return tables


def _line_beside(row: dict[str, Any]) -> tuple[str, ...]:
    """A line of such a table."""

    def cell(name: str, form: str = "{:g}", scale: float = 1.0) -> str:
        values = [row[who][name] for who in WHO]
        return " / ".join("-" if value is None else form.format(scale * value) for value in values)

    ftqp = row["ftqp"]  # the rival names nobody and stops nobody
    late = "-" if ftqp["after"] is None else f"{ftqp['after']:.2f}"
    return (
        row["name"], f"{row['episodes']}", cell("finished"), cell("broken"), cell("leapt"),
        f"{ftqp['accused']}", f"{row['healthy']}", f"{ftqp['stopped']}", f"{ftqp['locks']}",
        f"{ftqp['found']}", late, cell("off", "{:.1f}", 1e3),
        cell("fast", "{:.2f}"),
    )  # fmt: skip


def _after_failures(found: dict[str, Any] | None) -> list[str | Table]:
    """The table of failures whose rest is feasible, and how many were finished."""
    if not found:
        return []
    rows = []
    for name, one in [("all", found["all"]), *found["by"].items(), ("no motion found", found["unproven"])]:
        low, high = one["interval"] or (0.0, 1.0)
        rows.append((name, str(one["failures"]), str(one["finished"]), _percent(low), _percent(high)))
    words = (
        "After a failure that was reported, a search of the checker's own asks whether the remaining joints "
        "can do the rest of the task. Of those that can, these were finished, the end effector within its "
        f"tolerance at the end; {found['stopped']} of the rest were stopped and said so. The last line has "
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


def run_episodes(
    made: Campaign,
    out: Path | None,
    *,
    jobs: int | None,
    dask: str | None,
    table: bool,
    as_json: bool,
) -> ExitCode:
    """Run all episodes that are not yet in the folder, and sum all of them up."""
    refuse_wrong_workers(jobs, dask)
    folder = study_folder(out, made.name)
    about = {"study": made.whole_text, "ftqp": __version__, "name": made.name}
    count = made.tables.campaign.episodes
    with (
        told_how_to_go_on(folder),
        ResultsFile(folder, kind=KIND, key=made.key, columns=COLUMNS, about=about) as results,
    ):
        write(folder / CAMPAIGN, made.text)
        work = EpisodeWork(campaign=made)
        outcome = run_study(work, count, results, what=made.name, jobs=jobs, dask=dask)
        names = ("episode", *COLUMNS)
        rows = [dict(zip(names, row, strict=True)) for row in results.table() if row[0] < count]
    facts = summary(made.name, rows) | {
        "computed_now": outcome.computed,
        "crashed": {str(item): reason for item, reason in outcome.crashed.items()},
        "seconds": outcome.seconds,
        "folder": str(folder),
    }
    write(folder / SUMMARY, json_text(facts))
    answer(facts, as_json, _shown(facts, whole=table))
    compared = made.tables.campaign.judged == "beside a rival"  # figures of two, and no law of one
    good = not outcome.crashed and not facts["raised"] and (compared or not facts["broken"])
    return ExitCode.DONE if good else ExitCode.STOPPED


def replay_episode(made: Campaign, number: int, out: Path | None, *, as_json: bool) -> ExitCode:
    """Run one episode with its log and figures, and judge it again."""
    setup, (_, drawn) = made.setup(number), made.drawn(number)
    folder = runs.free_folder(out, setup.name)
    result = runs.run(setup, folder)
    with quietly():  # the same was said of the run
        again = made.setup(number)
    work, beside = EpisodeWork(campaign=made), None
    if made.tables.campaign.judged == "beside a rival":
        row = work.row_of(number, made.drawn(number)[0])
        beside, broken = json.loads(row["beside"] or "null"), (row["sentences"] or "").splitlines()
    else:
        broken = [str(breach) for breach in work.verdict(again, load_log(folder)).breaches]
    facts: dict[str, Any] = {
        "campaign": made.name,
        "episode": number,
        "drawn": drawn,
        "broken": broken,
        "beside": beside,
        "folder": str(folder),
        "summary": result.summary,
    }
    said = [f"episode {number}: {json.dumps(drawn, default=str)}"]
    said += [f"  {sentence}" for sentence in broken or ["every law holds"]]
    said += [f"  {who}: {json.dumps(beside[who])}" for who in WHO if beside]
    said.append(f"files: {folder}; look at it: ftqp view {folder}")
    answer(facts, as_json, said)
    return ExitCode.STOPPED if broken else ExitCode.DONE


def _shown(facts: dict[str, Any], *, whole: bool) -> Shown:
    """The summary for a person."""
    shown = campaign_summary(facts)
    if facts["refused"]:
        first = facts["refusals"][0]
        reason = ((first["sentences"] or "").splitlines() or ["no reason was kept"])[-1].removeprefix("  - ")
        shown.append(
            f"{facts['refused']} were not run, as what was drawn is no scenario; episode {first['episode']}: "
            f"{reason}"
        )
    shown += [
        f"  episode {item} was given up: {reason} each time; alone: {ALONE.format(item)}"
        for item, reason in facts["crashed"].items()
    ]
    shown += [f"  episode {one['episode']}: {one['sentences'].splitlines()[0]}" for one in facts["examples"]]
    if facts["examples"]:
        shown.append(f"  one of them alone, with its log: {ALONE.format('N')}")
    shown += by_key(facts) if whole else []
    return [*shown, f"{facts['seconds']:.1f} s of work; files: {facts['folder']}"]
