"""A day of simulated time in one process: memory, files, time and errors from its first hour to its last.

    python studies/long_run.py                      24 h: some minutes of one core
    python studies/long_run.py --cases circle       one of them
    python studies/long_run.py --hours 0.02         all shorter

Every case is `ftqp run` of a scenario with laps, whose log is cut into parts. What a part holds is looked at
as soon as it is finished, while the run goes on and before it is deleted.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from bench import command_line, study
from bench.tables import Table, exponent, quantity

import ftqp
from ftqp.sim.log.log_writer import FILE_NAME, beside, log_files

HOUR = 3600.0
PERIOD = 0.5
"""The memory of a run is looked at so often [s]."""
LINES = 9
"""Lines of a table at most, its first and last part among them."""
CASES = {
    "circle": (
        "a Panda goes round a circle of 0.2 m every 20 s, 100 Hz, acceleration level, scheme rmp; its third "
        "joint locks at half time; only the last parts of the log are kept",
        1.0,
        """
        robot = { name = "panda" }
        planner = { dt = 0.01, scheme = "rmp" }
        start = { q = [0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398] }
        path = { kind = "circle", radius = 0.1, duration = 20.0, laps = LAPS }
        faults = [{ kind = "locked", joint = "panda_joint3", at = HALF }]
        log = { part = PART, keep = 3 }
        """,
        20.0,
    ),
    "spinning": (
        "three links with joints without end go round their base every 40 s and never back, 50 Hz, velocity "
        "level",
        1.0,
        """
        robot = { name = "planar", options = { lengths = [1.0, 1.0, 0.5], continuous = true } }
        planner = { dt = 0.02, level = "velocity", task = { rows = ["x", "y"] } }
        start = { q = [-0.815635, 1.2, 0.4] }
        path = { kind = "circle", radius = 1.966365, duration = 40.0, laps = LAPS }
        log = { part = PART }
        """,
        40.0,
    ),
    "drifting": (
        "the Panda of `circle` with scheme mvn and no failure, a twenty-fourth of the time",
        1.0 / 24.0,
        """
        robot = { name = "panda" }
        planner = { dt = 0.01, scheme = "mvn" }
        start = { q = [0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398] }
        path = { kind = "circle", radius = 0.1, duration = 20.0, laps = LAPS }
        log = { part = PART, keep = 3 }
        """,
        20.0,
    ),
    "physics": (
        "a Panda in MuJoCo, torque commands, noisy encoders, a detector, tick by tick in Python, 1 kHz, rmp, "
        "a 240th of the time",
        1.0 / 240.0,
        """
        robot = { name = "panda" }
        planner.dt = 0.001
        planner.scheme = "rmp"
        planner.drive = { kind = "torque" }
        planner.noise = { q = 1e-5 }
        planner.detector = {}
        start = { q = [0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398] }
        path = { kind = "circle", radius = 0.1, axes = ["y", "z"], duration = 6.0, laps = LAPS }
        simulation = { plant = "mujoco" }
        sensors = { position_noise = 1e-5 }
        log = { part = PART }
        """,
        6.0,
    ),
}
"""What is run, its share of the hours, its scenario, and how long a lap takes [s]."""
PARTS = 48
"""Into so many parts a log is cut."""
LIMITATIONS = (
    "Steps are as fast as the machine goes, which others used at the same time; nothing waits for real time.",
    "The first 200,000 times of steps are kept for their quantiles, and counted in bins from then on: memory "
    "grows a little until then, 3 min of a run at 1 kHz.",
    "Resident memory is what the system counts for the process, shared pages included, in the middle of the "
    "run; figures are drawn after it.",
    "Time error is the largest distance of a row's time from its tick divided by the ticks of a second.",
    "Drift is how far the joint that moved most is, at the beginning of a lap, from where it was at the "
    "beginning of the first lap that is wholly in the first part, whole turns left out. A scheme that "
    "minimises speeds, such as `mvn`, drifts from lap to lap; `rmp` is made not to.",
)


@dataclass(frozen=True, kw_only=True)
class Part:
    """A finished part of a log, and its run at that moment."""

    begin: float
    end: float
    rows: int
    time_error: float
    largest_error: float
    turns: float
    drift: float
    statuses: dict[str, int]
    resident: float
    disk: float
    seconds: float


@dataclass(kw_only=True)
class Watched:
    """A run that is watched."""

    case: str
    lap: float
    begun: float
    peak: float = 0.0
    parts: list[Part] = field(default_factory=list)
    seen: set[str] = field(default_factory=set)
    first: Any = None

    def look(self, out: Path, resident: float) -> None:
        """Take in the parts that are finished and were not looked at."""
        for file in log_files(out):
            if file.name != FILE_NAME and file.name not in self.seen and beside(file).exists():
                self.seen.add(file.name)
                try:
                    self.take(file, out, resident)
                except ftqp.InputError:
                    if file.exists() and beside(file).exists():  # else it is one of more than are kept
                        raise

    def take(self, file: Path, out: Path, resident: float) -> None:
        """Take in a part."""
        log = ftqp.load_log(file, signals=["t", "q", "position_error", "status"])
        first, rate = log.metadata["first_tick"], round(1.0 / log.metadata["dt"])
        ticks = first + np.arange(len(log))
        laps = np.flatnonzero(ticks % round(self.lap * rate) == 0)
        starts = log["q"][laps[1:] if self.first is None and len(laps) > 1 else laps]
        if self.first is None and len(starts):
            self.first = starts[0]
        moved = starts - self.first if len(starts) else np.zeros((1, 1))
        endless = np.array([low is None for low in log.metadata["limits"]["q_min"]])
        turns = np.where(endless, np.round(moved / (2.0 * np.pi)), 0.0)
        names = list(ftqp.StepStatus)
        found, counts = np.unique(log["status"], return_counts=True)
        self.parts.append(
            Part(
                begin=float(log["t"][0]),
                end=float(log["t"][-1]),
                rows=len(log),
                time_error=float(np.abs(log["t"] - ticks / rate).max()),
                largest_error=float(np.nanmax(log["position_error"])),
                turns=float(np.abs(turns).max()),
                drift=float(np.abs(moved - 2.0 * np.pi * turns)[-1].max()),
                statuses={names[code].name: int(n) for code, n in zip(found, counts, strict=True)},
                resident=resident,
                disk=sum(one.stat().st_size for one in log_files(out) if one.exists()) / 2**20,
                seconds=time.monotonic() - self.begun,
            )
        )


def resident_of(process: int) -> float | None:
    """Resident memory of a process [MiB]; None where it has ended or the system does not say."""
    try:
        for line in Path(f"/proc/{process}/status").read_text(encoding="ascii").splitlines():
            if line.startswith("VmRSS"):
                return int(line.split()[1]) / 1024
    except OSError:
        pass
    return None


def run(case: str, hours: float, folder: Path) -> dict[str, Any]:
    """One case."""
    told_of, share, text, lap = CASES[case]
    seconds = hours * share * HOUR
    laps = max(PARTS, round(seconds / lap))
    file, out = folder / f"{case}.toml", folder / case
    for name, value in {"LAPS": laps, "HALF": laps // 2 * lap, "PART": laps * lap / PARTS}.items():
        text = text.replace(name, str(value))
    file.write_text("\n".join(line.strip() for line in text.splitlines()), encoding="utf-8")
    watched = Watched(case=case, lap=lap, begun=time.monotonic())
    command = [sys.executable, "-m", "ftqp", "run", str(file), "--out", str(out), "--json"]
    with (folder / f"{case}.json").open("w") as kept:
        process = subprocess.Popen(command, stdout=kept)
        while process.poll() is None:
            resident = resident_of(process.pid)
            if resident is not None and not (out / "summary.json").exists():
                watched.peak = max(watched.peak, resident)
                watched.look(out, resident)
            time.sleep(PERIOD)
    if process.returncode not in (0, 1):
        raise SystemExit(f"{case} ended with {process.returncode}")
    last = watched.parts[-1].resident if watched.parts else 0.0
    watched.look(out, last)  # what was finished after the last look
    if (out / FILE_NAME).exists():
        watched.take(out / FILE_NAME, out, last)
    facts = json.loads((folder / f"{case}.json").read_text(encoding="utf-8"))
    return {
        "case": case,
        "about": told_of,
        "simulated": laps * lap,
        "wall": time.monotonic() - watched.begun,
        "peak": watched.peak,
        "summary": facts,
        "parts": [vars(part) for part in watched.parts],
    }


def table(found: dict[str, Any]) -> Table:
    """What became of a case, at some of its parts."""
    parts = found["parts"]
    shown = sorted({round(k) for k in np.linspace(0, len(parts) - 1, min(LINES, len(parts)))})
    facts, hours = found["summary"], found["simulated"] / HOUR
    violations = max(facts["max_limit_violation"].values())
    moved = facts["max_failed_joint_motion"]
    return Table(
        title=f"{found['case']}: {quantity(hours, 4)} h in {quantity(found['wall'] / 60)} min",
        headings=(
            "part ends at [h]", "resident [MiB]", "log on disk [MiB]", "time error [s]", "largest error [um]",
            "turns", "drift [rad]", "statuses",
        ),
        rows=[
            (
                quantity(parts[k]["end"] / HOUR, 4),
                quantity(parts[k]["resident"], 4),
                quantity(parts[k]["disk"], 4),
                exponent(parts[k]["time_error"]),
                quantity(1e6 * parts[k]["largest_error"]),
                quantity(parts[k]["turns"], 6),
                exponent(parts[k]["drift"]),
                ", ".join(f"{name} {count}" for name, count in parts[k]["statuses"].items()),
            )
            for k in shown
        ],
        notes=(
            f"Here {found['about']}.",
            f"{facts['steps']} steps, {'completed' if facts['completed'] else 'not completed'}; statuses "
            + ", ".join(f"{name} {count}" for name, count in facts["status_counts"].items())
            + f"; largest distance from the path {quantity(1e6 * facts['max_position_error'])} um; limits "
            f"exceeded by at most {exponent(violations)}"
            + "".join(f"; {joint} moved by {exponent(by)} rad after its lock" for joint, by in moved.items())
            + f"; most memory while it ran {quantity(found['peak'], 4)} MiB.",
        ),
        text_last=True,
    )  # fmt: skip


def measured(given: argparse.Namespace) -> dict[str, Any]:
    """Every case that is asked for."""
    hours = 0.01 if given.quick else given.hours
    keep = tempfile.TemporaryDirectory(dir=given.keep)
    with keep as folder, ThreadPoolExecutor(given.jobs) as at_a_time:
        return {"cases": list(at_a_time.map(lambda case: run(case, hours, Path(folder)), given.cases))}


if __name__ == "__main__":
    parser = study.options(__doc__, "long_run", "a hundredth of an hour")
    add, whole = parser.add_argument, command_line.at_least_one
    add("--hours", type=float, default=24.0, metavar="H", help="simulated hours (default 24)")
    add("--cases", nargs="+", choices=tuple(CASES), default=list(CASES), help="which (default all)")
    add("--jobs", type=whole, default=1, metavar="N", help="cases at a time (default 1)")
    add("--keep", type=Path, metavar="DIR", help="folder for the runs, with 9 GB to spare")
    given = parser.parse_args()
    study.on_record(
        given, "Long runs", measured, lambda found: [table(one) for one in found["cases"]], LIMITATIONS,
        quick=given.quick or given.hours < 24.0 or set(given.cases) != set(CASES),
    )  # fmt: skip
