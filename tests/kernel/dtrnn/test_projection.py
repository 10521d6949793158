"""The projection equation of a QP: its matrices, its solutions, what is eliminated."""

import numpy as np
import pytest
from networks import network_of, problem, projected, residual_of

from ftqp.kernel.dtrnn.network_of_qp import publish, start
from ftqp.kernel.dtrnn.projection import project, rescale, residual
from ftqp.kernel.layout import enums as codes
from ftqp.qp import QP, solve


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


def test_fixed_variables_equal_rows_and_open_rows_are_left_out_exactly():
    q = problem(np.random.default_rng(1), 5, 2, 3)
    q["lb"][1] = q["ub"][1] = 0.4
    q["l"][0] = q["u"][0] = 0.2
    q["l"][2], q["u"][2] = -np.inf, np.inf
    _, net = network_of(q)
    free = [0, 2, 3, 4]
    assert (net.variables, net.slacks, net.rows) == (4, 1, 4)
    np.testing.assert_allclose(net.Gamma[:4, :4], q["H"][np.ix_(free, free)])
    np.testing.assert_allclose(net.z[:4], q["g"][free] + 0.4 * q["H"][free, 1])
    np.testing.assert_allclose(net.z[5:7], 0.4 * q["A"][:, 1] - q["b"])
    norm = np.linalg.norm(q["C"][:, free], axis=1)
    np.testing.assert_allclose(net.z[7], (0.4 * q["C"][0, 1] - 0.2) / norm[0])
    np.testing.assert_allclose(net.high[4], (q["u"][1] - 0.4 * q["C"][1, 1]) / norm[1])


@pytest.mark.parametrize("seed", range(6))
def test_the_residual_vanishes_at_the_solution_and_publish_undoes_start(seed):
    rng = np.random.default_rng(seed)
    q = problem(rng, 6, 2, 4, fixed=seed % 2, equal=seed % 2)
    parts = {name: value for name, value in q.items() if name != "soft"}
    answer = solve(QP(**parts))
    _, net = network_of(q)
    start(net, 6, 2, answer.x, answer.y, answer.z)
    assert residual(net, net.u) < 1e-9
    rescale(net, 7.0, 0.3)
    assert residual(net, net.u) < 1e-9
    terms = np.abs(net.Gamma) @ np.abs(net.u) + np.abs(net.z)  # whose sums round in another order
    np.testing.assert_allclose(net.e, residual_of(net, net.u), atol=8.0 * np.finfo(float).eps * terms.max())
    x, y, z, z_box = np.zeros(6), np.zeros(2), np.zeros(4), np.zeros(6)
    publish(net, 6, 2, 4, 1, q["H"], q["g"], q["g"], q["A"], q["C"], q["lb"], q["ub"], x, y, z, z_box)
    for mine, its in ((x, answer.x), (y, answer.y), (z, answer.z), (z_box, answer.z_box)):
        np.testing.assert_allclose(mine, its, atol=1e-8)


def test_a_compliant_row_yields_by_its_compliance():
    q = problem(np.random.default_rng(5), 4, 1, 0, lb=np.full(4, -np.inf), ub=np.full(4, np.inf))
    q["soft"][:] = 0.7
    _, net = network_of(q)
    u = np.linalg.solve(net.Gamma, -net.z)
    assert residual(net, u) < 1e-12
    slack = q["b"] - q["A"] @ u[:4]
    np.testing.assert_allclose(slack, 0.7 * u[4:])
    penalty = q["H"] + np.outer(q["A"], q["A"]) / 0.7
    np.testing.assert_allclose(u[:4], np.linalg.solve(penalty, q["A"].T @ q["b"] / 0.7 - q["g"]))


def test_projection_is_a_clip_and_changes_nothing_twice():
    _, net = network_of(problem(np.random.default_rng(6), 5, 2, 3))
    v = 10.0 * np.random.default_rng(7).normal(size=len(net.u))
    expected = projected(net, v)
    project(net, v)
    np.testing.assert_array_equal(v, expected)
    project(net, v)
    np.testing.assert_array_equal(v, expected)


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
