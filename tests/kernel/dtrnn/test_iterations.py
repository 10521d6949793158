"""The three iterations by their formulas, what they contract, how they end; jumps and stretches."""

from typing import Any

import numpy as np
import pytest
from dtrnn_cap import feasible_qp
from random_qps import FEASIBLE, INFEASIBLE, feasible, infeasible

from ftqp.kernel.dtrnn.iterations import (
    dtrnn,
    factor_implicit,
    iterate,
    proven_infeasible,
)
from ftqp.kernel.dtrnn.network import (
    Options,
    Problem,
    assemble,
    publish,
    quality,
    rescale,
    residual,
    start,
)
from ftqp.kernel.layout import enums as codes
from ftqp.kernel.layout.enums import E47, IMPLICIT, LVI94
from ftqp.kernel.layout.flat_arrays import memory_size
from ftqp.qp import QP, solve
from ftqp.qp import dtrnn as network

PRODUCT = Options(2, 1, 1, 0, 2000, 1.6, 1e-9)
"""The options of ftqp.qp.dtrnn.solve as it comes."""


def problem(rng: np.random.Generator, n: int, m: int, p: int, *, fixed: int = 0, equal: int = 0,
            **changes: Any) -> dict[str, Any]:  # fmt: skip
    """A feasible QP as arrays; its bounds are finite, its rows of A hard, the first bounds may be equal."""
    B, x = rng.normal(size=(n, n)), rng.uniform(-1.0, 1.0, n)
    A, C = rng.normal(size=(m, n)), rng.normal(size=(p, n))
    parts = dict(H=B @ B.T + 0.1 * np.eye(n), g=rng.normal(size=n), A=A, b=A @ x, soft=np.zeros(m), C=C,
                 l=C @ x - rng.uniform(0.1, 1.0, p), u=C @ x + rng.uniform(0.1, 1.0, p),
                 lb=x - rng.uniform(0.1, 1.0, n), ub=x + rng.uniform(0.1, 1.0, n))  # fmt: skip
    parts["lb"][:fixed] = parts["ub"][:fixed] = x[:fixed]
    parts["l"][:equal] = parts["u"][:equal] = (C @ x)[:equal]
    return parts | changes


def network_of(parts: dict[str, Any]) -> tuple[int, Any]:
    """The verdict on the bounds, and the network."""
    n, m, p = len(parts["g"]), len(parts["b"]), len(parts["l"])
    memory = np.full(memory_size(n, m, p), np.nan)
    return assemble(memory, problem_of(parts))


def problem_of(q: dict[str, Any]) -> Problem:
    """The parts of a QP as the kernel takes them."""
    n, m, p = len(q["g"]), len(q["b"]), len(q["l"])
    names = ("H", "g", "g", "A", "b", "soft", "C", "l", "u", "lb", "ub")
    return Problem(n, m, p, 1, *(q[name] for name in names))


def projected(net: Any, v: Any) -> Any:
    """P(v)."""
    return np.clip(v, net.low, net.high)


def residual_of(net: Any, u: Any) -> Any:
    """e(u)."""
    return u - projected(net, u - (net.Gamma @ u + net.z))


METHODS = {"94lvi": LVI94, "e47": E47, "implicit": IMPLICIT}
NO_TRACE = np.zeros((0, 4))


def started(seed=0, n=6, m=2, p=3):
    """A network away from its solution, its residual, and the solution as a state."""
    rng = np.random.default_rng(seed)
    q = problem(rng, n, m, p)
    answer = solve(QP(**{name: value for name, value in q.items() if name != "soft"}))
    _, net = network_of(q)
    start(net, m, answer.x, answer.y, answer.z)
    solution = net.u.copy()
    net.u[:] += rng.normal(size=len(net.u))
    return net, residual(net, net.u), solution


def parts_of(case):
    return {name: getattr(case, name) for name in ("H", "g", "A", "b", "soft", "C", "l", "u", "lb", "ub")}


def hard(case):
    """The QP with a variable for the slack of each row that gives way."""
    gives = case.soft > 0.0
    k, n, m = int(gives.sum()), len(case.g), len(case.b)
    H = np.zeros((n + k, n + k))
    H[:n, :n], H[range(n, n + k), range(n, n + k)] = case.H, 1.0 / case.soft[gives]
    far = np.full(k, np.inf)
    return QP(H=H, g=np.append(case.g, np.zeros(k)), A=np.hstack([case.A, np.eye(m)[:, gives]]), b=case.b,
              C=np.hstack([case.C, np.zeros((len(case.l), k))]), l=case.l, u=case.u,
              lb=np.append(case.lb, -far), ub=np.append(case.ub, far))  # fmt: skip


def step(net, method, gamma, size):
    factor_implicit(net)
    iterate(net, method, gamma, size)


@pytest.mark.parametrize("seed", range(4))
def test_each_iteration_is_its_formula(seed):
    for name, method in METHODS.items():
        net, size, _ = started(seed)
        u, e, G, z = net.u.copy(), net.e.copy(), net.Gamma, net.z
        d = G.T @ e + e
        rho = size**2 / (d @ d)
        expected = {
            "94lvi": u - 0.9 * rho * d,
            "e47": np.clip(u - 0.9 * rho * (G.T @ e + G @ u + z), net.low, net.high),
            "implicit": u - 0.9 * np.linalg.solve(np.eye(len(u)) + G, e),
        }[name]
        step(net, method, 0.9, size)
        np.testing.assert_allclose(net.u, expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("gamma", [0.5, 1.0, 1.6])
def test_every_step_comes_nearer_to_the_solution_by_what_the_theory_says(seed, gamma):
    net, size, solution = started(seed)
    one = np.eye(len(solution))
    for name, method in METHODS.items():
        net.u[:] = solution + np.random.default_rng(seed).normal(size=len(solution))
        size = residual(net, net.u)
        d = (net.Gamma.T + one) @ net.e
        norm = one + net.Gamma if name == "implicit" else one
        before = np.sum((norm @ (net.u - solution)) ** 2)
        gain = gamma * (2 - gamma) * (size**2 if name == "implicit" else size**4 / (d @ d))
        step(net, method, gamma, size)
        after = np.sum((norm @ (net.u - solution)) ** 2)
        assert after <= before - (gain if name != "e47" else 0.0) + 1e-9 * before


@pytest.mark.parametrize("kind", FEASIBLE)
def test_no_feasible_qp_is_called_infeasible_whatever_the_state(kind):
    rng = np.random.default_rng(FEASIBLE.index(kind))
    for k in range(8):
        case = feasible(rng, kind, dense=bool(k % 2))
        _, net = network_of(parts_of(case))
        net.u[:] = (0.0, 1.0, 1e3, 1e8)[k // 2 % 4] * rng.normal(size=len(net.u))
        assert not proven_infeasible(net)
        assert network.solve(hard(case)).claim.name != "INFEASIBLE"


@pytest.mark.parametrize("kind", INFEASIBLE)
def test_every_infeasible_qp_is_called_so_by_every_method(kind):
    rng = np.random.default_rng(INFEASIBLE.index(kind))
    for k in range(4):
        case = hard(infeasible(rng, kind, dense=bool(k % 2)))
        for options in ({}, *({"method": method, "scaling": False, "gamma": 1.0, "max_iterations": 20_000}
                              for method in ("94lvi", "e47"))):  # fmt: skip
            assert network.solve(case, **options).claim.name == "INFEASIBLE"


def test_an_ill_conditioned_objective_in_a_narrow_box_ends_at_no_cap_and_is_met():
    rng = np.random.default_rng(1)
    for _ in range(40):
        qp = feasible_qp(rng, 1e8, 100.0)
        found = network.solve(qp, max_iterations=100)
        assert found.claim.name == "SOLVED" and found.status.name == "SOLVED"
        np.testing.assert_allclose(found.x, solve(qp).x, atol=1e-6)


def test_the_gap_bounds_the_distance_from_the_optimum():
    for seed in range(20):
        net, _, solution = started(seed, m=0, p=0)
        x = np.clip(net.u, net.low, net.high)
        r_eq, _, gap, _ = quality(net, net.u)
        f = [0.5 * v @ net.Gamma @ v + net.z @ v for v in (x, solution)]
        assert r_eq == 0.0 and gap >= 0.0
        assert f[0] - f[1] <= gap + 1e-12
        assert (x - solution) @ net.Gamma @ (x - solution) <= gap + 1e-12


def test_the_cap_is_a_status_and_numbers_that_are_none_fail():
    net, _, _ = started(5)
    assert dtrnn(net, PRODUCT._replace(newton=0, cap=3), NO_TRACE) == (codes.MAX_ITERATIONS, 3)
    net, _, _ = started(5)
    net.z[0] = np.nan
    assert dtrnn(net, PRODUCT, NO_TRACE)[0] == codes.FAILED


def test_matrices_are_those_of_the_formula():
    q = problem(np.random.default_rng(0), 5, 2, 3, soft=np.array([0.0, 0.3]))
    code, net = network_of(q)
    norm = np.linalg.norm(q["C"], axis=1)
    zero = np.zeros
    rows = np.block([[q["A"], zero((2, 3))], [q["C"] / norm[:, None], -np.eye(3)]])
    W = np.block([[q["H"], zero((5, 3))], [zero((3, 8))]])
    soft = np.diag([0.0, 0.3, 0.0, 0.0, 0.0])
    assert code == codes.SOLVED
    np.testing.assert_allclose(net.Gamma, np.block([[W, -rows.T], [rows, soft]]), atol=1e-15)
    np.testing.assert_allclose(net.z, np.concatenate([q["g"], zero(3), -q["b"], zero(3)]), atol=1e-15)
    np.testing.assert_allclose(net.low[:8], np.concatenate([q["lb"], q["l"] / norm]), atol=1e-15)
    np.testing.assert_allclose(net.high[:8], np.concatenate([q["ub"], q["u"] / norm]), atol=1e-15)
    assert np.isneginf(net.low[8:]).all() and np.isposinf(net.high[8:]).all()
    assert np.linalg.eigvalsh(net.Gamma + net.Gamma.T).min() >= -1e-12


@pytest.mark.parametrize("seed", range(6))
def test_the_residual_vanishes_at_the_solution_and_publish_undoes_start(seed):
    rng = np.random.default_rng(seed)
    q = problem(rng, 6, 2, 4, fixed=seed % 2, equal=seed % 2)
    parts = {name: value for name, value in q.items() if name != "soft"}
    answer = solve(QP(**parts))
    _, net = network_of(q)
    start(net, 2, answer.x, answer.y, answer.z)
    assert residual(net, net.u) < 1e-9
    rescale(net, 7.0, 0.3)
    assert residual(net, net.u) < 1e-9
    terms = np.abs(net.Gamma) @ np.abs(net.u) + np.abs(net.z)  # whose sums round in another order
    np.testing.assert_allclose(net.e, residual_of(net, net.u), atol=8.0 * np.finfo(float).eps * terms.max())
    x, y, z, z_box = np.zeros(6), np.zeros(2), np.zeros(4), np.zeros(6)
    publish(net, problem_of(q), x, y, z, z_box)
    for mine, its in ((x, answer.x), (y, answer.y), (z, answer.z), (z_box, answer.z_box)):
        np.testing.assert_allclose(mine, its, atol=1e-8)


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        (dict(lb=np.full(3, 2.0), ub=np.full(3, 1.0)), codes.INFEASIBLE),
        (dict(l=np.array([1.0]), u=np.array([-1.0])), codes.INFEASIBLE),
        (dict(lb=np.full(3, np.inf), ub=np.full(3, np.inf)), codes.INFEASIBLE),
        (dict(lb=np.full(3, np.nan)), codes.FAILED),
        (dict(u=np.array([np.nan])), codes.FAILED),
        (dict(A=np.zeros((1, 3)), b=np.array([1.0])), codes.INFEASIBLE),
        (dict(A=np.zeros((1, 3)), b=np.zeros(1)), codes.SOLVED),
        (dict(C=np.zeros((1, 3)), l=np.array([1.0]), u=np.array([2.0])), codes.INFEASIBLE),
        (dict(C=np.zeros((1, 3)), l=np.array([-1.0]), u=np.array([2.0])), codes.SOLVED),
    ],
)
def test_bounds_and_rows_that_decide_alone(changes, code):
    assert network_of(problem(np.random.default_rng(8), 3, 1, 1, **changes))[0] == code
