"""The in-kernel solver against daqp and quadprog, on random QPs of every kind a tick brings, and worse."""

from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from random_qps import FEASIBLE, INFEASIBLE, by_daqp, feasible, hessian, infeasible, nudged, unplanned

from ftqp.kernel.entry.session import bound, rooms
from ftqp.kernel.entry.workspace import TOLERANCE
from ftqp.kernel.layout import enums as codes
from ftqp.kernel.layout.record import dtype


class StandaloneQP:
    """Memory of one QP of n variables, m rows of A, which may be compliant, and p two-sided rows.

    Attributes:
        Q: Every field of the solver's memory.
        H, g, A, b, soft, C, l, u, lb, ub: The QP, to be filled in place.
        x, y, z, z_box: The solution.
    """

    def __init__(self, n: int, m: int, p: int) -> None:
        memory = np.zeros(1, dtype("standalone"))
        self.Q: Any = rooms(memory)
        Q = self.Q
        Q.nx, Q.meq, Q.nc, Q.dense = n, m, p, 1
        Q.tolerance, Q.max_iterations = TOLERANCE, 50 * (n + p + 10)
        self.H, self.g, self.A, self.b, self.soft = Q.H[:n, :n], Q.g[:n], Q.A[:m, :n], Q.b[:m], Q.soft[:m]
        self.C, self.l, self.u, self.lb, self.ub = Q.C[:p, :n], Q.l[:p], Q.u[:p], Q.lb[:n], Q.ub[:n]
        self.x, self.y, self.z, self.z_box = Q.x[:n], Q.y[:m], Q.z[:p], Q.z_box[:n]
        self._memory = memory
        self._solve = bound("solve_qp", memory)

    def solve(self, cold: bool = False) -> int:
        """The claim of the active set on what the arrays hold now."""
        if cold:
            self.Q.warm = 0
        return self._solve()

    @property
    def iterations(self) -> int:
        """Changes of the working set in the last solve."""
        return int(self.Q.iterations)


standalone_qp = lru_cache(4)(StandaloneQP)
"""One memory a size, as a solver keeps it, for a few sizes: each is megabytes, and there are thousands."""


COUNTS = [60, pytest.param(600, marks=pytest.mark.slow)]
"""Random QPs of each kind, dense and diagonal each, every one solved cold and, a tick later, warm."""
AGREEMENT = 1e-9


def loaded(case):
    """Memory that holds the case."""
    n, m = len(case.g), len(case.b)
    ws = standalone_qp(n, m, len(case.l))
    for name in ("H", "g", "A", "b", "soft", "C", "l", "u", "lb", "ub"):
        getattr(ws, name)[...] = getattr(case, name)
    ws.Q.dense, ws.Q.H_diagonal[:n] = case.dense, np.diag(case.H)
    return ws


def kkt(case, ws):
    """Largest violation of stationarity, of the signs of multipliers and of complementarity, scaled."""
    x, y, z, box = ws.x, ws.y, ws.z, ws.z_box
    gradient = case.H @ x + case.g
    terms = np.abs(gradient).max() + np.abs(case.A).T @ np.abs(y) + np.abs(case.C).T @ np.abs(z) + 1.0
    stationarity = np.abs((gradient + case.A.T @ y + case.C.T @ z + box) / terms).max()
    compliance = np.abs(case.A @ x - case.b - case.soft * y).max(initial=0.0)
    ranges = ((case.C @ x, case.l, case.u, z), (x, case.lb, case.ub, box))
    pairs = [np.where(s > 0, np.minimum(s, hi - v), np.minimum(-s, v - lo)) for v, lo, hi, s in ranges]
    return max(
        stationarity, compliance / (1.0 + np.abs(case.b).max(initial=0.0)), np.concatenate(pairs).max()
    )


def agrees(case, code, ws, expected, stationarity=AGREEMENT):
    """Whether a solved QP is feasible, optimal by its own multipliers, and as good as the reference."""
    assert code == codes.SOLVED
    assert case.violation(ws.x) < AGREEMENT
    assert kkt(case, ws) < stationarity
    if expected is not None:
        best = case.objective(expected)
        assert abs(case.objective(ws.x) - best) < AGREEMENT * (1.0 + abs(best))


