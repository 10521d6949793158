"""The recorded sequences hold what their table says, and are what the planner makes today."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from comparison.making import feasible as has_a_point
from comparison.recipes import RECIPES
from comparison.sequences import FOLDER, feasible, names, sequences

from ftqp.qp import QP, Recording, residuals
from ftqp.qp.answer_check import infeasibility, scales


@pytest.fixture(scope="module")
def everything() -> dict[str, Recording]:
    return sequences()


def test_every_recipe_has_a_file_and_a_line_in_the_table() -> None:
    lines = (FOLDER / "README.md").read_text(encoding="utf-8").splitlines()
    rows = [line.split("|")[1].strip(" `") for line in lines if line.startswith("| `")]
    listed = [row for row in rows if "-" in row]
    assert listed == [recipe.name for recipe in RECIPES]
    assert sorted(listed) == list(names())


def test_reference_answers_solve_their_qps(everything: dict[str, Recording]) -> None:
    for name, recording in everything.items():
        for k, problem in enumerate(recording):
            if not feasible(recording)[k]:
                assert np.isnan(recording.x[k]).all(), name
                continue
            x, y, z, z_box = (part[k] for part in (recording.x, recording.y, recording.z, recording.z_box))
            found = residuals(problem, x, y, z, z_box)
            values = np.array([found.primal, found.dual, found.complementarity, found.gap])
            assert (values <= 1e-10 * scales(problem, x, y)).all(), (name, k)


def test_infeasible_qps_are_proven_to_be(everything: dict[str, Recording]) -> None:
    count = 0
    for name, recording in everything.items():
        for k in np.flatnonzero(~feasible(recording)):
            assert infeasibility(recording.problem(int(k))) is not None, (name, k)
            count += 1
    assert count > 80


def test_the_linear_program_tells_feasible_from_infeasible() -> None:
    H, g = np.eye(2), np.zeros(2)
    assert has_a_point(QP(H, g)) is True
    assert has_a_point(QP(H, g, A=[[1.0, 1.0]], b=[2.0], ub=[1.0, 1.0])) is True
    assert has_a_point(QP(H, g, A=[[1.0, 1.0]], b=[2.1], ub=[1.0, 1.0])) is False
    assert has_a_point(QP(H, g, C=[[1.0, 1.0]], l=[2.1], ub=[1.0, 1.0])) is False
    assert has_a_point(QP(H, g, A=[[1.0, 1.0]], b=[2.0 + 1e-7], ub=[1.0, 1.0])) is None


def test_script_makes_the_recorded_sequences_again(tmp_path: Path) -> None:
    chosen = ["planar6-infeasible", "puma560-near-singular"]
    script = [sys.executable, str(FOLDER / "record.py"), "--quick", "--out", str(tmp_path), "--only", *chosen]
    done = subprocess.run(script, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    for name, again in sequences(chosen, folder=tmp_path).items():
        stored = sequences([name])[name].part(0, len(again))
        assert again.variables == stored.variables
        for part in ("H", "g", "A", "b", "lb", "ub"):
            np.testing.assert_allclose(getattr(again, part), getattr(stored, part), rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(again.x, stored.x, rtol=1e-5, atol=1e-7)
