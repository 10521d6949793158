"""One scenario under every backend: who agrees is judged soundly; no time is judged here."""

import json
from pathlib import Path
from typing import Any

import pytest
from bench.contenders import REFERENCE, Contender, contenders
from comparison import closed_loop
from comparison.closed_loop import Case, measured
from tests.scripts import ran, told

SCRIPT = "solvers/compare_closed_loop.py"
SHORT = ("path.duration=2.0", "faults.0.at=1.5", "path.side=0.005")
FACTS = {
    "stopped_at": None,
    "max_position_error": 1e-6,
    "max_limit_violation": {"q": 0.0, "v": 0.0, "a": 0.0, "tau": 0.0},
}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    """The object printed by a quick run, and the folder of its results."""
    out = tmp_path_factory.mktemp("results")
    return json.loads(told(SCRIPT, "--quick", "--json", "--out", out)), out


def test_every_case_has_a_row_for_every_backend(run: tuple[dict[str, Any], Path]) -> None:
    result, _ = run
    titles = ["planar6-square, scheme dlsm", "planar6-square, scheme mtn", "panda-circle, scheme mvn"]
    assert [case["title"] for case in result["cases"]] == titles
    for title in titles:
        names = {cell["contender"] for cell in result["cells"] if cell["case"] == title}
        assert {"active_set", "dtrnn", "daqp", "osqp", "proxqp"} <= names


def test_backends_agree_in_the_cases_that_are_not_chaotic(run: tuple[dict[str, Any], Path]) -> None:
    result, _ = run
    calm = {case["title"] for case in result["cases"] if not case["chaotic"]}
    assert "panda-circle, scheme mvn" in calm
    for cell in result["cells"]:
        if cell["case"] in calm:
            assert cell["joint_difference"] <= 1e-6, cell
            assert cell["disagreement"] == ""


def test_the_reference_repeats_itself_bit_by_bit(run: tuple[dict[str, Any], Path]) -> None:
    result, _ = run
    own = [cell for cell in result["cells"] if cell["contender"] == REFERENCE]
    assert [cell["joint_difference"] for cell in own] == [0.0] * 3
    assert [cell["ratio"] for cell in own] == [1.0] * 3


def test_a_nudge_of_the_start_shows_chaos(tmp_path: Path) -> None:
    (reference,) = contenders([REFERENCE])
    _, calm, _ = measured(Case(scenario="planar6-square", quick=SHORT), [reference], tmp_path, quick=True)
    assert 1e-9 <= calm["difference_after_nudge"] < 1e-7
    assert calm["chaotic"] is False
    wild = Case(scenario="planar6-square", scheme="mtn", quick=("path.duration=8.0", "faults.0.at=6.0"))
    _, about, _ = measured(wild, [reference], tmp_path, quick=True)
    assert about["chaotic"] is True


def test_a_backend_that_cannot_run_the_case_is_left_out_with_its_reason(tmp_path: Path) -> None:
    wrong = Contender(name="wrong", settings={"name": "osqp", "tolerance": -1.0})
    rows, _, declined = measured(
        Case(scenario="planar6-square", quick=SHORT), [*contenders([REFERENCE]), wrong], tmp_path, quick=True
    )
    assert [row["contender"] for row in rows] == [REFERENCE]
    assert "tolerance" in declined["wrong"]


@pytest.mark.parametrize(
    ("changes", "difference", "chaotic", "words"),
    [
        ({}, 1e-7, False, ""),
        ({}, 1e-5, False, "joints"),
        ({}, 1e-1, True, ""),
        ({"max_position_error": 1.9e-6}, 1e-1, True, ""),
        ({"max_position_error": 2.1e-6}, 1e-1, True, "task error"),
        ({"stopped_at": 3.0}, 0.0, False, "stops"),
        ({"max_limit_violation": {"q": 0.0, "v": 0.0, "a": 0.1, "tau": 0.0}}, 0.0, True, "limit of a"),
    ],
)
def test_runs_are_judged_by_joints_or_where_chaotic_by_invariants(
    changes: dict[str, Any], difference: float, chaotic: bool, words: str
) -> None:
    found = closed_loop._disagreement(FACTS | changes, FACTS, difference, chaotic=chaotic)
    assert words in found
    assert bool(found) == bool(words)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--backends", "dacqp"), "did you mean 'daqp'?"),
        (("nothing.toml",), "neither a file nor a bundled scenario"),
        (("planar6-square", "--schemes", "mvnn"), "did you mean 'mvn'?"),
    ],
)
def test_bad_input_is_a_sentence_and_exits_2(arguments: tuple[str, ...], words: str, tmp_path: Path) -> None:
    done = ran(SCRIPT, *arguments, "--quick", "--out", str(tmp_path))
    assert done.returncode == 2
    assert words in " ".join(done.stderr.split())
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []
