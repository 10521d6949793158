"""What is true of a QP is proven, whatever anybody claims."""

import numpy as np
import pytest
from comparison.truth import Fact, proves, relative_residuals, truth
from tests.solvers.stand_ins import INFEASIBLE, SOLUTION, SOLVABLE

from ftqp.qp import QP, Certificate
from ftqp.qp.solving import infeasibility

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
