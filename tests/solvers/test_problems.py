"""Recorded QPs, what is true of each, and the settings with which solvers answer them."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from bench.contenders import PROFILES
from comparison.sequences import FOLDER, feasible, sequences
from comparison.truth import Fact, proves, relative_residuals, truth
from tests.solvers.stand_ins import INFEASIBLE, SOLUTION, SOLVABLE, sequence

from ftqp.core.errors import MissingPackage
from ftqp.qp import QP, Certificate, Recording, backend, residuals
from ftqp.qp.solving import infeasibility, scales


@pytest.fixture(scope="module")
def everything() -> dict[str, Recording]:
    return sequences()


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


@pytest.mark.slow
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


FILES = sorted(PROFILES.glob("*.toml"))
PAPER = 1e-4
"""What the paper's stopping rule of 1e-5 leaves of a residual."""


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_profile_solves_a_qp_with_active_bounds_cold_and_warm(file: Path) -> None:
    try:
        solver = backend(file)
    except MissingPackage as error:
        pytest.skip(f'needs pip install -e ".[solvers]": {error}')
    qp = sequence(SOLVABLE).buffers()
    solver.setup(qp)
    for cold in (True, False):
        qp.g[:] = [-3.0, 3.0 - 0.1 * cold]
        solver.solve(cold=cold)
        found = residuals(qp, qp.x, qp.y, qp.z, qp.z_box)
        values = np.array([found.primal, found.dual, found.complementarity, found.gap])
        relative = (values / scales(qp, qp.x, qp.y)).max()
        assert relative <= (PAPER if "paper" in file.stem else 1e-6)


NONE = np.zeros(0)
ANSWER = (SOLUTION, NONE, NONE, 2.0 * SOLUTION)
NO_ANSWER = (np.full(2, np.nan), np.full(1, np.nan), NONE, np.full(2, np.nan))


def test_a_solution_with_small_residuals_proves_a_qp_solvable() -> None:
    found = truth([SOLVABLE], [ANSWER])
    assert found.facts == [Fact.SOLVABLE]
    np.testing.assert_array_equal(found.references[0], SOLUTION)
    assert found.worst_reference == 0.0


def test_a_solution_that_is_only_just_accepted_is_no_reference() -> None:
    rough = (SOLUTION, NONE, NONE, 2.0 * SOLUTION + 1e-7)
    found = truth([SOLVABLE], [rough])
    assert found.facts == [Fact.SOLVABLE]
    assert np.isnan(found.references).all()


def test_a_certificate_proves_a_qp_infeasible_whatever_the_recording_says() -> None:
    found = truth([INFEASIBLE], [NO_ANSWER], np.array([True]))
    assert found.facts == [Fact.INFEASIBLE]
    assert found.violations[0] == pytest.approx(7.0 / 1.0, rel=1e-6)
    assert found.disputed == 1


def test_without_a_proof_the_recording_decides_and_without_it_the_question_is_open() -> None:
    wrong = (np.zeros(2), NONE, NONE, np.zeros(2))
    assert truth([SOLVABLE], [wrong]).facts == [Fact.OPEN]
    assert truth([SOLVABLE], [wrong], np.array([True])).facts == [Fact.SOLVABLE]


def test_a_certificate_is_checked_by_its_arithmetic() -> None:
    good = infeasibility(INFEASIBLE)
    assert good is not None
    assert proves(INFEASIBLE, good)
    for y, z_box in ((-good.y, -good.z_box), (good.y, 0.0 * good.z_box), (0.0 * good.y, 0.0 * good.z_box)):
        assert not proves(INFEASIBLE, Certificate(y=y, z=NONE, z_box=z_box, violation=1.0))


def test_a_multiplier_at_an_infinite_bound_proves_nothing() -> None:
    good = infeasibility(INFEASIBLE)
    assert good is not None
    unbounded = QP(np.eye(2), [-3.0, 3.0], A=[[1.0, 1.0]], b=[9.0])
    assert not proves(unbounded, good)


def test_residuals_are_relative_to_the_size_of_the_terms() -> None:
    found = relative_residuals(SOLVABLE, SOLUTION + np.array([0.0, 0.5]), NONE, NONE, 2.0 * SOLUTION)
    # primal 0 of 1 + 1, dual 0.5 of 1 + 3, complementarity min(2, 0.5) of 1 + 1
    np.testing.assert_allclose(found[:3], [0.0, 0.125, 0.25])
    assert np.isinf(relative_residuals(SOLVABLE, np.full(2, np.nan), NONE, NONE, SOLUTION)).all()
