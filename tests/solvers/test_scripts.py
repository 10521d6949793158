"""A quick run of each script of comparison: it counts what it says, in tables and in files."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from comparison.accuracy import Outcome, outcome
from comparison.truth import Fact

from ftqp.qp import Claim

ROOT = Path(__file__).resolve().parents[2]
SEQUENCES = ["panda-healthy", "panda-infeasible"]
JUDGED = ["active_set", "daqp-fast", "osqp-fast", "quadprog"]
ON_BOTH = ["--sequences", ",".join(SEQUENCES), "--backends"]
RUNS = {
    "compare_accuracy": ["--quick", *ON_BOTH, ",".join([*JUDGED, "qpsolvers:gurobi"])],
    "compare_semidefinite": ["--quick"],
}


def script(name: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(ROOT / "solvers" / f"{name}.py"), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=400, check=False)


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[dict[str, Any], Path]]:
    """What each script found, and the place of its files but for their ending; run when asked for."""

    class Runs(dict[str, Any]):
        def __missing__(self, name: str) -> tuple[dict[str, Any], Path]:
            out = tmp_path_factory.mktemp(name)
            done = script(name, *RUNS[name], "--out", str(out))
            assert done.returncode == 0, done.stderr
            stem = out / f"{name}-quick"
            self[name] = json.loads(stem.with_suffix(".json").read_text()), stem
            return self[name]

    return Runs()


def test_a_report_says_what_was_found_who_was_left_out_and_what_it_does_not_say(runs: Any) -> None:
    text = runs["compare_accuracy"][1].with_suffix(".md").read_text()
    parts = ("Claims about", "Limitations", "Versions", "Could not take part")
    assert all(f"## {part}" in text for part in parts)


def test_exact_solvers_are_right_about_every_solvable_qp(runs: Any) -> None:
    for cell in runs["compare_accuracy"][0]["cells"]:
        if cell["contender"] in ("active_set", "quadprog"):
            assert set(cell["outcomes"]) <= {Outcome.RIGHT.value, Outcome.FOUND.value}
            assert cell["residuals"]["primal"][1] < 1e-9
    rows = [row for row in runs["compare_semidefinite"][0]["rows"] if row["backend"] == "active_set"]
    assert len(rows) == 6 and all(row["right"] == row["of"] > 0 for row in rows)


@pytest.mark.parametrize(
    ("claim", "residual", "fact", "expected"),
    [
        (Claim.SOLVED, 1e-9, Fact.SOLVABLE, Outcome.RIGHT),
        (Claim.SOLVED, 1e-5, Fact.SOLVABLE, Outcome.COARSE),
        (Claim.SOLVED, 1e-1, Fact.SOLVABLE, Outcome.WRONG),
        (Claim.MAX_ITERATIONS, 1e-9, Fact.SOLVABLE, Outcome.UNSURE),
        (Claim.MAX_ITERATIONS, 1e-1, Fact.SOLVABLE, Outcome.GAVE_UP),
        (Claim.FAILED, np.inf, Fact.SOLVABLE, Outcome.GAVE_UP),
        (Claim.INFEASIBLE, np.inf, Fact.SOLVABLE, Outcome.FALSE_ALARM),
        (Claim.INFEASIBLE, np.inf, Fact.INFEASIBLE, Outcome.FOUND),
        (Claim.FAILED, np.inf, Fact.INFEASIBLE, Outcome.MISSED),
        (Claim.SOLVED, 1e-1, Fact.INFEASIBLE, Outcome.CLAIMED),
        (Claim.SOLVED, 1e-1, Fact.OPEN, Outcome.OPEN),
    ],
)
def test_a_claim_is_judged_by_residual_and_fact(
    claim: Claim, residual: float, fact: Fact, expected: Outcome
) -> None:
    assert outcome(claim, residual, fact) is expected


def test_every_qp_of_the_study_of_the_cap_has_a_solution_and_hardly_one_ends_at_the_cap() -> None:
    found = json.loads(script("dtrnn_cap", "--count", "20", "--json").stdout)
    for row in found["rows"]:
        assert row["active_set"] == row["count"] == 20 and set(row["ends"]) <= {"SOLVED", "MAX_ITERATIONS"}
        assert row["condition"] > 100.0 or row["ends"] == {"SOLVED": 20}
    assert found["ill_conditioned"] == 180 and found["capped"] <= 1
