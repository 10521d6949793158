"""The study of the network counts what it says, and what is known of the methods shows in its figures."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from comparison.dtrnn_study import (
    METHODS,
    SCALED,
    Network,
    along,
    each,
    settings,
)
from comparison.dtrnn_study_problems import expanded, random_qp, rule, scaled
from comparison.dtrnn_study_report import EXPECTED, OBJECTIVES
from comparison.recorded import recorded
from comparison.sequences import sequences
from tests.scripts import ran

from ftqp.qp import QP, Claim, solve

SCRIPT = "solvers/study_dtrnn.py"
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


@pytest.mark.parametrize(
    "name", ["panda-torque", "planar6-locked", "xarm7-iiwt", "planar6-mtn", "panda-fault-ramp"]
)
def test_the_sweeps_rule_is_the_kernels(name: str) -> None:
    recording = sequences([name])[name]
    problem, x = recording.problem(20), recording.x[20]
    by_kernel = each([(problem, x)], settings(SCALED, max_iterations=3000))
    network = expanded(problem)
    by_hand = scaled(network, *rule(network))
    chosen = settings("implicit", gamma=settings(SCALED).step_size, max_iterations=3000)
    assert each([(by_hand, np.zeros(network.n))], chosen).iterations == by_kernel.iterations


def test_an_expanded_qp_has_the_same_solution() -> None:
    recording = sequences(["panda-torque"])["panda-torque"]
    problem = recording.problem(30)
    x = solve(expanded(problem), "daqp").x
    free = problem.lb < problem.ub
    assert x[: np.count_nonzero(free)] == pytest.approx(recording.x[30][free], abs=1e-7)


def test_a_warm_run_needs_fewer_iterations_and_a_break_makes_it_cold() -> None:
    recording = sequences(["planar6-healthy"])["planar6-healthy"].part(0, 6)
    sequence, chosen = recorded("x", recording), settings(SCALED)
    never, always = np.zeros(6, dtype=bool), np.ones(6, dtype=bool)
    cold = along(sequence, chosen, warm=False, breaks=never).iterations
    assert along(sequence, chosen, warm=True, breaks=always).iterations == cold
    warm = along(sequence, chosen, warm=True, breaks=never).iterations
    assert warm[0] == cold[0]
    assert all(a < b for a, b in zip(warm[1:], cold[1:], strict=True))


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
    done = ran(SCRIPT, "--quick", "--json", "--out", str(out))
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), out


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


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--parts", "sqare"), "did you mean 'square'?"),
        (("--parts", "sweep", "--update-readme"), "--update-readme needs the part square"),
    ],
)
def test_a_wrong_part_is_one_sentence_and_exit_code_2(arguments: tuple[str, ...], sentence: str) -> None:
    done = ran(SCRIPT, "--quick", *arguments)
    assert done.returncode == 2
    assert sentence in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
