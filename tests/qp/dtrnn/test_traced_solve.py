"""The network as a solver of its own: any QP, the trace of its convergence, starts, modes, batches."""

import numpy as np
import pytest
from tests.qp.planted import infeasible, planted

from ftqp import InputError
from ftqp.qp import QP, Claim, SolveStatus, accepted
from ftqp.qp import dtrnn as network

PAPER_ERROR = 5e-3
"""What |e| <= 1e-5 leaves of x on these well-conditioned problems."""


def case(seed=0, n=7, m=3, p=4, **options):
    return planted(np.random.default_rng(seed), n, m, p, **options)


@pytest.mark.parametrize("method", network.METHODS)
@pytest.mark.parametrize("mode", network.MODES)
def test_every_method_solves_a_qp_in_both_modes(method, mode):
    one = case(1)
    found = network.solve(one.problem, method, mode=mode)
    assert found.claim is Claim.SOLVED and found.backend == "dtrnn"
    assert mode == "paper" or found.status is SolveStatus.SOLVED
    np.testing.assert_allclose(found.x, one.x, rtol=0, atol=1e-8 if mode == "product" else PAPER_ERROR)
    assert found.residual <= 1e-5 and found.iterations > 0 and found.trace is None
    assert (found.x >= one.problem.lb).all() and (found.x <= one.problem.ub).all()


def test_a_start_at_the_solution_needs_no_iteration_and_one_nearby_needs_few():
    one = case(5)
    found = network.solve(one.problem)
    assert network.solve(one.problem, start=found).iterations == 0
    cold = network.solve(one.problem, "implicit", mode="paper").iterations
    near = network.solve(one.problem, "implicit", mode="paper", start=(found.x, found.y)).iterations
    assert near < cold
    p = one.problem
    moved = QP(p.H, p.g + 1e-3, p.A, p.b, p.C, p.l, p.u, p.lb, p.ub)
    assert network.solve(moved, start=found).iterations == 1


def test_solved_means_small_residuals_in_paper_mode_too():
    """With a loose stopping rule the network claims what the residuals refute."""
    problem = case(1).problem
    loose = network.solve(problem, "94lvi", mode="paper", tolerance=1e-2)
    assert loose.claim is Claim.SOLVED and loose.status is SolveStatus.FAILED
    assert not accepted(problem, loose.residuals, loose.x, loose.y)
    tight = network.solve(problem, "94lvi", mode="paper", tolerance=1e-9)
    assert tight.claim is Claim.SOLVED and tight.status is SolveStatus.SOLVED


@pytest.mark.parametrize("method", network.METHODS)
@pytest.mark.parametrize("mode", network.MODES)
def test_an_infeasible_qp_is_proven_so(method, mode):
    for seed in range(3):
        found = network.solve(infeasible(np.random.default_rng(seed)), method, mode=mode)
        assert found.status is SolveStatus.INFEASIBLE
        assert found.certificate is not None and found.iterations < 1000


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        (dict(method="m4"), "dtrnn.method is 'm4', expected one of implicit, 94lvi, e47"),
        (dict(mode="fast"), "dtrnn.mode is 'fast'"),
        (dict(gamma=2.0), "expected a number below 2"),
        (dict(gamma=-1.0), "dtrnn.gamma"),
        (dict(tolerance=0.0), "dtrnn.tolerance"),
        (dict(scaling="yes"), "dtrnn.scaling is 'yes', expected true or false"),
        (dict(newton=1), "dtrnn.newton is 1, expected true or false"),
        (dict(start=3), "start is a int, expected a Solution or a tuple (x, y)"),
        (dict(start=([1.0], [1.0])), "start x has shape (1,)"),
        (dict(start=([np.nan] * 7, [1.0] * 3)), "start x contains NaN"),
    ],
)
def test_wrong_settings_are_one_clear_sentence(settings, sentence):
    with pytest.raises(InputError) as error:
        network.solve(case().problem, **settings)
    assert sentence in str(error.value) and "\n" not in str(error.value)


def stack(cases):
    names = ("H", "g", "A", "b", "C", "l", "u", "lb", "ub")
    return {name: np.stack([getattr(one.problem, name) for one in cases]) for name in names}


@pytest.mark.parametrize("method", network.METHODS)
def test_a_batch_is_what_each_of_its_problems_is_alone(method):
    cases = [case(k) for k in range(8)]
    many = network.solve_batch(**stack(cases), method=method)
    assert len(many) == 8 and many.x.shape == (8, 7) and many.z.shape == (8, 4)
    for k, one in enumerate(cases):
        alone = network.solve(one.problem, method)
        assert many.claim(k) is alone.claim is Claim.SOLVED
        for part in ("x", "y", "z", "z_box"):
            np.testing.assert_allclose(getattr(many, part)[k], getattr(alone, part), rtol=0, atol=1e-8)
        assert many.iterations[k] == alone.iterations


def test_one_bad_problem_of_a_batch_spoils_no_other():
    parts = stack([case(k) for k in range(6)])
    parts["lb"][1], parts["ub"][1] = 1.0, -1.0
    parts["g"][2, 0] = np.nan
    parts["H"][3] = -np.eye(7)
    bad = infeasible(np.random.default_rng(0))
    for name in parts:
        parts[name][4] = getattr(bad, name)
    many = network.solve_batch(**parts)
    claims = [Claim.SOLVED, Claim.INFEASIBLE, Claim.FAILED, Claim.FAILED, Claim.INFEASIBLE, Claim.SOLVED]
    assert [many.claim(k) for k in range(6)] == claims
    assert np.isnan(many.x[1:5]).all() and np.isfinite(many.x[[0, 5]]).all()
    np.testing.assert_allclose(many.x[5], case(5).x, rtol=0, atol=1e-8)
