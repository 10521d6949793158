"""Solving a QP: answers, claims that are checked, proofs of infeasibility, and calls that are refused."""

import dataclasses

import numpy as np
import pytest
from tests.qp.planted import buffers, contradicting_qp, flat_qp, infeasible, planted
from tests.qp.solvers import ADAPTED, NATIVE, tolerance

from ftqp import InputError
from ftqp.qp import QP, Claim, SolveStatus, backend, solve
from ftqp.qp.solving import accepted, infeasibility, residuals


@pytest.mark.parametrize("name", NATIVE + ADAPTED)
def test_solve_returns_the_planted_solution_with_small_residuals(name):
    case = planted(np.random.default_rng(1), 9, 3, 5, fixed=1)
    found = solve(case.problem, name)
    assert found.status is SolveStatus.SOLVED
    assert found.backend == name
    assert found.residuals.largest <= 1e-6
    assert found.certificate is None
    np.testing.assert_allclose(found.x, case.x, rtol=0, atol=tolerance(name))


@pytest.mark.parametrize("name", NATIVE + ADAPTED)
def test_infeasible_is_proven_whatever_the_solver_says(name):
    qp = infeasible(np.random.default_rng(1))
    found = solve(qp, name)
    assert found.status is SolveStatus.INFEASIBLE
    assert found.certificate is not None
    assert found.certificate.violation > 0.0


def test_running_into_the_cap_is_reported():
    case = planted(np.random.default_rng(6), 20, 4, 20, unbounded=0.0)
    assert (
        solve(case.problem, "proxqp", max_iterations=1, max_inner_iterations=1).status
        is SolveStatus.MAX_ITERATIONS
    )
    left_alone = {"name": "osqp", "max_iterations": 25}
    assert solve(case.problem, left_alone).status is SolveStatus.MAX_ITERATIONS


@pytest.mark.parametrize("name", ["osqp", "daqp"])
def test_running_out_of_time_is_reported(name):
    rng = np.random.default_rng(0)
    A = rng.normal(size=(60, 60))
    hard = QP(A @ A.T + 1e-6 * np.eye(60), rng.normal(size=60), C=A, l=np.full(60, -0.1), u=np.full(60, 0.1))
    assert solve(hard, name, time_limit=1e-9).status is SolveStatus.OUT_OF_TIME
    assert solve(hard, name, time_limit=60.0).status is SolveStatus.SOLVED


def liar(claim, x):
    """DAQP, made to claim ``claim`` and to answer ``x``."""
    solver = backend("daqp")
    honest = solver._run

    def run(qp, cold):
        honest(qp, cold)
        qp.x[:] = x
        return claim

    solver._run = run
    return solver


@pytest.mark.parametrize(
    ("claim", "off", "status"),
    [
        (Claim.SOLVED, 1e-3, SolveStatus.FAILED),
        (Claim.SOLVED, np.nan, SolveStatus.FAILED),
        (Claim.INFEASIBLE, np.nan, SolveStatus.FAILED),
        (Claim.MAX_ITERATIONS, 0.0, SolveStatus.SOLVED),
    ],
)
def test_what_counts_is_the_answer_and_not_the_word_of_the_solver(claim, off, status):
    case = planted(np.random.default_rng(1))
    assert solve(case.problem, liar(claim, x=case.x + off)).status is status


def test_an_unbounded_qp_is_failed():
    qp = QP(np.diag([1.0, 0.0]), [0.0, -1.0])
    for name in ("active_set", "dtrnn", "daqp", "osqp", "proxqp", "quadprog"):
        assert solve(qp, name).status in (SolveStatus.FAILED, SolveStatus.MAX_ITERATIONS)


def test_wrong_calls_are_refused_in_one_sentence():
    with pytest.raises(InputError, match=r"expected an ftqp\.QP"):
        solve({"H": 1})
    with pytest.raises(InputError, match="tolerance were given together with a backend that is not a name"):
        solve(QP(np.eye(1), [0.0]), {"name": "daqp"}, tolerance=1e-3)


