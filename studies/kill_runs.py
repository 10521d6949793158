"""Kills runs and campaigns at random instants, and looks at what is left of their files.

    python studies/kill_runs.py                      1,000 runs and 40 campaigns: some minutes of one core
    python studies/kill_runs.py --runs 50 --campaigns 5 --name mine

A warm process is forked for every kill, does what `ftqp run` does from the making of its folder on, or
`ftqp campaign`, and gets SIGKILL when it has used a share of processor time that is drawn.
"""

import argparse
import math
import mmap
import os
import random
import signal
import sqlite3
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from bench import command_line
from bench.results import add_out, appendix, circumstances, preamble, stem, told
from bench.tables import Table, quantity
from bench.wrapped_plant import WrappedPlant

import ftqp
from ftqp.app.campaign.episode_study import COLUMNS, KIND, load_campaign
from ftqp.app.commands.cli import app
from ftqp.app.run import runs
from ftqp.app.scenario.setup import Setup, load
from ftqp.app.study.results_file import ResultsFile
from ftqp.core.errors import InputError
from ftqp.sim.log.log_writer import LogWriter, log_files
from ftqp.sim.log.tick_recorder import TickRecorder
from ftqp.sim.plants.plant import Plant

ALLOWED = 0.5
"""So much of a log may be lost [s]."""
LONGEST = {"fast": 0.15, "parts": 0.15, "paced": 0.25, "campaign": 0.6}
"""The most processor time that a process may use before it is killed [s]."""
PATIENCE = 30.0
"""A process that does not use that much is killed after this time [s]."""
SCENARIO = """
robot = { name = "panda" }
planner = { dt = 0.001 }
start = { q = [0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398] }
path = { kind = "circle", radius = 0.1, duration = 20.0, laps = 1000.0 }
simulation = { seed = 0 }
"""
CAMPAIGN = """
[campaign]
episodes = 100000
seed = 1

[scenario]
robot = { name = "panda" }
planner = { dt = 0.01 }
path = { kind = "circle", radius = 0.05, duration = 0.3 }

[vary]
"path.radius" = { uniform = [0.01, 0.05] }
"""
WAYS = {
    "fast": "as fast as it goes, its log in one file",
    "parts": "the same, its log in parts of 5 s, the newest two kept",
    "paced": "in real time, 1 kHz, tick by tick",
}
LIMITATIONS = (
    "A killed process is not a machine that loses its power: what a process has written stays with the "
    "system, and the writer does not wait for the disk except when a part of a log is finished.",
    "What is lost is the time from the last write that was done to the kill, times in which a loaded machine "
    "did not let the process run included; of a paced run it is the ticks that were made and have no row.",
)


class Paced(WrappedPlant):
    """An arm that takes its time: a tick lasts dt, and ticks are counted where others can see it.

    Args:
        plant: The arm.
        dt: Of a tick [s].
        count: Where ticks are counted, (1,).
    """

    def __init__(self, plant: Plant, dt: float, count: Any) -> None:
        super().__init__(plant)
        self._dt, self._count, self._begun = dt, count, 0.0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._plant, name)

    def reset(self, q: Any, v: Any) -> None:
        """Begin anew."""
        super().reset(q, v)
        self._begun = time.monotonic()

    def advance(self, step: Any) -> None:
        """Move on, when it is time."""
        self._plant.advance(step)
        self._count[0] += 1
        time.sleep(max(0.0, self._begun + self._dt * float(self._count[0]) - time.monotonic()))


def notebook() -> Any:
    """Numbers that forked processes share: ticks made, rows written, and when that was [s]."""
    return np.frombuffer(mmap.mmap(-1, 64), dtype=np.float64)


def noting(note: Any) -> None:
    """Let this process note when it begins to make ticks, and every write that is done."""
    write, begin = LogWriter.write, TickRecorder.__init__
    written = [0]

    def noted_write(self: LogWriter, first: int, rows: Any) -> None:
        write(self, first, rows)
        written[0] += len(rows)
        note[1], note[2] = written[0], time.monotonic()

    def noted_begin(self: TickRecorder, *args: Any, **keywords: Any) -> None:
        begin(self, *args, **keywords)
        note[2] = time.monotonic()

    LogWriter.write, TickRecorder.__init__ = noted_write, noted_begin  # type: ignore[method-assign]


