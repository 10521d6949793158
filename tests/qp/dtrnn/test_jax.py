"""The network in JAX: right answers, the scalar network's iterations, and no problem touches another."""

import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest
from planted import infeasible, planted

from ftqp.core.extras import remedy_for_extra
from ftqp.kernel.layout.enums import FAILED, INFEASIBLE, MAX_ITERATIONS, SOLVED
from ftqp.qp import QP, Claim, SolveStatus, accepted, dtrnn, residuals, solve

pytestmark = [
    pytest.mark.gpu,
    pytest.mark.skipif(find_spec("jax") is None, reason='needs pip install -e ".[gpu]"'),
]
PARTS = ("H", "g", "A", "b", "C", "l", "u", "lb", "ub")
PRODUCT = dict(
    method="implicit", scaling=True, newton=True, gamma=1.6, tolerance=1e-9, max_iterations=2000, paper=False
)
PAPER = dict(scaling=False, newton=False, gamma=1.0, tolerance=1e-5, max_iterations=20_000, paper=True)


def stacked(problems):
    return [np.stack([getattr(problem, name) for problem in problems]) for name in PARTS]


def run(problems, **settings):
    return run_parts(stacked(problems), **settings)


def run_parts(parts, **settings):
    from ftqp.qp.dtrnn import jax as _dtrnn_jax

    return _dtrnn_jax.solve_batch(*parts, **{**PRODUCT, **settings})


def dependent_rows(rng):
    """A third equality row that is the sum of the other two, and its right side too."""
    whole = planted(rng, 7, 2, 4).problem
    A = np.vstack([whole.A, whole.A.sum(axis=0)])
    b = np.append(whole.b, whole.b.sum())
    return QP(whole.H, whole.g, A, b, whole.C, whole.l, whole.u, whole.lb, whole.ub)


def at_the_edge(rng):
    """One point of the box reaches the first equality row."""
    A, C = rng.normal(size=(3, 7)), rng.normal(size=(4, 7))
    corner = np.sign(A[0])
    bounds = -np.ones(7), np.ones(7)
    return QP(np.eye(7), rng.normal(size=7), A, A @ corner, C, C @ corner - 1, C @ corner + 1, *bounds)


@pytest.fixture(scope="module")
def mixed():
    rng = np.random.default_rng(4)
    kinds = ["dense", "identity", "diagonal"]
    return [
        planted(rng, 7, 3, 4, kind=kinds[k % 3], fixed=k % 4, equal_rows=k % 2, unbounded=0.25 * (k % 3))
        for k in range(60)
    ]


@pytest.fixture(scope="module")
def answers(mixed):
    return run([one.problem for one in mixed])


def test_planted_solutions_are_found_within_1e_7(mixed, answers):
    x, *_, code, _, _ = answers
    assert (code == SOLVED).all()
    assert max(np.abs(x[k] - one.x).max() for k, one in enumerate(mixed)) < 1e-7


def test_the_judge_accepts_point_and_multipliers(mixed, answers):
    for k, one in enumerate(mixed):
        x, y, z, z_box = (part[k] for part in answers[:4])
        found = residuals(one.problem, x, y, z, z_box)
        assert found.largest < 1e-7
        assert accepted(one.problem, found, x, y)


@pytest.mark.parametrize("backend", ["active_set", "daqp"])
def test_other_backends_find_the_same_points(mixed, answers, backend):
    for k, one in enumerate(mixed[:20]):
        assert answers[0][k] == pytest.approx(solve(one.problem, backend).x, abs=1e-7)


def test_locked_variables_are_exact(mixed, answers):
    for k, one in enumerate(mixed):
        locked = one.problem.lb == one.problem.ub
        assert (answers[0][k][locked] == one.problem.lb[locked]).all()


@pytest.mark.parametrize(("n", "m", "p"), [(1, 0, 0), (10, 6, 4)])
def test_other_sizes_are_solved_too(n, m, p):
    rng = np.random.default_rng(n)
    batch = [planted(rng, n, m, p) for _ in range(20)]
    x, *_, code, _, _ = run([one.problem for one in batch])
    assert (code == SOLVED).all()
    assert x == pytest.approx(np.stack([one.x for one in batch]), abs=1e-7)


