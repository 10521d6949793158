"""Polishing makes a rough answer exact when it has the active bounds, and leaves it alone otherwise."""

import numpy as np
import pytest
from planted import buffers, compliant, planted

from ftqp.qp import QP, backend
from ftqp.qp.adapters.polish import polished
from ftqp.qp.adapters.polished_backend import compliance


def ready(problem):
    """Buffers as a backend leaves them to a solver, the right side copied into the upper bounds."""
    qp = buffers(problem)
    qp.upper[qp.n : qp.n + qp.m] = qp.b
    return qp


@pytest.mark.parametrize("kind", ["identity", "diagonal", "dense"])
@pytest.mark.parametrize(("n", "m", "p"), [(1, 0, 0), (7, 6, 0), (7, 2, 7), (36, 6, 30)])
def test_a_rough_answer_with_the_right_active_bounds_becomes_exact(kind, n, m, p):
    rng = np.random.default_rng(n + m + p)
    for _ in range(5):
        case = planted(rng, n, m, p, kind=kind)
        qp = ready(case.problem)
        qp.x[:] = case.x + 1e-4 * rng.normal(size=n)
        for part in ("y", "z", "z_box"):
            value = getattr(case, part)
            getattr(qp, part)[:] = value * (1.0 + 1e-3 * rng.normal(size=len(value)))
        assert polished(qp, None)
        np.testing.assert_allclose(qp.x, case.x, rtol=0, atol=1e-9)
        np.testing.assert_allclose(qp.z_box, case.z_box, rtol=0, atol=1e-7)


def test_what_is_not_polished_is_left_alone():
    case = planted(np.random.default_rng(2), 20, 4, 20, unbounded=0.0)
    qp = ready(case.problem)
    qp.x[:], qp.multipliers[:] = 0.3, np.random.default_rng(0).normal(size=len(qp.multipliers)) * 1e3
    before = qp.solution.copy()
    assert not polished(qp, None)
    np.testing.assert_array_equal(qp.solution, before)


def test_rows_that_depend_on_each_other_can_be_polished():
    problem = QP(np.eye(2), [1.0, 0.0], [[1.0, 1.0], [2.0, 2.0]], [1.0, 2.0], lb=[-5.0] * 2, ub=[5.0] * 2)
    qp = ready(problem)
    qp.solution[:] = 0.0
    assert polished(qp, None)
    np.testing.assert_allclose(qp.x, [0.0, 1.0], atol=1e-9)


def test_a_contradiction_is_never_polished_into_an_answer():
    qp = ready(QP(np.eye(2), [0.0, 0.0], [[1.0, 1.0]], [9.0], lb=[-1.0] * 2, ub=[1.0] * 2))
    for seed in range(20):
        qp.solution[:] = np.random.default_rng(seed).normal(size=len(qp.solution)) * 10.0
        assert not polished(qp, None)


@pytest.mark.parametrize("unit", [1.0, 1e-6, 1e-12])
def test_signs_of_multipliers_are_seen_in_whatever_unit_the_objective_is(unit):
    """Two bounds that are guessed to be active are to be left, and multipliers may all be tiny."""
    H, g = unit * np.diag([1.0, 0.5, 3.0]), -unit * np.array([1.0, 0.5, 1.0])
    qp = ready(QP(H, g, lb=[-5.0] * 3, ub=[5.0] * 3))
    qp.x[:], qp.z_box[:2] = [-5.0, -5.0, 0.3], -unit
    assert polished(qp, None)
    np.testing.assert_allclose(qp.x, [1.0, 1.0, 1.0 / 3.0], atol=1e-9)


@pytest.mark.parametrize("unreachable", [0.0, 30.0])
def test_eliminating_slacks_gives_the_same_answer(unreachable):
    qp, same = ready(compliant(4, 1e-4, unreachable)), ready(compliant(4, 1e-4, unreachable))
    exact = backend("active_set")
    exact.setup(same)
    exact.solve(cold=True)
    qp.solution[:] = same.solution * (1.0 + 1e-6)
    assert polished(qp, compliance(qp))
    np.testing.assert_allclose(qp.x, same.x, rtol=0, atol=1e-9 * (1.0 + np.abs(same.x).max()))
    np.testing.assert_allclose(qp.y, same.y, rtol=1e-7, atol=1e-9)