@pytest.mark.long
@pytest.mark.parametrize("dense", [False, True], ids=["diagonal", "dense"])
@pytest.mark.parametrize("kind", FEASIBLE)
@pytest.mark.parametrize("count", COUNTS)
def test_feasible_qps_are_solved_as_by_daqp(kind, dense, count):
    rng, disagreements = np.random.default_rng(17), 0
    for _ in range(count):
        case = feasible(rng, kind, dense)
        for warm in (False, True):
            case = nudged(rng, case) if warm else case
            ws = loaded(case)
            code, expected = ws.solve(cold=not warm), by_daqp(case)
            disagreements += expected is None  # the feasible point planted in the case says daqp is wrong
            agrees(case, code, ws, expected, 1e-7 if kind == "stiff" else AGREEMENT)
    assert disagreements <= 0.02 * 2 * count


@pytest.mark.long
@pytest.mark.parametrize("dense", [False, True], ids=["diagonal", "dense"])
@pytest.mark.parametrize("kind", INFEASIBLE)
@pytest.mark.parametrize("count", COUNTS)
def test_infeasible_qps_are_called_infeasible_as_by_daqp(kind, dense, count):
    rng = np.random.default_rng(18)
    for _ in range(count):
        case = infeasible(rng, kind, dense)
        for warm in (False, True):
            case = nudged(rng, case) if warm else case
            assert loaded(case).solve(cold=not warm) == codes.INFEASIBLE
            assert by_daqp(case) is None


@pytest.mark.parametrize("dense", [False, True], ids=["diagonal", "dense"])
def test_feasibility_is_judged_as_by_daqp_when_nobody_planned_it(dense):
    rng, solved, infeasible_count = np.random.default_rng(19), 0, 0
    for _ in range(300):
        case = unplanned(rng, dense)
        ws, expected = loaded(case), by_daqp(case)
        code = ws.solve(cold=True)
        if expected is None and code == codes.INFEASIBLE:
            infeasible_count += 1
        else:  # where daqp alone calls it infeasible, the point found proves it wrong
            agrees(case, code, ws, expected)
            solved += 1
    assert solved > 50 and infeasible_count > 50


def test_a_warm_start_repeats_the_answer_at_once():
    rng, changes = np.random.default_rng(21), []
    for _ in range(300):
        case = feasible(rng, "plain", True)
        ws = loaded(case)
        ws.solve(cold=True)
        x, cold = ws.x.copy(), ws.iterations
        assert ws.solve() == codes.SOLVED
        assert np.abs(ws.x - x).max() < 1e-10
        changes.append((cold, ws.iterations))
    cold, warm = np.array(changes).T
    assert np.all(warm <= np.maximum(cold, 1)) and np.mean(warm == 1) > 0.95 and np.mean(cold > 1) > 0.5


def test_a_warm_start_survives_a_joint_that_locks():
    rng = np.random.default_rng(22)
    for dense in (False, True):
        for _ in range(300):
            case = feasible(rng, "compliant", dense)
            loaded(case).solve(cold=True)
            i = int(rng.integers(len(case.g)))
            case.lb[i] = case.ub[i] = np.clip(0.5 * (case.lb[i] + case.ub[i]), -5.0, 5.0)
            ws, expected = loaded(case), by_daqp(case)
            code = ws.solve()
            if expected is None:
                assert code == codes.INFEASIBLE or case.violation(ws.x) < AGREEMENT
            else:
                agrees(case, code, ws, expected)
                assert ws.x[i] == case.ub[i]


def test_crossed_bounds_are_infeasible_and_a_negative_hessian_fails():
    rng = np.random.default_rng(23)
    case = feasible(rng, "plain", True)
    case.lb[0], case.ub[0] = 1.0, 0.5
    assert loaded(case).solve(cold=True) == codes.INFEASIBLE
    case = feasible(rng, "plain", True)
    case.H[:] *= -1.0
    assert loaded(case).solve(cold=True) == codes.FAILED


def test_limits_that_meet_in_one_point_are_not_taken_for_infeasible():
    """A pyramid of many faces whose tip is the only feasible direction's end: 30 rows through one point."""
    rng = np.random.default_rng(24)
    for _ in range(200):
        n, p = 4, 30
        ws = standalone_qp(n, 0, p)
        ws.Q.dense = 1
        tip, C = rng.normal(size=n), rng.normal(size=(p, n))
        ws.H[:], ws.C[:], ws.u[:], ws.l[:] = hessian(rng, n, True), C, C @ tip, -np.inf
        ws.g[:] = -ws.H @ tip - C.T @ rng.uniform(0.0, 1e3, p)
        ws.lb[:], ws.ub[:] = -np.inf, np.inf
        assert ws.solve(cold=True) == codes.SOLVED
        assert np.abs(ws.x - tip).max() < 1e-8