def test_dependent_rows_do_no_harm():
    problems = [dependent_rows(np.random.default_rng(k)) for k in range(20)]
    x, y, z, z_box, code, _, _ = run(problems)
    assert (code == SOLVED).all()
    for k, problem in enumerate(problems):
        assert residuals(problem, x[k], y[k], z[k], z_box[k]).largest < 1e-7


@pytest.mark.parametrize("method", ["implicit", "94lvi", "e47"])
def test_infeasible_problems_are_called_so(method):
    rng = np.random.default_rng(8)
    settings = {} if method == "implicit" else dict(PAPER)
    x, y, z, z_box, code, _, _ = run([infeasible(rng) for _ in range(30)], **{**settings, "method": method})
    assert (code == INFEASIBLE).all()
    assert all(np.isnan(part).all() for part in (x, y, z, z_box))


@pytest.mark.parametrize("method", ["implicit", "94lvi", "e47"])
def test_a_feasible_problem_with_one_point_is_never_called_infeasible(method):
    problems = [at_the_edge(np.random.default_rng(k)) for k in range(30)]
    assert all(solve(problem).status is SolveStatus.SOLVED for problem in problems[:5])
    settings = {} if method == "implicit" else {**PAPER, "max_iterations": 2000}
    assert INFEASIBLE not in run(problems, **{**settings, "method": method})[4]


