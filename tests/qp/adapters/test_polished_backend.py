"""Which attempts a solver that is polished makes, and in which units it is asked."""

import numpy as np
import pytest
from planted import buffers, compliant, fill, planted

from ftqp.qp import QP, Claim, QPBuffers, backend, solve
from ftqp.qp.adapters.polished_backend import LARGE, EasedQP, compliance, polished
from ftqp.qp.problem import SolveStatus


@pytest.mark.parametrize("name", ["osqp", "proxqp"])
def test_a_task_given_up_is_solved_exactly_where_its_solver_alone_gives_up(name):
    problem = compliant(5, 1e-10, 30.0)
    alone = solve(problem, {"name": name, "polish": False})
    helped, exact = solve(problem, name), solve(problem, "active_set")
    assert np.abs(exact.y).max() > LARGE
    assert alone.status is not SolveStatus.SOLVED and helped.status is SolveStatus.SOLVED
    np.testing.assert_allclose(helped.x, exact.x, rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("name", ["osqp", "proxqp"])
def test_a_loop_through_a_task_given_up_and_taken_up_again_is_solved_at_every_step(name):
    solver, exact = backend(name), backend("active_set")
    qp, same = (QPBuffers.zeros(10, 3, 0) for _ in range(2))
    solver.setup(qp)
    exact.setup(same)
    for far in np.concatenate([np.linspace(0.0, 40.0, 25), np.linspace(40.0, 0.0, 25)]):
        for held in (qp, same):
            fill(held, compliant(7, 1e-9, far))
        assert exact.solve(cold=False) is Claim.SOLVED
        assert solver.solve(cold=False) is Claim.SOLVED, far
        np.testing.assert_allclose(qp.x[:7], same.x[:7], rtol=0, atol=1e-6)


def test_other_units_pose_the_same_qp():
    qp = buffers(compliant(3, 1e-5, 20.0))
    eased = EasedQP(10, 3, 0)
    qp.upper[10:13] = qp.b
    eased.pose(qp, compliance(qp))
    exact = backend("active_set")
    exact.setup(eased.buffers)
    assert exact.solve(cold=True) is Claim.SOLVED
    eased.answer(qp)
    answer = qp.solution.copy()
    exact.setup(qp)
    exact.solve(cold=True)
    np.testing.assert_allclose(answer, qp.solution, rtol=1e-8, atol=1e-8)
    assert np.abs(eased.buffers.y).max() < 1e3 < np.abs(qp.y).max()
    np.testing.assert_allclose(eased.soft, compliance(eased.buffers))


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
