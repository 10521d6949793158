"""What it costs until ftqp is ready: CPU seconds of building the kernel, of a first planner, and of a run.

    python benchmarks/bench_first_use.py          building from nothing included, which takes minutes
    python benchmarks/bench_first_use.py --json   one JSON object on stdout, nothing else

The kernel is built into a folder of its own: what the demo waits for, then the rest, then what an edit of one
formula compiles anew. Each figure is of new processes, by the CPU time that the system counts for them and
those that they start. A first planner is counted without imports, which have a line of their own.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from bench import docs
from bench.results import circumstances
from bench.tables import Table
from rich.console import Console

ROOT = Path(__file__).resolve().parents[1]
GOALS = {"first_part": 45.0, "building": 150.0, "edit": 15.0, "planner": 0.3, "run": 3.0}
"""What each shall come to at most [CPU s]."""
TITLES = {
    "first_part": "building what the demo waits for",
    "building": "building all of the kernel",
    "edit": "building after an edit of one formula",
    "planner": "first planner and its first step",
    "planner_imports": "first planner: its imports",
    "run": "run of panda-circle, with figures and log",
}
EDIT = ("settling/trigger.py", "def _look(K: Any) -> float:", "    K.state.ticks += 0\n")
"""A file of the kernel, a function in it, and a line that goes behind its docstring."""
LIMITATIONS = ("CPU seconds of all processes that take part, not wall time.",)

START = """
import json, sys, time
import numpy as np
import ftqp
robot = ftqp.robots.load("panda")
began = time.process_time()
if len(sys.argv) > 1:
    import importlib
    for name in json.loads(sys.argv[1]):
        importlib.import_module(name)
imported = time.process_time()
known = set(sys.modules)
planner = ftqp.Planner(robot, dt=0.001, level="velocity")
q = robot.neutral.copy()
planner.reset(q)
planner.step(q, 0.0 * q, ftqp.Target(robot.pose(q)))
took = time.process_time() - imported
new = [name for name in sys.modules if name not in known and name.startswith(("ftqp", "scipy", "ctypes"))]
print(json.dumps({"took": took, "imports": imported - began, "names": new}))
"""


def spent(source: Path, *command: str) -> float:
    """CPU time of a process of Python with that source, and of all that it starts [s]."""
    with tempfile.TemporaryFile() as said:
        child = subprocess.Popen(
            [sys.executable, *command],
            env={**os.environ, "PYTHONPATH": str(source)},
            stdout=said,
            stderr=said,
        )
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        if child.returncode != 0:
            said.seek(0)
            raise SystemExit(f"{' '.join(command)[:200]} failed: {said.read()[-2000:].decode()}")
    return usage.ru_utime + usage.ru_stime


def built(folder: Path) -> dict[str, float]:
    """CPU seconds of building a copy of the kernel."""
    source = folder / "src"
    shutil.copytree(ROOT / "src", source, ignore=shutil.ignore_patterns("__pycache__", "_kernel"))
    maker = ("-m", "ftqp.kernel.building", "--store", str(folder / "store"))
    first = spent(source, *maker, "--part", "first")
    rest = spent(source, *maker)
    path = source / "ftqp" / "kernel" / EDIT[0]
    before, found, after = path.read_text().partition(EDIT[1])
    if not found:
        raise SystemExit(f"{EDIT[0]} has no {EDIT[1]}")
    end = after.index('"""\n', after.index('"""') + 3) + 4
    path.write_text(before + found + after[:end] + EDIT[2] + after[end:])
    return {"first_part": first, "building": first + rest, "edit": spent(source, *maker)}


def started() -> dict[str, float]:
    """CPU seconds of a first planner, and of its imports."""

    def once(*names: str) -> dict[str, Any]:
        command = [sys.executable, "-c", START, *names]
        done = subprocess.run(
            command, env={**os.environ, "PYTHONPATH": str(ROOT / "src")}, capture_output=True, check=True
        )
        result: dict[str, Any] = json.loads(done.stdout)
        return result

    apart = once(json.dumps(once()["names"]))
    return {"planner": apart["took"], "planner_imports": apart["imports"]}


def main() -> int:
    """Measures and prints; 0 when done."""
    options = docs.asked(__doc__)
    messages = Console(stderr=True)
    with tempfile.TemporaryDirectory() as folder:
        messages.print("building", highlight=False)
        figures = built(Path(folder))
        messages.print("starting", highlight=False)
        figures |= started()
        run = ("-m", "ftqp", "run", "panda-circle", "--out", str(Path(folder) / "out"))
        figures["run"] = spent(ROOT / "src", *run)
    result = {
        **circumstances("bench_first_use", [], {}),
        "cpu_seconds": figures,
        "goals": GOALS,
        "limitations": list(LIMITATIONS),
    }
    docs.publish(result, "First use", [_table(figures)], options)
    return 0


def _table(figures: dict[str, float]) -> Table:
    return Table(
        title="CPU seconds",
        headings=("", "now", "at most"),
        rows=[
            (title, f"{figures[name]:.2f}", f"{GOALS[name]:.1f}" if name in GOALS else "")
            for name, title in TITLES.items()
        ],
    )


if __name__ == "__main__":
    sys.exit(main())
