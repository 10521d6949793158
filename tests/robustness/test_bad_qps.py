"""QPs that break solvers: each must end soon, in a status that the residuals bear out, without a warning."""

from importlib.util import find_spec
from time import process_time

import numpy as np
import pytest

from ftqp.qp import QP, SolveStatus, solve

BACKENDS = ["active_set", "dtrnn", "daqp", "osqp", "proxqp", "qpsolvers:daqp"]
if find_spec("quadprog") is not None:
    BACKENDS.append("quadprog")

RNG = np.random.default_rng(0)
M = RNG.normal(size=(6, 6))
ROWS = RNG.normal(size=(2, 6))

SOLVABLE = {
    "one variable": QP([[1.0]], [1.0]),
    "one fixed variable": QP([[1.0]], [1.0], lb=[0.0], ub=[0.0]),
    "everything fixed": QP(np.eye(3), [1.0, 2.0, 3.0], lb=[0.5] * 3, ub=[0.5] * 3),
    "empty A": QP(np.eye(2), [1.0, 1.0], A=np.zeros((0, 2)), b=[]),
    "empty A as a list": QP(np.eye(2), [1.0, 1.0], A=[], b=[]),
    "zero row in C": QP(np.eye(2), [1.0, 1.0], C=[[0.0, 0.0], [1.0, 1.0]], l=[-1.0, 0.0], u=[1.0, np.inf]),
    "row without bounds": QP(np.eye(2), [1.0, 1.0], C=[[1.0, 2.0]], l=[-np.inf], u=[np.inf]),
    "same bound three times": QP(
        np.eye(2), [-3.0, 0.0], C=[[1.0, 0.0], [2.0, 0.0]], u=[1.0, 2.0], ub=[1.0, 9.0]
    ),
    "zero gradient": QP(np.eye(3), np.zeros(3), lb=[-1.0] * 3),
    "at a vertex": QP(np.eye(3), [-9.0] * 3, ub=[1.0] * 3, lb=[0.0] * 3),
    "bounds a hair apart": QP(np.eye(2), [-1.0, 1.0], lb=[0.1, 0.1], ub=[0.1 + 1e-12, 0.1 + 1e-12]),
    "huge bounds": QP(np.eye(2), [-1.0, 1.0], lb=[-1e15, -1e15], ub=[1e15, 1e15]),
    "badly scaled rows": QP(np.eye(2), [1.0, 1.0], A=[[1e5, 1e5]], b=[1e5]),
    "square A": QP(np.eye(6), np.ones(6), M, M @ np.ones(6)),
    "condition 1e8": QP(
        np.diag(np.logspace(0, -8, 6)),
        np.logspace(0, -8, 6),
        ROWS,
        ROWS @ np.ones(6),
        lb=[-2.0] * 6,
        ub=[2.0] * 6,
    ),
}
SOLVABLE_BUT_HARD = {
    "dependent consistent equalities": QP(np.eye(2), [1.0, 0.0], A=[[1.0, 1.0], [2.0, 2.0]], b=[1.0, 2.0]),
    "zero row in A": QP(np.eye(2), [1.0, 0.0], A=[[0.0, 0.0], [1.0, 1.0]], b=[0.0, 1.0]),
    "more equalities than variables": QP(
        np.eye(2), [1.0, 0.0], A=[[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]], b=[1.0, 1.0, 2.0]
    ),
    "equality repeated by a row": QP(np.eye(2), [1.0, 0.0], [[1.0, 1.0]], [1.0], [[1.0, 1.0]], [1.0], [1.0]),
    "zero Hessian": QP(np.zeros((2, 2)), [1.0, -1.0], lb=[-1.0, -1.0], ub=[1.0, 1.0]),
    "huge scale": QP(1e12 * np.eye(2), [1e12, -1e12], ub=[0.5, 0.5], lb=[-0.5, -0.5]),
    "tiny scale": QP(1e-12 * np.eye(2), [1e-12, -1e-12], ub=[0.5, 0.5], lb=[-0.5, -0.5]),
    "overflowing scale": QP(1e200 * np.eye(2), [1e200, -1e200], ub=[0.5, 0.5], lb=[-0.5, -0.5]),
}
INFEASIBLE = {
    "equality beyond the box": QP(
        np.eye(2), [0.0, 0.0], A=[[1.0, 1.0]], b=[9.0], lb=[-1.0] * 2, ub=[1.0] * 2
    ),
    "contradicting equalities": QP(np.eye(2), [0.0, 0.0], A=[[1.0, 1.0], [1.0, 1.0]], b=[0.0, 1.0]),
    "zero row that wants one": QP(np.eye(2), [0.0, 0.0], A=[[0.0, 0.0]], b=[1.0]),
    "everything fixed elsewhere": QP(
        np.eye(2), [0.0, 0.0], A=[[1.0, 0.0]], b=[1.0], lb=[0.0] * 2, ub=[0.0] * 2
    ),
    "rows against each other": QP(np.eye(2), [0.0, 0.0], C=[[1.0, 0.0], [-1.0, 0.0]], l=[1.0, 1.0]),
    "row beyond the box": QP(np.eye(2), [0.0, 0.0], C=[[1.0, 1.0]], l=[5.0], ub=[1.0, 1.0]),
}


def answer(problem, backend):
    began = process_time()
    found = solve(problem, backend)
    assert process_time() - began < (
        120.0 if backend in ("active_set", "dtrnn") else 5.0
    )  # it may have to compile first
    if found.status is SolveStatus.SOLVED:
        scale = 1.0 + max(np.abs(problem.g).max(), np.abs(problem.b).max(initial=0.0), np.abs(found.x).max())
        assert found.residuals.primal <= 1e-6 * scale
        assert found.residuals.dual <= 2e-6 * scale
    return found


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("name", SOLVABLE)
def test_a_solvable_qp_is_solved(name, backend):
    assert answer(SOLVABLE[name], backend).status is SolveStatus.SOLVED


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("name", SOLVABLE_BUT_HARD)
def test_a_hard_qp_is_solved_or_honestly_given_up(name, backend):
    found = answer(SOLVABLE_BUT_HARD[name], backend)
    assert found.status is not SolveStatus.INFEASIBLE
    if backend == "active_set" and name != "overflowing scale":
        assert found.status is SolveStatus.SOLVED


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("name", INFEASIBLE)
def test_an_infeasible_qp_is_called_so_with_a_proof(name, backend):
    found = answer(INFEASIBLE[name], backend)
    assert found.status is SolveStatus.INFEASIBLE
    assert found.certificate is not None
