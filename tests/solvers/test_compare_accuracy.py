"""What a solver claims is held against the truth, and the script says it in tables and files."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench.contenders import Contender
from comparison.accuracy import Outcome, answers, outcome, summed_up
from comparison.truth import Fact, truth
from tests.solvers.stand_ins import SOLVABLE, Scripted, sequence

from ftqp.qp import Claim

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "solvers" / "compare_accuracy.py"
BACKENDS = "active_set,daqp-fast,osqp-fast,quadprog,qpsolvers:gurobi"
SEQUENCES = "panda-healthy,panda-infeasible"
WHO = Contender(name="scripted", settings={"name": "scripted"})


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


def _cell(solver: Scripted, *problems: Any) -> dict[str, Any]:
    tape = sequence(*problems)
    true = truth(tape.problems, tape.solutions)
    return summed_up(WHO, tape, "warm", answers(solver, tape, start="warm"), true)


def test_a_liar_is_found_out() -> None:
    cell = _cell(Scripted(Claim.SOLVED, x=(0.0, 0.0), z_box=(0.0, 0.0)), SOLVABLE, SOLVABLE)
    assert cell["outcomes"] == {"solved, wrong": 2}
    assert cell["error"] == [0.5, 0.5]
    assert cell["residuals"]["primal"] == [0.0, 0.0]
    assert cell["residuals"]["dual"][1] == pytest.approx(3.0 / 4.0)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    """The object printed by a quick run of some contenders, and the folder of its results."""
    out = tmp_path_factory.mktemp("accuracy")
    done = _script("--quick", "--json", "--backends", BACKENDS, "--sequences", SEQUENCES, "--out", str(out))
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), out


def _script(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(SCRIPT), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


def test_every_contender_answers_every_sequence_cold_and_warm(run: tuple[dict[str, Any], Path]) -> None:
    result, _ = run
    found = {(cell["contender"], cell["sequence"], cell["start"]) for cell in result["cells"]}
    names = BACKENDS.split(",")[:-1]
    assert found == {(a, b, c) for a in names for b in SEQUENCES.split(",") for c in ("cold", "warm")}
    for cell in result["cells"]:
        about = result["sequences"][cell["sequence"]]
        assert sum(cell["outcomes"].values()) == sum(about["facts"].values()) == 12


def test_exact_solvers_are_right_about_every_solvable_qp(run: tuple[dict[str, Any], Path]) -> None:
    result, _ = run
    for cell in result["cells"]:
        if cell["contender"] in ("active_set", "quadprog"):
            assert set(cell["outcomes"]) <= {Outcome.RIGHT.value, Outcome.FOUND.value}
            assert cell["residuals"]["primal"][1] < 1e-9


def test_results_are_written_as_json_and_markdown(run: tuple[dict[str, Any], Path]) -> None:
    result, out = run
    stem = "compare_accuracy-quick"
    assert json.loads((out / f"{stem}.json").read_text()) == result
    text = (out / f"{stem}.md").read_text()
    for part in (
        "## Claims about",
        "## Limitations",
        "## Versions",
        "## Could not take part",
        "panda-healthy",
    ):
        assert part in text


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--backends", "dapq"), "'dapq' is not a backend or profile of the bench (did you mean 'daqp'?)"),
        (("--sequences", "panda-helthy"), "did you mean 'panda-healthy'?"),
        (("--backends", "nowhere.toml"), "profile nowhere.toml cannot be read"),
    ],
)
def test_an_unknown_name_is_one_sentence_and_exit_code_2(arguments: tuple[str, ...], sentence: str) -> None:
    done = _script("--quick", *arguments)
    assert done.returncode == 2
    assert sentence in done.stderr
    assert "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