def killed(body: Callable[[], Any], seconds: float) -> float | None:
    """Fork a process, and kill it when it has used so much processor time: when; None if it ended before."""
    process = os.fork()
    if process == 0:
        silence = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silence, 1)
        os.dup2(silence, 2)
        try:
            body()
        finally:
            os._exit(0)
    clock, deadline = (~process << 3) | 2, time.monotonic() + PATIENCE
    while time.clock_gettime(clock) < seconds and (seconds == math.inf or time.monotonic() < deadline):
        if os.waitpid(process, os.WNOHANG)[0]:
            return None
        time.sleep(0.0005)
    os.kill(process, signal.SIGKILL)
    when = time.monotonic()
    os.waitpid(process, 0)
    return when


def killed_runs(count: int, draw: random.Random, folder: Path) -> dict[str, Any]:
    """What is left of so many runs, by way."""
    file = folder / "run.toml"
    file.write_text(SCENARIO, encoding="utf-8")
    setups = {
        "fast": load(str(file)),
        "parts": load(str(file), ["log.part=5.0", "log.keep=2"]),
        "paced": load(str(file)),
    }
    short = load(str(file), ["simulation.duration=0.1"])
    runs.run(short, folder / "warm", drawn=False)  # what is loaded and compiled late is so before the forks
    found: dict[str, Any] = {
        way: {"kills": 0, "left": Counter(), "damaged": [], "lost": [], "lost_more": 0, "rows": 0}
        for way in WAYS
    }
    names = list(WAYS)
    for number in range(count):
        way = names[number % len(names)]
        out, note = folder / f"run-{number}", notebook()
        when = killed(partial(one_run, setups[way], way, out, note), draw.uniform(0.0, LONGEST[way]))
        if when is not None:
            looked_at(found[way], out, note, when, paced=way == "paced")
        for left in sorted(out.rglob("*"), reverse=True) if out.exists() else ():
            left.unlink()
        if out.exists():
            out.rmdir()
    for way in found.values():
        way["left"] = dict(way["left"])
    return found


def one_run(setup: Setup, way: str, out: Path, note: Any) -> None:
    """A run that notes what it has done."""
    noting(note)
    if way == "paced":
        setup = replace(setup, plant=Paced(setup.plant, setup.planner.dt, note))
    runs.run(setup, out, drawn=False)


def looked_at(found: dict[str, Any], out: Path, note: Any, when: float, *, paced: bool) -> None:
    """Take in what a killed run has left."""
    found["kills"] += 1
    files = log_files(out) if out.exists() else []
    if not files:
        found["left"]["nothing yet" if not out.exists() else "a folder"] += 1
        if note[1]:
            found["damaged"].append(f"{int(note[1])} rows were written, and there is no log")
        return
    try:
        log = ftqp.load_log(out)
    except InputError as error:
        found["left"]["damaged"] += 1
        found["damaged"].append(str(error))
        return
    kept = int(log.metadata["first_tick"]) if "first_tick" in log.metadata else 0
    rows = round(log["t"][-1] / log.metadata["dt"]) + 1 if len(log) else kept
    found["left"]["a log with rows" if len(log) else "a log without rows"] += 1
    found["rows"] += len(log)
    if len(log) and np.abs(np.diff(log["t"]) - log.metadata["dt"]).max() > 1e-9:
        found["damaged"].append("rows are missing within the log")
    if rows < note[1]:
        found["damaged"].append(f"{int(note[1])} rows were written, {rows} are there")
    if note[2]:
        lost = max(0.0, note[0] - rows) * log.metadata["dt"] if paced else when - note[2]
        found["lost"].append(float(lost))
        found["lost_more"] += int(lost > ALLOWED)


def killed_campaigns(count: int, draw: random.Random, folder: Path) -> dict[str, Any]:
    """What is left of a campaign that is killed again and again and goes on each time."""
    file, out, whole = folder / "kills.toml", folder / "campaign", folder / "whole"
    file.write_text(CAMPAIGN, encoding="utf-8")
    made = load_campaign(str(file))
    about = {"study": made.text, "ftqp": ftqp.__version__}

    def rows_in(place: Path) -> dict[int, Any]:
        with ResultsFile(place, kind=KIND, key=made.key, columns=COLUMNS, about=about) as results:
            return {row[0]: row for row in results.table()}

    facts: dict[str, Any] = {"kills": 0, "damaged": [], "rows": 0, "grew": 0}
    before: dict[int, Any] = {}
    for _ in range(count):
        begun = ["campaign", str(file), "--out", str(out), "--jobs", "1"]
        body = partial(app, begun, standalone_mode=False)
        if killed(body, draw.uniform(0.0, LONGEST["campaign"])) is None:
            continue
        facts["kills"] += 1
        if not (out / "results.sqlite").is_file():
            for left in out.glob("*") if out.exists() else ():
                left.unlink()
            if out.exists():
                out.rmdir()
            continue
        with closing(sqlite3.connect(out / "results.sqlite")) as connection:
            said = connection.execute("PRAGMA integrity_check").fetchone()[0]
        rows = rows_in(out)
        if said != "ok":
            facts["damaged"].append(str(said))
        if not before.items() <= rows.items():
            facts["damaged"].append("rows that were there are not, or are others")
        facts["grew"] += int(len(rows) > len(before))
        before = rows
    facts["rows"] = len(before)
    if before:
        again = ["campaign", str(file), "--out", str(whole), "--jobs", "1"]
        again += ["--set", f"campaign.episodes={max(before) + 1}"]
        killed(partial(app, again, standalone_mode=False), math.inf)
        if not before.items() <= rows_in(whole).items():
            facts["damaged"].append("rows differ from those of a campaign that was not killed")
    return facts


