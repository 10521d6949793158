"""Which attempts a solver that is polished makes, and in which units it is asked."""

import numpy as np
import pytest
from planted import buffers, compliant, fill

from ftqp.core.errors import InputError
from ftqp.qp import Claim, QPBuffers, backend, solve
from ftqp.qp.adapters import polished_backend
from ftqp.qp.adapters.polished_backend import LARGE, PolishedBackend
from ftqp.qp.problem import SolveStatus


class Rough(PolishedBackend):
    """Answers nothing useful, and keeps how it was asked."""

    package = "none"

    def __init__(self, claims, **options):
        super().__init__("rough", first_cap=10, cap=50, **{"polish": True} | options)
        self.claims, self.asked = list(claims), []

    def _set_up(self, qp):
        self.own = qp

    def _answer(self, qp, cold, cap):
        self.asked.append(("own" if qp is self.own else "eased", cold, cap))
        self.iterations = cap
        qp.solution[:] = np.random.default_rng(len(self.asked)).normal(size=len(qp.solution)) * 1e3
        return self.claims.pop(0)


def rough(claims, unreachable=30.0, **options):
    solver = Rough(claims, **options)
    solver.setup(buffers(compliant(1, 1e-8, unreachable)))
    return solver


def test_what_the_solver_calls_solved_is_taken_as_it_is():
    solver = rough([Claim.SOLVED])
    assert solver.solve(cold=True) is Claim.SOLVED and solver.asked == [("own", True, 10)]


@pytest.fixture
def in_vain(monkeypatch):
    """Polishing never succeeds."""
    monkeypatch.setattr(polished_backend, "polished", lambda qp, soft: False)


def test_a_cold_solve_tries_both_units_and_then_what_is_left(in_vain):
    solver = rough([Claim.MAX_ITERATIONS] * 3)
    assert solver.solve(cold=True) is Claim.MAX_ITERATIONS
    assert solver.asked == [("own", True, 10), ("eased", True, 10), ("eased", True, 30)]
    assert solver.iterations == 50


def test_a_warm_solve_in_vain_is_repeated_in_the_other_units_first(in_vain):
    solver = rough([Claim.SOLVED] + [Claim.MAX_ITERATIONS] * 4)
    solver.solve(cold=True)
    assert solver.solve(cold=False) is Claim.MAX_ITERATIONS
    assert solver.asked[1:] == [
        ("own", False, 10),
        ("eased", True, 10),
        ("own", True, 10),
        ("eased", True, 20),
    ]


def test_infeasible_in_both_units_is_believed_and_the_outputs_are_left_alone():
    solver = rough([Claim.INFEASIBLE, Claim.INFEASIBLE])
    solver.own.solution[:] = 0.5
    assert solver.solve(cold=True) is Claim.INFEASIBLE
    assert len(solver.asked) == 2 and (solver.own.solution == 0.5).all()


def test_without_polish_the_solver_is_asked_once_for_all_its_iterations():
    solver = rough([Claim.MAX_ITERATIONS], polish=False)
    assert solver.solve(cold=True) is Claim.MAX_ITERATIONS and solver.asked == [("own", True, 50)]


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


def test_polish_of_qpsolvers_is_true_or_false():
    with pytest.raises(InputError, match="polish is 3, expected true or false"):
        backend({"name": "qpsolvers:daqp", "polish": 3})
    assert backend({"name": "qpsolvers:daqp", "polish": False})._polishes is False
