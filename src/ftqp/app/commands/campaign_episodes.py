"""What ``ftqp campaign`` does: all episodes of a campaign, or one alone."""

import json
from pathlib import Path
from typing import Any, Final

from ftqp import __version__
from ftqp.app.campaign.campaign_summary import summary
from ftqp.app.campaign.episode_study import COLUMNS, KIND, Campaign, EpisodeWork, quietly
from ftqp.app.campaign.kept_campaign import STUDY
from ftqp.app.commands.campaign_section import by_key, campaign_told
from ftqp.app.output.console import ExitCode, Told, answer, json_text
from ftqp.app.run import runs
from ftqp.app.run.runs import SUMMARY, write
from ftqp.app.study.results_file import ResultsFile
from ftqp.app.study.runner import refuse_wrong_workers, run_study, study_folder, told_how_to_go_on
from ftqp.sim.log.log_file import load_log

ALONE: Final = "the same command with --replay {}, and with no --out or another one"
"""Runs an episode alone; a run's folder is a new one."""


def run_episodes(
    made: Campaign,
    command: str,
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
    about = {"study": made.whole_text, "ftqp": __version__, "name": made.name, "command": command}
    count = made.tables.campaign.episodes
    with (
        told_how_to_go_on(folder),
        ResultsFile(folder, kind=KIND, key=made.key, columns=COLUMNS, about=about) as results,
    ):
        write(folder / STUDY, made.text)
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
    answer(facts, as_json, _told(facts, whole=table))
    good = not outcome.crashed and not facts["broken"] and not facts["raised"]
    return ExitCode.DONE if good else ExitCode.STOPPED


def replay_episode(made: Campaign, number: int, out: Path | None, *, as_json: bool) -> ExitCode:
    """Run one episode with its log and figures, and judge it again."""
    setup, (_, drawn) = made.setup(number), made.drawn(number)
    folder = runs.free_folder(out, setup.name)
    result = runs.run(setup, folder)
    with quietly():  # the same was said of the run
        again = made.setup(number)
    seen = EpisodeWork(campaign=made).verdict(again, load_log(folder))
    facts: dict[str, Any] = {
        "campaign": made.name,
        "episode": number,
        "drawn": drawn,
        "broken": [str(breach) for breach in seen.breaches],
        "folder": str(folder),
        "summary": result.summary,
    }
    said = [f"episode {number}: {json.dumps(drawn, default=str)}"]
    said += [f"  {sentence}" for sentence in facts["broken"] or ["every law holds"]]
    said.append(f"files: {folder}; look at it: ftqp view {folder}")
    answer(facts, as_json, said)
    return ExitCode.STOPPED if seen.breaches else ExitCode.DONE


def _told(facts: dict[str, Any], *, whole: bool) -> Told:
    """The summary for a person."""
    told = campaign_told(facts | {"given_up": len(facts["crashed"]), "missing": 0})
    if facts["refused"]:
        first = facts["refusals"][0]
        reason = ((first["sentences"] or "").splitlines() or ["no reason was kept"])[-1].removeprefix("  - ")
        told.append(
            f"{facts['refused']} were not run, as what was drawn is no scenario; episode {first['episode']}: "
            f"{reason}"
        )
    told += [
        f"  episode {item} was given up: {reason} each time; alone: {ALONE.format(item)}"
        for item, reason in facts["crashed"].items()
    ]
    told += [f"  episode {one['episode']}: {one['sentences'].splitlines()[0]}" for one in facts["examples"]]
    if facts["examples"]:
        told.append(f"  one of them alone, with its log: {ALONE.format('N')}")
    told += by_key(facts) if whole else []
    return [*told, f"{facts['seconds']:.1f} s of work; files: {facts['folder']}"]
