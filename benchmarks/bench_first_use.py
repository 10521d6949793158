"""What it costs until ftqp is ready: CPU seconds of this checkout and of an earlier commit, in the same run.

    python benchmarks/bench_first_use.py                   against the first release
    python benchmarks/bench_first_use.py --against HEAD~1  against another commit
    python benchmarks/bench_first_use.py --json            one JSON object on stdout, nothing else

Three things are measured, each in new processes by the CPU time that the system counts for them: what
``ftqp demo`` waits for the compiler (a run with an empty cache less a run with a full one), a warm start
(from a robot until its planner has made a step, imports counted apart), a warm ``ftqp run panda-circle``
with figures and log. Both checkouts take turns; medians are shown.
"""

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench import command_line, docs
from bench.results import circumstances
from bench.tables import Table
from rich.console import Console

ROOT = Path(__file__).resolve().parents[1]
FIRST_RELEASE = "9250cf8"
TARGETS = {"compiling": 0.40, "warm_start": 0.50, "warm_run": 0.25}
"""What each figure shall be at most, as a share of the first release's."""
GOALS = {"compiling": 20.0, "warm_start": 0.3, "warm_run": 3.0}
"""What each shall come to in the end [CPU s]."""
LIMITATIONS = (
    "CPU seconds of all processes that take part, not wall time.",
    "A warm start is counted without its imports, which have a line of their own; pinocchio is imported "
    "before.",
)

TITLES = {
    "compiling": "demo waits for the compiler",
    "warm_start": "warm start",
    "warm_start_imports": "warm start: its imports",
    "warm_run": "warm run of panda-circle",
}

START = """
import json, sys, time
import numpy as np
import ftqp
robot = ftqp.robots.load("panda")
known = set(sys.modules)
began = time.process_time()
if sys.argv[1:]:
    import importlib
    for name in json.loads(open(sys.argv[1]).read()):
        try:
            importlib.import_module(name)
        except ImportError:
            pass
    imported = time.process_time()
    began, apart = imported, imported - began
else:
    apart = 0.0
q = robot.neutral.copy()
planner = ftqp.Planner(robot, dt=0.001, level="velocity")
planner.reset(q)
planner.step(q, 0.0 * q, ftqp.Target(robot.pose(q)))
took = time.process_time() - began
names = [name for name in sys.modules if name not in known]
print(json.dumps({"took": took, "imports": apart, "names": names}))
"""


