"""The rules that hold for every backend, shown on a solver whose answers are written beforehand."""

import numpy as np

from ftqp.qp import Backend, Claim, QPBuffers


class Scripted(Backend):
    """Answers with the claims it was given, and keeps how it was asked."""

    package = "ftqp"

    def __init__(self, *claims, x=1.0):
        super().__init__("scripted")
        self.claims, self.asked, self.value = list(claims), [], x

    def _prepare(self, qp):
        self.prepared = qp

    def _run(self, qp, cold):
        self.asked.append(cold)
        self.iterations = 3
        qp.x[:] = self.value
        return self.claims.pop(0)


def scripted(*claims, **options):
    solver = Scripted(*claims, **options)
    solver.setup(QPBuffers.zeros(2, 1, 1))
    return solver


def test_the_first_solve_is_cold_whatever_is_asked():
    solver = scripted(Claim.SOLVED, Claim.SOLVED, Claim.SOLVED)
    for cold in (False, False, True):
        assert solver.solve(cold=cold) is Claim.SOLVED
    assert solver.asked == [True, False, True]


def test_a_warm_failure_is_repeated_cold_once_and_counted():
    solver = scripted(Claim.SOLVED, Claim.MAX_ITERATIONS, Claim.SOLVED)
    solver.solve(cold=True)
    assert solver.solve(cold=False) is Claim.SOLVED
    assert solver.asked == [True, False, True]
    assert solver.iterations == 6


def test_an_answer_that_is_not_finite_is_failed():
    assert scripted(Claim.SOLVED, x=np.nan).solve(cold=True) is Claim.FAILED
    assert scripted(Claim.MAX_ITERATIONS, x=np.inf).solve(cold=True) is Claim.FAILED


def test_bad_data_never_reach_the_solver_and_make_the_next_solve_cold():
    solver = scripted(Claim.SOLVED, Claim.SOLVED)
    solver.solve(cold=True)
    qp = solver.prepared
    for part, value, claim in (
        ("g", np.nan, Claim.FAILED),
        ("l", np.nan, Claim.FAILED),
        ("lb", 9.0, Claim.INFEASIBLE),
    ):
        qp.ub[:] = 1.0
        before = getattr(qp, part).copy()
        getattr(qp, part)[0] = value
        assert solver.solve(cold=False) is claim
        getattr(qp, part)[:] = before
    solver.solve(cold=False)
    assert solver.asked == [True, True]


def test_flat_is_the_problem_in_the_documented_order():
    n, m, p = 4, 2, 3
    qp = QPBuffers.zeros(n, m, p)
    qp.flat[:] = np.arange(len(qp.flat))
    order = [qp.H, qp.g, qp.A, qp.C, qp.lb, qp.b, qp.l, qp.ub, qp.upper[n : n + m], qp.u]
    np.testing.assert_array_equal(np.concatenate([part.ravel() for part in order]), qp.flat)
    qp.solution[:] = np.arange(len(qp.solution))
    np.testing.assert_array_equal(np.concatenate([qp.x, qp.z_box, qp.y, qp.z]), qp.solution)
