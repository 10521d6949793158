"""``ftqp report``: runs, coverage results and campaigns as one page that opens without a network."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from ftqp import __version__
from ftqp.app.commands.campaign_episodes import campaign_parts, read_campaign
from ftqp.app.commands.coverage_words import coverage_parts, read_coverage
from ftqp.app.output import words
from ftqp.app.output.console import ExitCode, answer, progress, say
from ftqp.app.run.recorded_robot import notes_of, recorded_robot, scenario_of
from ftqp.app.run.runs import SUMMARY, write
from ftqp.core.errors import FtqpError, InputError, MissingPackage
from ftqp.core.whole_file import free_path
from ftqp.sim.log.description import versions
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.log_file import load_log
from ftqp.sim.log.log_writer import FILE_NAME, log_files
from ftqp.sim.log.metrics import summary
from ftqp.viz.pages.page import page
from ftqp.viz.report.run_report import carried

LEVELS = {"acceleration": "accelerations", "velocity": "velocities"}
"""What a planner commands at each level."""


def sentences(log: Log) -> list[str]:
    """What happened, a paragraph each."""
    about, facts = log.metadata, summary(log)
    facts["interrupted"] = about.get("state") == "interrupted"
    story = " ".join(str(scenario_of(about).get("description", "")).split())
    said = [*([story] if story else []), _who(about), *notes_of(about, float(log["t"][-1]))]
    said += [f"{words.fault_sentence(fault)}." for fault in facts["faults"] if fault["at"] <= log["t"][-1]]
    if about.get("state", "finished") in ("finished", "interrupted"):
        said.append(f"The task: {words.ending(facts)}.")
    said += [f"{one[0].upper()}{one[1:]}." for one in words.kept_sentences(facts)]
    slides = dict(zip(about["joints"], about["prismatic"], strict=True))
    said += [
        f"The brake of {joint} carried up to {top:.3g} {'N' if slides[joint] else 'N m'}, by the arm's model."
        for joint, top in carried(log).items()
    ]
    return said


def _who(about: dict[str, Any]) -> str:
    """Which arm, led by what."""
    commanded = LEVELS.get(str(about.get("level")), "commands")
    period = 1e3 * about["dt"]
    scheme = f", scheme {about['scheme']}" if about.get("scheme") else ""
    backend = f", solver {about['backend']}" if about.get("backend") else ""
    planner = f"every {period:g} ms the planner commands joint {commanded}{scheme}{backend}"
    return f"The arm is {about['robot']}; {planner}."


LARGEST: Final = 4_000_000
"""Bytes of a report at most: it goes into a mail."""
FIGURES: Final = 450_000
"""Bytes that the figures and numbers of a run take, about; what is left goes to replays."""


SECTIONS: Final = ((read_coverage, coverage_parts), (read_campaign, campaign_parts))
"""Results that are no runs: what reads a folder, or gives None, and what makes the section of it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What a report is made of: the log of a run, or the section and the title of another result."""

    label: str
    title: str = ""
    log: Log | None = None
    parts: Sequence[str] = ()


def report(folders: Sequence[Path], file: Path, *, full: bool, as_json: bool) -> ExitCode:
    """Writes the page."""
    free_path(file, "report")
    results = [read_result(folder, label) for folder, label in zip(folders, _labels(folders), strict=True)]
    text, notes = made(results, full=full)
    size = len(text.encode())
    write(file, text)
    for note in notes:
        say(f"note: {note}")
    logs = {result.label: result.log for result in results if result.log is not None and as_json}
    runs = [summary(log) | {"label": label} for label, log in logs.items()]
    facts = {"report": str(file), "bytes": size, "notes": notes, "runs": runs}
    answer(facts, as_json, [f"{file}: {size / 1e6:.1f} MB; open it with any browser, without a network"])
    return ExitCode.DONE


def read_result(folder: Path, label: str) -> Result:
    """What a folder holds."""
    if not os.path.exists(folder):  # a name that is too long is none, either
        raise InputError(
            f"{folder} does not exist; expected the folder of a run, a coverage result or a campaign"
        )
    if folder.is_file() or log_files(folder):
        log = load_log(folder)
        if not len(log):
            raise InputError(f"log {log.path} has no rows, expected at least one to report")
        return Result(label=label, log=log)
    for read, parts in SECTIONS:
        facts = read(folder)
        if facts is not None:
            title = f"What {label} survives" if read is read_coverage else f"Campaign {label}"
            return Result(label=label, title=title, parts=parts(label, facts, folder))
    within = sorted(file.parent.name for file in folder.glob(f"*/{FILE_NAME}"))
    raise InputError(
        f"{folder} holds no result: expected {FILE_NAME} as `ftqp run` writes it, {SUMMARY} as `ftqp "
        f"coverage` and `ftqp campaign` write it when they have ended"
        + (f"; it holds the runs {', '.join(within)!s:.200}, name those" if within else "")
    )


def _labels(folders: Sequence[Path]) -> list[str]:
    """Short names of the folders, whole ones where short ones are alike."""
    short = [folder.resolve().name or str(folder) for folder in folders]
    whole = [str(folder) for folder in folders]
    labels = [name if short.count(name) == 1 else path for name, path in zip(short, whole, strict=True)]
    return [f"{label} ({k})" if labels.count(label) > 1 else label for k, label in enumerate(labels, 1)]


def made(results: Sequence[Result], *, full: bool) -> tuple[str, list[str]]:
    """The page, and what is to be known of it."""
    from ftqp.viz.report.run_report import ReportedRun, run_parts, side_by_side, versions_part

    logs = {result.label: result.log for result in results if result.log is not None}
    notes: list[str] = []
    reported: list[ReportedRun] = []
    room = LARGEST - FIGURES * max(len(logs), 1)
    with progress("report", len(results)) as notify:
        for label, log in logs.items():
            replay, plays = _replay(log, label, room, full=full)
            room -= len(replay.encode()) if plays else 0
            notes += [] if plays else [replay]
            reported.append(
                ReportedRun(
                    label=label, log=log, facts=summary(log), sentences=sentences(log), replay=replay,
                    scenario=_scenario(log), plays=plays,
                )
            )  # fmt: skip
            notify(len(reported))
    parts: list[str] = []
    if len(reported) > 1:
        parts += side_by_side(reported)
    for run in reported:
        parts += run_parts(run, alone=len(reported) == 1)
    for result in results:
        parts += result.parts
    if reported:
        parts.append(versions_part(reported, versions()))
    text = page(_title(results), parts, f"Made by ftqp {__version__} from {_named(results)}.", wide=True)
    return text, notes


def _replay(log: Log, label: str, room: int, *, full: bool) -> tuple[str, bool]:
    """The part of the page that plays a run, or a sentence that says why there is none."""
    robot, why = recorded_robot(log.rows)
    if robot is None:
        return f"There is no replay: {why}.", False
    try:
        from ftqp.viz.live.server import replay

        return replay(log, robot, label, room, full=full), True
    except MissingPackage as error:
        return f"There is no replay: {error}.", False
    except FtqpError as error:
        return f"There is no replay: {str(error).splitlines()[0]}.", False


def _scenario(log: Log) -> str:
    text = log.metadata.get("resolved")
    return text if isinstance(text, str) else ""


def _title(results: Sequence[Result]) -> str:
    if len(results) > 1:
        return f"{len(results)} results side by side: {_named(results)!s:.200}"
    result = results[0]
    if result.log is None:
        return result.title
    return f"Run {result.log.metadata.get('scenario') or result.label}"


def _named(results: Sequence[Result]) -> str:
    return ", ".join(result.label for result in results)