def runs_table(found: dict[str, Any]) -> Table:
    """What became of the runs."""
    kinds = sorted({kind for way in found.values() for kind in way["left"]})
    rows = []
    for way, facts in found.items():
        lost = np.array(facts["lost"] or [0.0])
        rows.append(
            (
                way,
                str(facts["kills"]),
                *(str(facts["left"].get(kind, 0)) for kind in kinds),
                str(len(facts["damaged"])),
                quantity(float(np.median(lost))),
                quantity(float(lost.max())),
                str(facts["lost_more"]),
            )
        )
    headings = (
        "run", "kills", *(f"left {kind}" for kind in kinds), "damaged", "lost, median [s]", "lost, most [s]",
        f"more than {ALLOWED:g} s lost",
    )  # fmt: skip
    notes = tuple(f"{way}: {about}." for way, about in WAYS.items())
    damages = [sentence for facts in found.values() for sentence in facts["damaged"]]
    return Table(title="Runs", headings=headings, rows=rows, notes=(*notes, *damages[:10]))


def studies_table(facts: dict[str, Any]) -> Table:
    """What became of the campaign."""
    return Table(
        title="A campaign that is killed and goes on",
        headings=("", "kills", "kills after which it had more rows", "rows at last", "damaged"),
        rows=[
            (
                "`--jobs 1`",
                *(str(facts[key]) for key in ("kills", "grew", "rows")),
                str(len(facts["damaged"])),
            )
        ],
        notes=(
            "After every kill the database is checked (`PRAGMA integrity_check`) and each row that was there "
            "is compared; at last all rows are compared with those of a campaign that was never killed.",
            *facts["damaged"][:10],
        ),
    )


def main() -> int:
    """Kill, look, print, write; 0 when nothing was lost, 1 where it was, 2 for bad input."""
    options = _options()
    draw = random.Random(options.seed)
    with tempfile.TemporaryDirectory() as folder:
        found = killed_runs(options.runs, draw, Path(folder))
        studies = killed_campaigns(options.campaigns, draw, Path(folder))
    result = {
        **circumstances(
            "kill_runs", [], {"runs": options.runs, "campaigns": options.campaigns, "seed": options.seed}
        ),
        "runs": found,
        "studies": studies,
        "limitations": list(LIMITATIONS),
    }
    lines = preamble("Killed runs", result)
    for one in (runs_table(found), studies_table(studies)):
        lines += one.markdown()
    partial = options.runs < 1000 or options.campaigns < 40
    name = stem("kill_runs", name=options.name, quick=partial)
    code = told(result, "\n".join(lines + appendix(result)), options.out, name, as_json=options.json)
    bad = any(way["damaged"] or way["lost_more"] for way in found.values()) or studies["damaged"]
    return code or int(bool(bad))


def _options() -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    parser.add_argument("--runs", type=int, default=1000, metavar="N", help="runs to kill (default 1000)")
    parser.add_argument(
        "--campaigns", type=int, default=40, metavar="N", help="kills of a campaign (default 40)"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of the instants (default 0)")
    parser.add_argument("--name", metavar="WORD", help="a suffix of the files' names")
    add_out(parser, "kill_runs")
    parser.add_argument("--json", action="store_true", help="print one JSON object, not the report")
    options: argparse.Namespace = parser.parse_args()
    if options.runs < 0 or options.campaigns < 0:
        parser.error(f"--runs and --campaigns are {options.runs} and {options.campaigns}, expected 0 or more")
    return options


if __name__ == "__main__":
    if not hasattr(os, "fork"):
        sys.exit("this script forks processes, which this system cannot do")
    sys.exit(main())