@pytest.mark.parametrize("method", ["implicit", "94lvi", "e47"])
def test_paper_mode_takes_the_iterations_of_the_scalar_network(mixed, method):
    chosen = [one.problem for one in mixed if (np.eye(7) == one.problem.H).all()]
    x, *_, code, iterations, residual = run(chosen, **PAPER, method=method)
    for k, problem in enumerate(chosen):
        scalar = dtrnn.solve(problem, method, mode="paper")
        assert code[k] == scalar.claim
        # Rounding alone moves the end of a run of hundreds of iterations by a few.
        assert abs(iterations[k] - scalar.iterations) <= max(1, scalar.iterations // 50)
        same = iterations[k] == scalar.iterations  # else one has gone on towards the solution for longer
        assert x[k] == pytest.approx(scalar.x, abs=1e-6 if same else 1e-5)
        if iterations[k] == scalar.iterations < 200:
            assert residual[k] == pytest.approx(scalar.residual, rel=1e-3, abs=1e-9)


def test_the_scaling_rule_is_that_of_the_scalar_network(mixed):
    chosen = [one.problem for one in mixed if one.problem.H[0, 0] not in (1.0, 1e3)]
    settings = dict(scaling=True, gamma=1.6)
    iterations = run(chosen, method="implicit", **{**PAPER, **settings})[5]
    for k, problem in enumerate(chosen):
        scalar = dtrnn.solve(problem, "implicit", mode="paper", **settings)
        assert abs(iterations[k] - scalar.iterations) <= 1


def test_product_mode_ends_where_the_scalar_network_does(mixed, answers):
    for k, one in enumerate(mixed[:20]):
        scalar = dtrnn.solve(one.problem)
        assert scalar.status is SolveStatus.SOLVED
        assert answers[0][k] == pytest.approx(scalar.x, abs=1e-7)
        assert answers[1][k] == pytest.approx(scalar.y, abs=1e-6)


def spoilt(problem, name, index, value):
    parts = [np.array(getattr(problem, part)) for part in PARTS]
    parts[PARTS.index(name)][index] = value
    return parts


@pytest.mark.parametrize(
    ("name", "index", "value", "expected"),
    [
        ("H", (0, 0), np.nan, FAILED),
        ("g", 0, np.inf, FAILED),
        ("A", (0, 0), np.nan, FAILED),
        ("b", 0, np.nan, FAILED),
        ("l", 0, np.nan, FAILED),
        ("ub", 0, np.nan, FAILED),
        ("H", (0, 0), -5.0, FAILED),
        ("ub", slice(None), -1e3, INFEASIBLE),
        ("l", slice(None), 1e3, INFEASIBLE),
        ("lb", 0, np.inf, INFEASIBLE),
    ],
)
def test_a_spoilt_problem_spoils_no_other(mixed, answers, name, index, value, expected):
    parts = stacked([one.problem for one in mixed])
    whole = spoilt(planted(np.random.default_rng(0), unbounded=0.0).problem, name, index, value)
    for part, bad in zip(parts, whole, strict=True):
        part[5] = bad
    x, y, z, z_box, code, iterations, _ = run_parts(parts)
    assert code[5] == expected
    assert np.isnan(np.concatenate([x[5], y[5], z[5], z_box[5]])).all()
    others = np.arange(60) != 5
    assert (code[others] == SOLVED).all()
    assert (iterations[others] == answers[5][others]).all()
    assert x[others] == pytest.approx(answers[0][others], abs=1e-12)


def test_a_hard_problem_changes_no_other(mixed, answers):
    hard = planted(np.random.default_rng(3), kind="mtn").problem
    x, *_, iterations, _ = run([hard] + [one.problem for one in mixed])
    assert iterations[0] > 50
    assert (iterations[1:] == answers[5]).all()
    assert x[1:] == pytest.approx(answers[0], abs=1e-12)


def test_answers_do_not_depend_on_how_problems_are_shared_out(mixed, answers, monkeypatch):
    from ftqp.qp.dtrnn.jax import batch_rounds as batch

    monkeypatch.setattr(batch, "CHUNK_BYTES", {"cpu": 0, "gpu": 0})
    x, *_, code, iterations, _ = run([one.problem for one in mixed] * 3)
    assert (code == SOLVED).all()
    assert (iterations == np.tile(answers[5], 3)).all()
    assert x == pytest.approx(np.tile(answers[0], (3, 1)), abs=1e-12)


def test_a_part_of_length_1_is_for_all(mixed):
    problem = mixed[0].problem
    parts = stacked([problem])
    parts[1] = np.stack([problem.g, 2.0 * problem.g, -problem.g])
    together = run_parts(parts)
    apart = run_parts([np.repeat(part, 3 // len(part), axis=0) for part in parts])
    assert (together[4] == SOLVED).all()
    assert all((one == other).all() for one, other in zip(together, apart, strict=True))


def test_the_cap_is_a_status_and_its_iterate_is_inside_the_box(mixed):
    problems = [one.problem for one in mixed]
    x, *_, code, iterations, residual = run(problems, method="94lvi", **{**PAPER, "max_iterations": 3})
    assert (code == MAX_ITERATIONS).all()
    assert (iterations == 3).all()
    assert (residual > 1e-5).all()
    for k, problem in enumerate(problems):
        assert ((problem.lb <= x[k]) & (x[k] <= problem.ub)).all()


def test_the_engine_can_be_chosen_by_name(mixed, answers):
    parts = dict(zip(PARTS, stacked([one.problem for one in mixed]), strict=True))
    found = dtrnn.solve_batch(**parts, engine="jax")
    assert found.x == pytest.approx(answers[0], abs=1e-12)
    assert found.claim(0) is Claim.SOLVED


def test_jax_stays_in_single_precision_for_everybody_else(mixed):
    import jax
    import jax.numpy as jnp

    before = jax.config.jax_enable_x64
    assert run([mixed[0].problem])[0].dtype == np.float64
    assert jax.config.jax_enable_x64 == before
    assert jnp.zeros(1).dtype == (jnp.float64 if before else jnp.float32)


def test_a_missing_jax_is_named_with_its_remedy():
    code = (
        "import sys; sys.modules['jax'] = None\n"
        "from ftqp.core.errors import MissingPackage\n"
        "from ftqp.qp import dtrnn\n"
        "try: dtrnn.solve_batch([[1.0]], [0.0], engine='jax')\n"
        "except MissingPackage as error: sys.stdout.write(str(error))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert remedy_for_extra("gpu") in done.stdout, done.stderr