def test_a_qp_beyond_the_capacity_of_the_kernel_names_the_way_out():
    with pytest.raises(InputError, match="use backend 'daqp'"):
        solve(QP(np.eye(200), np.zeros(200)))
    assert solve(QP(np.eye(200), np.ones(200)), "daqp").status is SolveStatus.SOLVED


def squares(rows, aims, **limits):
    """The QP of least squares, without the constant."""
    rows, aims = np.array(rows, dtype=float), np.array(aims, dtype=float)
    return QP(2.0 * rows.T @ rows, -2.0 * rows.T @ aims, **limits)


FIVE = {"A": [[1, 3, 0, 0, 0], [0, 0, 1, 1, -2], [0, 1, 0, 0, -1]]}
"""The equality rows of problems 51 to 53 of Hock and Schittkowski."""
HS51 = [[1, -1, 0, 0, 0], [0, 1, 1, 0, 0], [0, 0, 0, 1, 0], [0, 0, 0, 0, 1]]
HS52 = [[4, -1, 0, 0, 0], *HS51[1:]]
CHAIN = {"A": np.eye(8, 10) + 2 * np.eye(8, 10, 1) + 3 * np.eye(8, 10, 2), "b": np.ones(8)}


@pytest.mark.parametrize(
    ("problem", "constant", "optimum"),
    [
        (squares(HS51, [0, 2, 1, 1], **FIVE, b=[4, 0, 0]), 6.0, 0.0),
        (squares(HS52, [0, 2, 1, 1], **FIVE, b=[0, 0, 0]), 6.0, 1859 / 349),
        (squares(HS51, [0, 2, 1, 1], **FIVE, b=[0, 0, 0], lb=[-10] * 5, ub=[10] * 5), 6.0, 176 / 43),
        (squares(np.eye(9, 10) + np.eye(9, 10, 1), np.zeros(9), **CHAIN), 0.0, 0.927173693766),
    ],
    ids=["HS51", "HS52", "HS53", "GENHS28"],
)
def test_flat_problems_of_the_literature_reach_their_optimum(problem, constant, optimum):
    found = solve(problem)
    assert found.status is SolveStatus.SOLVED
    assert problem.objective(found.x) + constant == pytest.approx(optimum, abs=1e-8)


def test_the_active_set_solves_semidefinite_qps_without_a_box():
    for seed in range(300):
        found = solve(flat_qp(seed))
        assert found.status is SolveStatus.SOLVED, seed
        assert found.iterations < 500, seed


def test_the_active_set_holds_512_rows():
    rng = np.random.default_rng(4)
    rows = rng.normal(size=(512, 8))
    qp = QP(np.zeros((8, 8)), rng.normal(size=8), C=rows, u=np.ones(512))
    ours, other = solve(qp), solve(qp, "daqp")
    assert ours.status is SolveStatus.SOLVED
    assert qp.objective(ours.x) == pytest.approx(qp.objective(other.x), abs=1e-7)


def test_parts_are_copies_contiguous_and_read_only():
    H, g = np.eye(2), np.zeros(2)
    qp = QP(np.asfortranarray(H), g, A=np.ones((4, 2))[::2], b=[0, 0])
    H[0, 0] = g[0] = 7.0
    assert qp.H[0, 0] == 1.0
    assert qp.g[0] == 0.0
    for field in dataclasses.fields(qp):
        part = getattr(qp, field.name)
        assert part.flags.c_contiguous
        assert not part.flags.writeable
    with pytest.raises(dataclasses.FrozenInstanceError):
        qp.H = np.eye(2)


def test_the_objective_is_half_x_h_x_plus_g_x():
    assert QP(np.diag([2.0, 4.0]), [1.0, -1.0]).objective(np.array([1.0, 2.0])) == pytest.approx(8.0)