@dataclass(frozen=True, slots=True)
class Checkout:
    """A source tree and the folders that its processes use.

    Attributes:
        tree: the folder with ``src`` and ``pyproject.toml``.
        workshop: a folder for its caches and runs.
    """

    tree: Path
    workshop: Path

    def environment(self, cache: str) -> dict[str, str]:
        """The environment of its processes, with the compiled kernel in the cache of that name."""
        kept = {k: v for k, v in os.environ.items() if k not in ("NUMBA_CACHE_DIR", "NUMBA_DISABLE_JIT")}
        place = self.workshop / cache
        return kept | {
            "PYTHONPATH": str(self.tree / "src"),
            "XDG_CACHE_HOME": str(place),
            "FTQP_CACHE_DIR": str(place / "ftqp"),
            "MPLCONFIGDIR": str(self.workshop / "matplotlib"),
        }

    def command(self) -> list[str]:
        """How its command line is started."""
        with (self.tree / "pyproject.toml").open("rb") as file:
            module, function = tomllib.load(file)["project"]["scripts"]["ftqp"].split(":")
        return [sys.executable, "-c", f"import sys; from {module} import {function}; sys.exit({function}())"]

    def spent(self, cache: str, *arguments: str) -> float:
        """CPU time of its command line with these arguments, of all its processes [s]."""
        out = self.workshop / "out"
        shutil.rmtree(out, ignore_errors=True)
        with (self.workshop / "said").open("w+b") as said:
            child = subprocess.Popen(
                [*self.command(), *arguments, "--out", str(out)],
                env=self.environment(cache),
                cwd=self.workshop,
                stdout=said,
                stderr=said,
            )
            _, status, usage = os.wait4(child.pid, 0)
            child.returncode = os.waitstatus_to_exitcode(status)
            if child.returncode != 0:
                said.seek(0)
                raise SystemExit(
                    f"{' '.join(arguments)} of {self.tree} failed: {said.read()[-2000:].decode()}"
                )
        return usage.ru_utime + usage.ru_stime

    def start(self, modules: Path | None = None) -> dict[str, Any]:
        """What a new process needs from a robot to a first step; with a list of modules, those apart."""
        done = subprocess.run(
            [sys.executable, "-c", START, *([str(modules)] if modules else [])],
            env=self.environment("warm"),
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0:
            raise SystemExit(f"a start of {self.tree} failed: {done.stderr[-2000:]}")
        answer: dict[str, Any] = json.loads(done.stdout)
        return answer

    def measured(self) -> dict[str, float]:
        """One round: the figures of ``TITLES`` [s]."""
        shutil.rmtree(self.workshop / "empty", ignore_errors=True)
        cold = self.spent("empty", "demo")
        warm = self.spent("warm", "demo")
        modules = self.workshop / "modules.json"
        modules.write_text(json.dumps(self.start()["names"]))
        start = self.start(modules)
        return {
            "compiling": cold - warm,
            "warm_start": start["took"],
            "warm_start_imports": start["imports"],
            "warm_run": self.spent("warm", "run", "panda-circle"),
        }


def main() -> int:
    """Measures both checkouts and prints; 0 when done, 2 when the commit is not known."""
    options = _options()
    messages = Console(stderr=True)
    with tempfile.TemporaryDirectory() as folder:
        other = Path(folder) / "other"
        added = subprocess.run(
            ["git", "worktree", "add", "--detach", "--quiet", str(other), options.against],
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=False,
        )
        if added.returncode != 0:
            messages.print(f"cannot check out {options.against}: {added.stderr.strip()}", highlight=False)
            return 2
        try:
            rounds = _rounds(Path(folder), other, options.runs, messages)
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", str(other)], cwd=ROOT, check=False)
    medians = {
        name: {figure: statistics.median(one[figure] for one in rounds[name]) for figure in TITLES}
        for name in rounds
    }
    ratios = {figure: medians["now"][figure] / max(medians["then"][figure], 1e-9) for figure in TITLES}
    result = {
        **circumstances("bench_first_use", [], {"runs": options.runs, "against": options.against}),
        "against": options.against,
        "cpu_seconds": medians,
        "ratios": ratios,
        "targets": TARGETS,
        "goals": GOALS,
        "rounds": rounds,
        "left_out": {},
        "limitations": list(LIMITATIONS),
    }
    docs.told(result, "First use", [_table(options.against, medians, ratios)], options)
    return 0


def _options() -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    parser.add_argument("--against", default=FIRST_RELEASE, metavar="COMMIT", help="default %(default)s")
    parser.add_argument(
        "--runs",
        type=command_line.at_least_one,
        default=3,
        metavar="N",
        help="rounds, at least 1 (default 3)",
    )
    docs.options(parser)
    options: argparse.Namespace = parser.parse_args()
    return options


def _rounds(folder: Path, other: Path, runs: int, messages: Console) -> dict[str, list[dict[str, float]]]:
    """Every round of both checkouts, which take turns, after everything warm was made so."""
    checkouts = {}
    for name, tree in (("then", other), ("now", ROOT)):
        workshop = folder / f"workshop-{name}"
        workshop.mkdir()
        checkouts[name] = Checkout(tree=tree, workshop=workshop)
        messages.print(f"warming {tree}", highlight=False)
        checkouts[name].spent("warm", "demo")
        checkouts[name].spent("warm", "run", "panda-circle")
        checkouts[name].start()
    rounds: dict[str, list[dict[str, float]]] = {name: [] for name in checkouts}
    for k in range(runs):
        for name, checkout in checkouts.items():
            messages.print(f"round {k + 1} of {runs}: {name}", highlight=False)
            rounds[name].append(checkout.measured())
    return rounds


def _table(against: str, medians: dict[str, dict[str, float]], ratios: dict[str, float]) -> Table:
    return Table(
        title="CPU seconds, medians",
        headings=("", f"at {against}", "now", "share", "share at most", "goal"),
        rows=[
            (
                title,
                *(f"{medians[name][figure]:.2f}" for name in ("then", "now")),
                f"{ratios[figure]:.0%}",
                f"{TARGETS[figure]:.0%}" if figure in TARGETS else "",
                f"{GOALS[figure]:.1f}" if figure in GOALS else "",
            )
            for figure, title in TITLES.items()
        ],
    )


if __name__ == "__main__":
    sys.exit(main())
