"""The study of the network counts what it says, and what is known of the methods shows in its figures."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from comparison.dtrnn_study import (
    METHODS,
    RIGHT,
    SCALED,
    Network,
    Spent,
    along,
    settings,
    until_right,
)
from comparison.dtrnn_study_problems import random_qp
from comparison.dtrnn_study_report import EXPECTED, OBJECTIVES, number, triple
from comparison.recorded import recorded
from comparison.sequences import sequences

from ftqp.qp import QP, Claim, solve
from ftqp.qp.solving import loaded

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "solvers" / "study_dtrnn.py"
WITHIN = 0.2
"""How far iterations may be from the expected ones, as a share."""


def _random(condition: float, active: int, seed: int = 1) -> tuple[QP, Any]:
    return random_qp(np.random.default_rng(seed), condition, active)


@pytest.mark.parametrize("condition", [1.0, 1e4, 1e10])
@pytest.mark.parametrize("active", [0, 2, 4])
def test_a_random_qp_has_the_condition_and_the_active_bounds_that_were_asked_for(
    condition: float, active: int
) -> None:
    problem, x = _random(condition, active)
    assert np.linalg.cond(problem.H) == pytest.approx(condition, rel=1e-3)
    answer = solve(problem, "daqp")
    assert answer.x == pytest.approx(x, abs=1e-6)
    at_bound = np.isclose(x, problem.lb, atol=1e-9) | np.isclose(x, problem.ub, atol=1e-9)
    assert np.count_nonzero(at_bound) == active


def test_until_right_finds_the_first_iteration_that_is_right() -> None:
    problem, x = _random(1e3, 1)
    chosen = settings(SCALED)
    k = until_right(problem, x, chosen)
    goal = RIGHT * (1.0 + np.abs(x).max())
    for iterations, right in ((k, True), (k - 2, False)):
        few = settings(SCALED, max_iterations=iterations, tolerance=1e-15)
        network = Network(problem.n, problem.m, problem.p, few)
        network.solve(loaded(problem).flat)
        assert bool(np.abs(network.x - x).max() <= goal) is right


def test_who_never_gets_there_counts_with_the_cap() -> None:
    problem, x = _random(1e6, 1)
    assert until_right(problem, x, settings("94lvi", max_iterations=50)) == 50


def test_a_warm_run_needs_fewer_iterations_and_a_break_makes_it_cold() -> None:
    recording = sequences(["planar6-healthy"])["planar6-healthy"].part(0, 6)
    sequence, chosen = recorded("x", recording), settings(SCALED)
    never, always = np.zeros(6, dtype=bool), np.ones(6, dtype=bool)
    cold = along(sequence, chosen, warm=False, breaks=never).iterations
    assert along(sequence, chosen, warm=True, breaks=always).iterations == cold
    warm = along(sequence, chosen, warm=True, breaks=never).iterations
    assert warm[0] == cold[0]
    assert all(a < b for a, b in zip(warm[1:], cold[1:], strict=True))


def test_an_entry_says_how_many_ran_into_the_cap() -> None:
    spent = Spent(
        iterations=[1, 2, 9],
        claims=[Claim.SOLVED, Claim.INFEASIBLE, Claim.MAX_ITERATIONS],
        errors=[0.5],
        cap=9,
    )
    cell = spent.cell(part="x")
    assert (cell["count"], cell["capped"], cell["median"], cell["max"]) == (3, 1, 2.0, 9)
    assert triple(cell) == "2/8/>9"
    assert number(9, 9, capped=0) == "9"


def test_a_network_forgets_a_start_that_led_nowhere() -> None:
    name = "planar6-infeasible"
    recording = sequences([name])[name]
    sequence = recorded(name, recording)
    network = Network(*sequence.size, settings(SCALED))
    assert network.solve(sequence.packed[0]) is Claim.SOLVED
    cold = network.iterations
    assert network.solve(sequence.packed[30], warm=True) is Claim.INFEASIBLE
    assert network.solve(sequence.packed[0], warm=True) is Claim.SOLVED
    assert network.iterations == cold


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    """The object printed by a quick run, and the folder of its results."""
    out = tmp_path_factory.mktemp("study")
    done = _script("--quick", "--json", "--out", str(out))
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), out


def _script(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(SCRIPT), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=400, check=False)


def _cells(result: dict[str, Any], part: str, **wanted: Any) -> list[dict[str, Any]]:
    return [c for c in result["cells"] if c["part"] == part and all(c[k] == v for k, v in wanted.items())]


def _one(result: dict[str, Any], part: str, **wanted: Any) -> dict[str, Any]:
    (cell,) = _cells(result, part, **wanted)
    return cell


@pytest.mark.parametrize(("method", "start"), list(EXPECTED))
@pytest.mark.parametrize("objective", ["RMP", "DLSM"])
def test_iterations_on_the_square_are_those_of_the_spec(
    run: tuple[dict[str, Any], Path], method: str, start: str, objective: str
) -> None:
    cell = _one(run[0], "square", method=method, start=start, objective=objective)
    expected = EXPECTED[method, start][OBJECTIVES.index(objective)]
    assert isinstance(expected, tuple)
    assert cell["median"] == pytest.approx(expected[0], rel=WITHIN)
    assert cell["max"] == pytest.approx(expected[2], rel=WITHIN)
    assert cell["capped"] == 0


@pytest.mark.parametrize("objective", ["RMP", "DLSM"])
@pytest.mark.parametrize("start", ["cold", "warm"])
def test_e47_behaves_like_94lvi(run: tuple[dict[str, Any], Path], start: str, objective: str) -> None:
    a, b = (_one(run[0], "square", method=m, start=start, objective=objective) for m in ("e47", "94lvi"))
    assert a["median"] == pytest.approx(b["median"], rel=0.16)
    assert a["p95"] == pytest.approx(b["p95"], rel=0.31)


def test_a_warm_start_helps_every_method_on_a_path(run: tuple[dict[str, Any], Path]) -> None:
    for method in METHODS:
        cold, warm = (
            _one(run[0], "square", method=method, start=s, objective="DLSM") for s in ("cold", "warm")
        )
        assert warm["median"] <= cold["median"]
        assert warm["max"] <= cold["max"]


def test_scaling_pays_where_w_is_ill_conditioned(run: tuple[dict[str, Any], Path]) -> None:
    for condition in (1e3, 1e6):
        lvi, plain, ruled = (
            _one(run[0], "condition", method=m, at=condition)["right"][0]
            for m in ("94lvi", "implicit", SCALED)
        )
        assert 3 * ruled < plain < lvi
    mtn = [
        _one(run[0], "recorded", sequence="planar6-mtn", method=m, start="cold") for m in ("94lvi", SCALED)
    ]
    assert mtn[0]["capped"] == mtn[0]["count"]
    assert mtn[1]["capped"] == 0
    assert mtn[1]["max"] < 500


def test_the_rule_harms_94lvi(run: tuple[dict[str, Any], Path]) -> None:
    for sequence in ("panda-healthy", "planar6-infeasible"):
        with_rule, without = (
            _one(run[0], "recorded", sequence=sequence, method=m, start="cold")["median"]
            for m in ("94lvi + scaling", "94lvi")
        )
        assert with_rule > without


def test_a_tolerance_of_e_is_no_accuracy_of_x(run: tuple[dict[str, Any], Path]) -> None:
    plain, jumping = (
        _one(run[0], "tolerance", method=m, at=1e-4) for m in ("94lvi", "implicit + scaling + Newton")
    )
    assert plain["error"][0] > 10 * 1e-4
    assert jumping["error"][1] < 1e-10


def test_every_variant_is_right_about_infeasibility(run: tuple[dict[str, Any], Path]) -> None:
    found = _cells(run[0], "recorded")
    assert {cell["method"] for cell in found} >= set(METHODS)
    assert sum(cell["infeasible"] for cell in found) > 0
    for cell in found:
        assert cell["false_alarms"] == cell["called_solved"] == 0
        assert cell["found"] == cell["infeasible"]
        assert cell["solvable"] + cell["infeasible"] == cell["count"]


def test_results_are_written_as_json_and_markdown(run: tuple[dict[str, Any], Path]) -> None:
    result, out = run
    stem = "study_dtrnn-quick"
    assert json.loads((out / f"{stem}.json").read_text()).items() >= result.items()
    assert result["command"] == "python solvers/study_dtrnn.py --quick --json"
    assert {"cpu", "cores", "system"} <= set(result["machine"])
    assert {"ftqp", "numpy", "numba"} <= set(result["versions"])
    assert set(result["contenders"]) == set(METHODS)
    text = (out / f"{stem}.md").read_text()
    for section in (
        "## Iterations on the square",
        "## Certificates",
        "## Settings",
        "## Limitations",
        "## Versions",
    ):
        assert section in text


def test_parts_can_be_chosen_and_tables_fit_into_a_hundred_columns(tmp_path: Path) -> None:
    done = _script("--quick", "--parts", "square", "--out", str(tmp_path))
    assert done.returncode == 0, done.stderr
    assert max(len(line.rstrip()) for line in done.stdout.splitlines()) <= 100
    assert "Iterations on the square" in done.stdout and "Certificates" not in done.stdout


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--parts", "sqare"), "did you mean 'square'?"),
        (("--parts", "random", "--update-readme"), "--update-readme needs the part square"),
    ],
)
def test_a_wrong_part_is_one_sentence_and_exit_code_2(arguments: tuple[str, ...], sentence: str) -> None:
    done = _script("--quick", *arguments)
    assert done.returncode == 2
    assert sentence in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
