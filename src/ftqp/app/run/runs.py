"""Runs a scenario into a folder: log, summary and figures, and says in words what happened."""

import json
from collections.abc import Callable, Iterable
from contextlib import nullcontext
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from ftqp.app.output.console import ExitCode, json_text, progress, say
from ftqp.app.scenario.setup import Setup
from ftqp.core.errors import FtqpError, InputError, MissingPackage, reading
from ftqp.core.whole_file import free_path, whole_file
from ftqp.sim.log.description import recorded
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.log_file import load_log, open_log
from ftqp.sim.log.log_writer import FILE_NAME, LogParts

RUNS = Path("runs")
"""Where runs go unless another folder is named."""
DRAWN = 256_000_000
"""Bytes of a log that figures show at most; of a longer one they show the end."""
SUMMARY, SCENARIO, CAMPAIGN = "summary.json", "scenario.toml", "campaign.toml"


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """A run that has ended: its folder, what ``summary.json`` holds, and its pictures in order."""

    folder: Path
    summary: dict[str, Any]
    figures: tuple[Path, ...]

    @property
    def exit_code(self) -> ExitCode:
        """What the process should return."""
        if self.summary["interrupted"]:
            return ExitCode.INTERRUPTED
        return ExitCode.DONE if self.summary["completed"] else ExitCode.STOPPED


def summary_with(folder: Path, names: Iterable[str]) -> dict[str, Any] | None:
    """The summary in a folder; None where there is none, or one without some of the names."""
    file = folder / SUMMARY
    if not file.is_file():
        return None
    with reading(file, "a summary of ftqp", "make it anew"):
        facts = json.loads(file.read_text(encoding="utf-8"))
    return facts if isinstance(facts, dict) and all(name in facts for name in names) else None


def free_folder(wanted: Path | None, name: str) -> Path:
    """The folder that a run may make: the one wanted, or ``runs/<name>-<time>``."""
    return free_path(wanted or RUNS / f"{name}-{datetime.now():%Y%m%d-%H%M%S-%f}", "output folder")


def holds(folder: Path, file: str) -> bool:
    """Whether there is a file in a folder, which one that cannot be does not hold."""
    try:
        return (folder / file).is_file()
    except OSError:
        return False


def make_folder(folder: Path, *, exist_ok: bool = False) -> None:
    """Make a folder and those above it."""
    try:
        folder.mkdir(parents=True, exist_ok=exist_ok)
    except OSError as error:
        raise InputError(f"output folder {folder} cannot be made: {error.strerror}") from error


def free_recording(wanted: Path | None, folder: Path) -> Path | None:
    """The file that a run into ``folder`` may record its QPs in."""
    if wanted is None:
        return None
    file = free_path(wanted, "recording", ".npz")
    if file.absolute() in (folder.absolute(), *folder.absolute().parents):
        raise InputError(f"recording {file} and output folder {folder} are in each other's way; rename one")
    return file


def run(
    setup: Setup,
    folder: Path,
    record: Path | None = None,
    advance: Callable[[float], None] | None = None,
    *,
    drawn: bool = True,
) -> Run:
    """Simulates ``setup`` and writes ``scenario.toml``, ``log.npy``, ``summary.json`` and ``figures/``."""
    with progress(setup.name, 1.0) if advance is None else nullcontext(advance) as notify:
        simulation = setup.simulation(
            log=_log(setup, folder), metadata=_about(setup), progress=lambda done, total: notify(done / total)
        )
        make_folder(folder)
        write(folder / SCENARIO, setup.toml)
        try:
            ended = simulation.run()
        finally:  # a log that cannot be written any more is no reason to lose the QPs, too
            kept = _record(setup, record)
    facts = {**(ended.summary or {}), "interrupted": ended.interrupted, "folder": str(folder), **kept}
    write(folder / SUMMARY, json_text(facts))
    figures = _figures(_drawn(folder, setup.planner.dt), folder) if drawn and not ended.interrupted else ()
    return Run(folder=folder, summary=facts, figures=figures)


def _log(setup: Setup, folder: Path) -> Path | LogParts:
    """Where the log goes, in one piece or in parts."""
    table = setup.tables.log
    if table.part is None:
        return folder / FILE_NAME
    return LogParts(
        path=folder / FILE_NAME, rows=max(1, round(table.part / setup.planner.dt)), keep=table.keep
    )


def _drawn(folder: Path, dt: float) -> Log:
    """What the figures show: the log, or of a long one its end."""
    rows = open_log(folder)
    most = max(1, DRAWN // (8 * len(rows.columns)))
    last = rows.end
    if rows.count <= most:
        return load_log(folder)
    say(
        f"note: the figures show the last {most * dt:g} s of the run, whose log is too long to be drawn whole"
    )
    return load_log(folder, begin=max(0.0, last - (most - 1) * dt))


def _about(setup: Setup) -> dict[str, Any]:
    """What the log says of the scenario, besides what the simulation knows itself."""
    return {
        "scenario": setup.name,
        "scheme": setup.planner.scheme.name,
        "backend": setup.planner.backend if setup.recorder is None else setup.recorder.inner.name,
        "resolved": setup.toml,
    }


def _record(setup: Setup, file: Path | None) -> dict[str, Any]:
    """Writes the QPs kept so far, and says where and how many; nothing without a file."""
    if file is None or setup.recorder is None:
        return {}
    count, dropped = len(setup.recorder), setup.recorder.dropped
    facts: dict[str, Any] = {"file": None, "qps": count, "dropped": dropped}
    if count:
        made = recorded(setup.recorder, setup.planner, setup.path, setup.schedule, _about(setup))
        made.save(file)
        facts |= {"file": str(file), "ticks": [int(made.tick[0]), int(made.tick[-1])]}
    return {"recording": facts}


def write(path: Path, text: str) -> None:
    """Writes a whole file or none, and makes its folder."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(path) as part:
            part.write_text(text, encoding="utf-8")
    except OSError as error:
        raise FtqpError(f"file {path} cannot be written: {error.strerror}") from error


def _figures(log: Log, folder: Path) -> tuple[Path, ...]:
    """The pictures of a run; none, with a note, when the package that draws them is missing."""
    try:
        from ftqp.viz.figures.run_figures import save_figures
    except MissingPackage as error:
        say(f"note: {error}")
        return ()
    return tuple(save_figures(log, folder / "figures"))
