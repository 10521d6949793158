"""``ftqp campaign``: many episodes drawn from one scenario, resumable, each judged from outside."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from ftqp.app.commands.options import Dask, Jobs, Json, Out, Overrides
from ftqp.app.output.console import ExitCode, json_text, tell, tell_json, tell_table
from ftqp.core.errors import InputError

STUDY, SUMMARY = "campaign.toml", "summary.json"
MOST_VALUES = 12
"""A key with more values than this is not told value by value."""
CONFIDENCE = 0.95
SHOWN = 10
"""Episodes that are named one by one."""


def campaign(
    study: Annotated[
        str, typer.Argument(metavar="STUDY", help="A campaign file, or the name of a bundled one: safety.")
    ],
    overrides: Overrides = None,
    out: Out = None,
    jobs: Jobs = None,
    dask: Dask = None,
    table: Annotated[
        bool, typer.Option("--table", help="Print how often each law was broken, value by value.")
    ] = False,
    replay: Annotated[
        int | None,
        typer.Option(metavar="N", help="Run this episode alone, with log and figures, and judge it."),
    ] = None,
    as_json: Json = False,
) -> ExitCode:
    """Run a campaign of random episodes, or go on with it; every one is judged from outside."""
    from ftqp.app.campaign.episode_study import load_campaign

    made = load_campaign(study, overrides or ())
    if replay is not None:
        return _replay(made, replay, out, as_json=as_json)
    from ftqp import __version__
    from ftqp.app.campaign.episode_study import COLUMNS, KIND, EpisodeWork
    from ftqp.app.run.runs import free_folder, write
    from ftqp.app.study.driving import cluster_at, drive
    from ftqp.app.study.results_file import FILE_NAME, ResultsFile

    cluster = cluster_at(jobs, dask)
    folder = out if out is not None and (out / FILE_NAME).is_file() else free_folder(out, made.name)
    about = {"study": made.text, "ftqp": __version__}
    count = made.tables.campaign.episodes
    with ResultsFile(folder, kind=KIND, key=made.key, columns=COLUMNS, about=about) as results:
        write(folder / STUDY, made.text)
        driven = drive(EpisodeWork(campaign=made), count, results, what=made.name, jobs=jobs, cluster=cluster)
        names = ("episode", *COLUMNS)
        rows = [dict(zip(names, row, strict=True)) for row in results.table() if row[0] < count]
    facts = summary(made.name, rows) | {
        "computed_now": driven.computed,
        "crashed": {str(item): reason for item, reason in driven.crashed.items()},
        "seconds": driven.seconds,
        "folder": str(folder),
    }
    write(folder / SUMMARY, json_text(facts))
    if as_json:
        tell_json(facts)
    else:
        _tell(facts, whole=table)
    good = not driven.crashed and not facts["broken"] and not facts["raised"]
    return ExitCode.DONE if good else ExitCode.STOPPED


def summary(name: str, rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """What ``summary.json`` says of a campaign's rows.

    ``bound`` is the largest share of broken episodes that is compatible with the rows at 95 %, where none
    was broken: 1 - 0.05^(1/n).

    Args:
        name: Of the campaign.
        rows: By column.
    """
    from ftqp.referee.laws import LAWS

    counts = _counts(rows)
    run = counts["sound"] + counts["broken"]
    clean = not counts["broken"] and not counts["raised"] and run > 0
    bad = [row for row in rows if row["outcome"] in ("broken", "raised")]
    said: dict[str, int] = {}
    for row in rows:
        for status, ticks in json.loads(row["said"] or "{}").items():
            said[status] = said.get(status, 0) + ticks
    return {
        "campaign": name,
        "episodes": len(rows),
        **counts,
        "steps": sum(row["ticks"] or 0 for row in rows),
        "bound": 1.0 - (1.0 - CONFIDENCE) ** (1.0 / run) if clean else None,
        "laws": {law: sum((row[f"law_{law}"] or 0.0) > 0.0 for row in rows) for law in LAWS},
        "said": said,
        "largest_ok_error": max((row["largest_ok_error"] or 0.0 for row in rows), default=0.0),
        "by_key": _by_key(rows),
        "examples": [{key: row[key] for key in ("episode", "outcome", "sentences")} for row in bad[:SHOWN]],
    }


def _counts(rows: Sequence[dict[str, Any]]) -> dict[str, int]:
    """How many episodes there were of each outcome."""
    found = [row["outcome"] for row in rows]
    return {outcome: found.count(outcome) for outcome in ("sound", "broken", "raised", "refused")}


def _by_key(rows: Sequence[dict[str, Any]]) -> dict[str, dict[str, dict[str, int]]]:
    """The same for each value of the keys that were drawn from a few."""
    groups: dict[str, dict[str, list[dict[str, Any]]]] = {}
    for row in rows:
        for key, value in json.loads(row["drawn"]).items():
            words = value if isinstance(value, str) else json.dumps(value)
            groups.setdefault(key, {}).setdefault(words, []).append(row)
    return {
        key: {value: {"episodes": len(some), **_counts(some)} for value, some in sorted(values.items())}
        for key, values in groups.items()
        if len(values) <= MOST_VALUES
    }


def _tell(facts: dict[str, Any], *, whole: bool) -> None:
    """The summary for a person."""
    run = facts["sound"] + facts["broken"]
    tell(
        f"{facts['campaign']}: {facts['episodes']} episodes, {facts['steps']} steps; {facts['sound']} broke "
        f"no law, {facts['broken']} broke one, {facts['raised']} ended in an exception"
    )
    if facts["refused"]:
        tell(
            f"{facts['refused']} were not run: what was drawn is no scenario, for example a path out of reach"
        )
    if facts["bound"] is not None:
        tell(f"with 0 of {run} broken, the true share is below {facts['bound']:.2g} at 95 %")
    for example in facts["examples"]:
        tell(f"  episode {example['episode']}: {example['sentences'].splitlines()[0]}")
    if facts["examples"]:
        tell("  one of them alone, with its log: the same command with --replay N")
    if whole:
        for key, values in facts["by_key"].items():
            heads = ("value", "episodes", "broken", "raised", "refused")
            cells = [(value, *(str(found[head]) for head in heads[1:])) for value, found in values.items()]
            tell_table(key, heads, cells, numbers=heads[1:])
    tell(f"{facts['seconds']:.1f} s of work; files: {facts['folder']}")


def _replay(made: Any, number: int, out: Path | None, *, as_json: bool) -> ExitCode:
    """One episode with its log and figures, judged again."""
    from ftqp.app.campaign.episode_study import EpisodeWork
    from ftqp.app.run import runs
    from ftqp.sim.log.log_file import load_log

    if not 0 <= number < made.tables.campaign.episodes:
        raise InputError(
            f"episode {number} is none of {made.name}, expected 0 to {made.tables.campaign.episodes - 1}"
        )
    setup, (_, drawn) = made.setup(number), made.drawn(number)
    folder = runs.free_folder(out, setup.name)
    result = runs.run(setup, folder)
    seen = EpisodeWork(campaign=made).verdict(made.setup(number), load_log(folder))
    facts = {
        "campaign": made.name,
        "episode": number,
        "drawn": drawn,
        "broken": [str(breach) for breach in seen.breaches],
        "folder": str(folder),
        "summary": result.summary,
    }
    if as_json:
        tell_json(facts)
    else:
        tell(f"episode {number}: {json.dumps(drawn)}")
        for sentence in facts["broken"] or ["every law holds"]:
            tell(f"  {sentence}")
        tell(f"files: {folder}; look at it: ftqp view {folder}")
    return ExitCode.STOPPED if seen.breaches else ExitCode.DONE