GOOD = dict(H=np.eye(2), g=np.zeros(2))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (dict(g=[]), "g is empty"),
        (dict(g=1.0), "g has shape (), expected a vector"),
        (dict(g=[[1.0], [1.0, 2.0]]), "g is not an array of numbers"),
        (dict(g=[0.0, np.nan]), "g contains NaN at index 1"),
        (dict(H=[["a", "b"], ["c", "d"]]), "H is not an array of numbers"),
        (dict(H=[[1.0, 0.5], [0.0, 1.0]]), "H is not symmetric (|H - H'| reaches 5.0e-01)"),
        (dict(H=[[1.0, 2.0], [2.0, 1.0]]), "H is indefinite (smallest eigenvalue -1)"),
        (dict(H=-np.eye(2)), "H is indefinite"),
        (dict(A=[[1.0, 1.0]]), "A was given without b"),
        (dict(b=[1.0]), "b was given without A"),
        (dict(C=[[1.0, 1.0]]), "C was given without bounds"),
        (dict(u=[1.0]), "u was given without C"),
        (dict(C=[[1.0, 1.0]], l=[2.0], u=[1.0]), "l[0] = 2 and u[0] = 1 leave nothing between them"),
        (dict(lb=[0.0, 1.0], ub=[0.0, 0.5]), "lb[1] = 1 and ub[1] = 0.5 leave nothing between them"),
    ],
)
def test_a_wrong_part_is_refused_in_one_sentence(change, sentence):
    with pytest.raises(InputError) as error:
        QP(**(GOOD | change))
    assert sentence in str(error.value)
    assert "\n" not in str(error.value)


def answer(case):
    return [part.copy() for part in (case.x, case.y, case.z, case.z_box)]


def by_numpy(q, x, y, z, z_box):
    cx = q.C @ x
    values, lows, highs = np.concatenate([x, cx]), np.concatenate([q.lb, q.l]), np.concatenate([q.ub, q.u])
    mu = np.concatenate([z_box, z])
    primal = max(
        np.abs(q.A @ x - q.b).max(initial=0), np.maximum(lows - values, values - highs).max(initial=0)
    )
    dual = np.abs(q.H @ x + q.g + q.A.T @ y + q.C.T @ z + z_box).max()
    above, below = np.maximum(mu, 0), np.maximum(-mu, 0)
    comp = np.maximum(np.minimum(above, abs(highs - values)), np.minimum(below, abs(values - lows))).max()
    bound = np.where(mu > 0, highs, lows)
    used = np.isfinite(bound)
    gap = abs(x @ q.H @ x + q.g @ x + q.b @ y + mu[used] @ bound[used])
    return primal, dual, comp, gap


def test_residuals_are_zero_at_a_planted_solution():
    for seed in range(20):
        case = planted(np.random.default_rng(seed), 9, 3, 6, fixed=1, equal_rows=1)
        found = residuals(case.problem, *answer(case))
        assert found.largest <= 1e-12
        assert accepted(case.problem, found, case.x, case.y)


def test_residuals_equal_their_definition_away_from_the_solution():
    rng = np.random.default_rng(0)
    for _ in range(20):
        case = planted(rng, 6, 2, 4)
        point = [part + rng.normal(size=part.shape) for part in answer(case)]
        found = residuals(case.problem, *point)
        expected = by_numpy(case.problem, *point)
        np.testing.assert_allclose(
            (found.primal, found.dual, found.complementarity, found.gap), expected, rtol=1e-12, atol=1e-12
        )
        assert not accepted(case.problem, found, point[0], point[1])


@pytest.mark.parametrize("name", ["H", "g", "A", "b", "C", "l", "u", "lb", "ub"])
def test_nan_in_the_data_is_an_infinite_residual(name):
    case = planted(np.random.default_rng(1), 6, 2, 4, unbounded=0.0)
    qp = buffers(case.problem)
    getattr(qp, name).reshape(-1)[0] = np.nan
    assert residuals(qp, *answer(case)).largest == np.inf


def test_a_multiplier_of_the_wrong_sign_is_seen():
    qp = QP(np.eye(1), [-1.0], ub=[0.5], lb=[-5.0])
    good = residuals(qp, np.array([0.5]), np.zeros(0), np.zeros(0), np.array([0.5]))
    assert good.largest == 0.0
    wrong = residuals(qp, np.array([0.5]), np.zeros(0), np.zeros(0), np.array([-0.5]))
    assert wrong.dual == 1.0
    assert wrong.complementarity == 0.5
    assert not accepted(qp, wrong, np.array([0.5]), np.zeros(0))


