"""qpbenchmark's own command line runs the recorded problems."""

import csv
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

if find_spec("qpbenchmark") is None:
    pytest.skip('needs pip install -e ".[dev]"', allow_module_level=True)

SOLVERS = Path(__file__).resolve().parents[2] / "solvers"
SET = SOLVERS / "qpbenchmark_set.py"
AGREE = """
import numpy as np, qpsolvers
import qpbenchmark_set
names = ("panda-torque", "planar6-locked")
chosen = [problem for problem in qpbenchmark_set.QpbenchmarkSet() if problem.name.startswith(names)]
recordings = qpbenchmark_set.sequences(names)
for problem in chosen:
    name, _, place = problem.name.rpartition("-")
    x = recordings[name].x[int(place)]
    for solver in ("quadprog", "daqp", "ftqp_active_set"):
        found = qpsolvers.solve_problem(problem, solver).x
        assert np.abs(found - x).max() <= 1e-5 * (1.0 + np.abs(x).max()), (problem.name, solver)
print(len(chosen))
"""


def _rows(file: Path) -> list[dict[str, str]]:
    with file.open(newline="") as stream:
        return list(csv.DictReader(stream))


def _run(command: list[str], folder: Path, solver: str) -> list[dict[str, str]]:
    file = folder / "mine.csv"
    arguments = ["--results-path", str(file), "run", "--solver", solver]
    done = subprocess.run(
        [*command, *arguments, "--author", "nobody"],
        capture_output=True, text=True, timeout=300, check=False, cwd=folder,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    assert {row["solver"] for row in _rows(file)} == {solver}
    return [row for row in _rows(file) if row["settings"] == "high_accuracy"]


def test_our_own_solver_takes_part_through_the_file_itself(tmp_path: Path) -> None:
    rows = _run([sys.executable, str(SET)], tmp_path, "ftqp_active_set")
    assert len(rows) > 100
    assert all(row["found"] == "True" for row in rows)
    assert max(float(row["dual_residual"]) for row in rows) < 1e-6


def test_translated_problems_have_the_recorded_solutions() -> None:
    done = subprocess.run(
        [sys.executable, "-c", AGREE], capture_output=True, text=True, timeout=300, check=False, cwd=SOLVERS
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert int(done.stdout) == 12
