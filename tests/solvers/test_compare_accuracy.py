"""What a solver claims is held against the truth, and the script says it in tables, files and figures."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench.contenders import Contender
from bench.results import inserted
from comparison.accuracy import Answers, Outcome, answers, outcome, settled, summed_up
from comparison.truth import Fact, Truth, truth
from tests.scripts import ran
from tests.solvers.stand_ins import INFEASIBLE, SOLVABLE, Scripted, sequence

from ftqp.core.errors import InputError
from ftqp.qp import Claim

SCRIPT = "solvers/compare_accuracy.py"
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


def test_a_right_answer_has_no_residual_and_no_error() -> None:
    cell = _cell(Scripted(Claim.SOLVED), SOLVABLE)
    assert cell["outcomes"] == {"solved, right": 1}
    assert cell["error"] == [0.0, 0.0]
    assert cell["residuals"]["gap"] == [0.0, 0.0]


def test_who_calls_an_infeasible_qp_solved_is_found_out() -> None:
    assert _cell(Scripted(Claim.SOLVED), INFEASIBLE)["outcomes"] == {"called solved": 1}


def test_a_warm_run_begins_cold_and_a_cold_one_is_always_cold() -> None:
    for start, expected in (("warm", [True, False, False]), ("cold", [True, True, True])):
        solver = Scripted(Claim.SOLVED)
        answers(solver, sequence(SOLVABLE, SOLVABLE, SOLVABLE), start=start)
        assert solver.colds == expected


def test_an_open_question_is_settled_by_any_right_answer() -> None:
    true = Truth(
        facts=[Fact.OPEN, Fact.OPEN],
        violations=np.zeros(2),
        references=np.full((2, 2), np.nan),
        worst_reference=0.0,
        disputed=0,
    )
    residuals = np.array([[1e-9] * 4, [1e-2] * 4])
    said = Answers(claims=[Claim.FAILED] * 2, residuals=residuals, x=np.zeros((2, 2)), iterations=[1, 1])
    assert settled(true, [said]).facts == [Fact.SOLVABLE, Fact.OPEN]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    """The object printed by a quick run of some contenders, and the folder of its results."""
    out = tmp_path_factory.mktemp("accuracy")
    done = ran(
        SCRIPT, "--quick", "--json", "--backends", BACKENDS, "--sequences", SEQUENCES, "--out", str(out)
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), out


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


def test_who_cannot_take_part_says_why_and_the_others_go_on(run: tuple[dict[str, Any], Path]) -> None:
    result, _ = run
    assert "pip install" in result["left_out"]["qpsolvers:gurobi"]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--backends", "dapq"), "'dapq' is not a backend or profile of the bench (did you mean 'daqp'?)"),
        (("--sequences", "panda-helthy"), "did you mean 'panda-healthy'?"),
        (("--backends", "nowhere.toml"), "profile nowhere.toml cannot be read"),
    ],
)
def test_an_unknown_name_is_one_sentence_and_exit_code_2(arguments: tuple[str, ...], sentence: str) -> None:
    done = ran(SCRIPT, "--quick", *arguments)
    assert done.returncode == 2
    assert sentence in done.stderr
    assert "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_the_part_between_the_markers_is_replaced_and_nothing_else() -> None:
    text = "above\n<!-- begin x -->\nold\n<!-- end x -->\nbelow\n"
    assert inserted(text, "x", ["new", ""]) == "above\n<!-- begin x -->\nnew\n<!-- end x -->\nbelow\n"
    with pytest.raises(InputError, match="<!-- begin y -->"):
        inserted(text, "y", ["new"])