def test_acceptance_is_relative_to_the_size_of_the_data():
    case = planted(np.random.default_rng(2), 6, 2, 4)
    p = case.problem
    point = answer(case)
    point[0] = point[0] + 1e-4
    assert not accepted(p, residuals(p, *point), point[0], point[1])
    big = QP(p.H, 1e3 * p.g, p.A, 1e3 * p.b, p.C, 1e3 * p.l, 1e3 * p.u, 1e3 * p.lb, 1e3 * p.ub)
    near = [1e3 * part for part in answer(case)]
    near[0] = near[0] + 1e-5
    found = residuals(big, *near)
    assert found.primal > 1e-6
    assert accepted(big, found, near[0], near[1], tolerance=1e-4)
    assert not accepted(big, found, near[0], near[1], tolerance=1e-9)


def proof_value(qp, proof):
    """b'y + sum of the supports; the certificate is one when A'y + C'z + z_box = 0 and this is negative."""
    mu = np.concatenate([proof.z_box, proof.z])
    bound = np.where(mu > 0, np.concatenate([qp.ub, qp.u]), np.concatenate([qp.lb, qp.l]))
    used = np.abs(mu) > 1e-9
    assert np.isfinite(bound[used]).all()
    return qp.b @ proof.y + mu[used] @ bound[used]


def test_a_proof_is_found_for_infeasible_and_never_for_feasible_qps():
    rng = np.random.default_rng(0)
    for k in range(40):
        n, m, p = int(rng.integers(1, 15)), int(rng.integers(1, 5)), int(rng.integers(0, 10))
        qp = infeasible(rng, n, m, p)
        proof = infeasibility(qp)
        assert proof is not None
        np.testing.assert_allclose(qp.A.T @ proof.y + qp.C.T @ proof.z + proof.z_box, 0.0, atol=1e-9)
        assert proof_value(qp, proof) < 0.0
        assert proof.violation > 0.0
        n = max(n, m)
        assert infeasibility(planted(rng, n, m, p, fixed=(n - m) // 3, kind="dense").problem) is None, k


@pytest.mark.parametrize(
    "qp",
    [
        QP(np.eye(2), [0, 0], A=[[1, 1], [1, 1]], b=[0, 1]),
        QP(np.eye(2), [0, 0], A=[[0, 0]], b=[1]),
        QP(np.eye(1), [0], C=[[1.0]], l=[2], ub=[1]),
        QP(np.eye(2), [0, 0], A=[[1, 0]], b=[1], lb=[0, 0], ub=[0, 0]),
        QP(np.eye(2), [0, 0], C=[[1, 0], [-1, 0]], l=[1, 1]),
        QP(np.eye(2), [0, 0], C=[[1, 1], [1, 1]], l=[1, -5], u=[1, 0.5]),
    ],
)
def test_contradictions_of_every_kind_are_proven(qp):
    proof = infeasibility(qp)
    assert proof is not None
    assert proof_value(qp, proof) < 0.0


@pytest.mark.parametrize(
    "qp",
    [
        QP(np.eye(2), [0, 0]),
        QP(np.eye(2), [0, 0], A=[[1, 1], [2, 2]], b=[1, 2]),
        QP(np.eye(2), [0, 0], A=[[0, 0]], b=[0]),
        QP(np.eye(2), [0, 0], A=[[1, 0]], b=[1], lb=[1, -np.inf], ub=[1, np.inf]),
        QP(np.eye(2), [0, 0], A=[[1, 1]], b=[2 + 1e-12], ub=[1, 1]),
    ],
)
def test_degenerate_but_feasible_qps_are_not_called_infeasible(qp):
    assert infeasibility(qp) is None


@pytest.mark.parametrize("size", [1.0, 1e3])
@pytest.mark.parametrize("margin", [1.0, 1e-3])
def test_a_margin_is_enough_for_a_proof(margin, size):
    for seed in range(40):
        qp = contradicting_qp(seed, margin, size)
        proof = infeasibility(qp)
        assert proof is not None, seed
        assert proof_value(qp, proof) < 0.0
