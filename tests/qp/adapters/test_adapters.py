"""Every backend against planted solutions, in a loop of changing data, and on data that no QP should have."""

from time import process_time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.qp.planted import buffers, fill, infeasible, planted
from tests.qp.solvers import ADAPTED, NATIVE, QUADPROG, tolerance

from ftqp.qp import Claim, backend
from ftqp.qp.solving import accepted, residuals

EVERY = NATIVE + ADAPTED


def solved(name, qp):
    """A backend that has solved a first problem."""
    solver = backend(name)
    solver.setup(qp)
    assert solver.solve(cold=True) is Claim.SOLVED
    return solver


def judged(problem, qp):
    return accepted(problem, residuals(problem, qp.x, qp.y, qp.z, qp.z_box), qp.x, qp.y)


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("kind", ["identity", "diagonal", "dense"])
@pytest.mark.parametrize(("n", "m", "p"), [(1, 0, 0), (7, 6, 0), (7, 2, 7), (13, 6, 7), (36, 6, 30)])
def test_backend_finds_the_planted_solution_and_its_multipliers(name, kind, n, m, p):
    rng = np.random.default_rng(n + 100 * m + p)
    solver = backend(name)
    for _ in range(8):
        case = planted(rng, n, m, p, kind=kind)
        qp = buffers(case.problem)
        solver.setup(qp)
        assert solver.solve(cold=True) is Claim.SOLVED
        np.testing.assert_allclose(qp.x, case.x, rtol=0, atol=tolerance(name))
        scale = np.linalg.cond(case.problem.H) * tolerance(name) * 10
        for part in ("y", "z", "z_box"):
            np.testing.assert_allclose(getattr(qp, part), getattr(case, part), rtol=0, atol=scale)
        assert judged(case.problem, qp)


@pytest.mark.parametrize("name", ["active_set", "daqp", QUADPROG])
def test_ill_conditioned_hessian_is_solved_to_its_residuals(name):
    rng = np.random.default_rng(3)
    for _ in range(20):
        case = planted(rng, 7, 3, 7, kind="mtn")
        qp = buffers(case.problem)
        solved(name, qp)
        assert judged(case.problem, qp)
        error = qp.x - case.x
        assert error @ case.problem.H @ error <= 1e-12


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(1, 20),
    m=st.integers(0, 6),
    p=st.integers(0, 12),
    kind=st.sampled_from(["identity", "diagonal", "dense"]),
)
@pytest.mark.parametrize("name", ["active_set", "daqp"])
def test_exact_backends_agree_on_any_size(name, seed, n, m, p, kind):
    case = planted(np.random.default_rng(seed), n, min(m, n), p, kind=kind, fixed=max(0, (n - m) // 4))
    qp = buffers(case.problem)
    solved(name, qp)
    np.testing.assert_allclose(qp.x, case.x, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", EVERY)
def test_a_bound_turns_into_an_equality_and_back_without_a_new_setup(name):
    rng = np.random.default_rng(11)
    healthy = planted(rng, 7, 3, 4, kind="dense", unbounded=0.5)
    qp = buffers(healthy.problem)
    solver = solved(name, qp)
    for joint in (0, 3, 6):
        for value in (0.0, 0.1, -0.05):
            qp.lb[joint] = qp.ub[joint] = healthy.x[joint] + value
            cold = joint == 3
            assert solver.solve(cold=cold) is Claim.SOLVED
            assert abs(qp.x[joint] - qp.lb[joint]) <= tolerance(name)
            assert judged(qp, qp)
            fill(qp, healthy.problem)
            assert solver.solve(cold=False) is Claim.SOLVED
            np.testing.assert_allclose(qp.x, healthy.x, rtol=0, atol=tolerance(name))


@pytest.mark.parametrize("name", NATIVE)
@pytest.mark.parametrize("kind", ["identity", "dense"])
def test_warm_equals_cold_along_a_path(name, kind):
    rng = np.random.default_rng(5)
    case = planted(rng, 13, 6, 7, kind=kind)
    qp, fresh = buffers(case.problem), buffers(case.problem)
    warm, cold = backend(name), backend(name)
    warm.setup(qp)
    cold.setup(fresh)
    rate = rng.normal(size=qp.rows.shape)
    for k in range(60):
        for one in (qp, fresh):
            one.g[:] = case.problem.g + np.sin(0.05 * k)
            one.rows[:] = np.vstack([case.problem.A, case.problem.C]) + 0.002 * k * rate
            one.b[:] = one.A @ (0.9 * case.x)
        assert warm.solve(cold=False) is cold.solve(cold=True)
        np.testing.assert_allclose(qp.x, fresh.x, rtol=0, atol=2 * tolerance(name))


@pytest.mark.parametrize("name", NATIVE)
def test_a_changed_hessian_is_noticed_when_warm(name):
    rng = np.random.default_rng(9)
    first, second = planted(rng, 7, 2, 3, kind="identity"), planted(rng, 7, 2, 3, kind="dense")
    qp = buffers(first.problem)
    solver = backend(name)
    solver.setup(qp)
    for case in (first, second, first):
        fill(qp, case.problem)
        assert solver.solve(cold=False) is Claim.SOLVED
        np.testing.assert_allclose(qp.x, case.x, rtol=0, atol=tolerance(name))


@pytest.mark.parametrize("name", EVERY)
def test_an_infeasible_qp_is_refused_soon_and_the_next_one_is_solved(name):
    rng = np.random.default_rng(2)
    for k in range(5):
        case = planted(rng, 7, 3, 4)
        qp = buffers(case.problem)
        solver = solved(name, qp)
        fill(qp, infeasible(rng, 7, 3, 4))
        for cold in (False, True, False):
            began = process_time()  # a machine that is busy elsewhere is no fault of the solver
            claim = solver.solve(cold=cold)
            assert claim is not Claim.SOLVED
            assert process_time() - began < 2.0
            if name in ("daqp", "dtrnn") or (name in ("active_set", "quadprog") and k == 0):
                assert claim is Claim.INFEASIBLE
        fill(qp, case.problem)
        assert solver.solve(cold=False) is Claim.SOLVED
        np.testing.assert_allclose(qp.x, case.x, rtol=0, atol=tolerance(name))


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("part", ["H", "g", "A", "b", "C"])
def test_data_that_are_no_numbers_are_failed_and_leave_no_trace(name, bad, part):
    case = planted(np.random.default_rng(4), 7, 3, 4)
    qp = buffers(case.problem)
    solver = solved(name, qp)
    getattr(qp, part).reshape(-1)[1] = bad
    for cold in (False, True):
        assert solver.solve(cold=cold) in (Claim.FAILED, Claim.INFEASIBLE)
    fill(qp, case.problem)
    assert solver.solve(cold=False) is Claim.SOLVED
    np.testing.assert_allclose(qp.x, case.x, rtol=0, atol=tolerance(name))


@pytest.mark.parametrize("name", EVERY)
def test_solvers_write_nothing_to_the_terminal(name, capfd):
    rng = np.random.default_rng(1)
    for problem in (planted(rng).problem, infeasible(rng), planted(rng, 3, 0, 0, unbounded=1.0).problem):
        solver = backend(name)
        solver.setup(buffers(problem))
        solver.solve(cold=True)
        solver.solve(cold=False)
    assert capfd.readouterr() == ("", "")
