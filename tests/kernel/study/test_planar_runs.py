"""Runs of planar arms after failures: against a general integrator, in every seat, with any weights."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ftqp.kernel.entry.planar_study import PlanarStudy
from ftqp.kernel.layout.endings import Ending

LINK = np.array([1.1, 0.8, 1.1])
GOAL = np.array([1.2, 0.9])
W = np.array([[2.0, 0.3, 0.0], [0.3, 1.0, -0.2], [0.0, -0.2, 0.7]])


def law(q, link, goal, M, locked, gain=1.0, v_max=np.inf):
    """v = I_S G kappa e, as in the theory, by numpy."""
    p = np.cumsum((link * np.exp(1j * np.cumsum(q)))[::-1])[::-1]
    J = np.array([-p.imag, p.real])
    e = goal - np.array([p[0].real, p[0].imag])
    size = np.linalg.norm(e)
    v = M @ J.T @ np.linalg.solve(J @ M @ J.T, min(gain, v_max / max(size, 1e-300)) * e)
    v[list(locked)] = 0.0
    return v


def end_of(q, T, *args):
    return solve_ivp(lambda t, q: law(q, *args), (0.0, T), q, rtol=1e-10, atol=1e-10, method="LSODA").y[:, -1]


@pytest.fixture(scope="module")
def study():
    return PlanarStudy(LINK, np.linalg.inv(W), GOAL)


def test_ends_are_those_of_a_general_integrator_in_real_time(study):
    rng = np.random.default_rng(4)
    starts = rng.uniform(-np.pi, np.pi, (24, 3))
    locked = rng.integers(0, 3, 24)
    endings, ends, _ = study.runs(starts, 1 << locked, tolerance=1e-8)
    checked = 0
    for q, i, ending, end in zip(starts, locked, endings, ends, strict=True):
        if ending > Ending.ERRONEOUS:
            continue
        late = end_of(q, 400.0, LINK, GOAL, np.linalg.inv(W), (i,))
        tip, found = (np.exp(1j * np.cumsum(x)) @ LINK for x in (late, end))
        assert abs(tip - found) < 1e-3, (q, i)
        assert (abs(found - complex(*GOAL)) < 1e-6) == (ending == Ending.CORRECT)
        checked += 1
    assert checked > 18


def test_a_run_is_the_same_in_every_seat_and_company(study):
    rng = np.random.default_rng(5)
    starts, locked = rng.uniform(-np.pi, np.pi, (41, 3)), 1 << rng.integers(0, 3, 41)
    endings, ends, facts = study.runs(starts, locked)
    for k in (0, 7, 20, 40):
        one = study.runs(starts[k : k + 1], locked[k : k + 1])
        assert one[0][0] == endings[k] and np.array_equal(one[1][0], ends[k])
        assert np.array_equal(one[2][0], facts[k])
    order = rng.permutation(41)
    again = study.runs(starts[order], locked[order])
    assert np.array_equal(again[0], endings[order]) and np.array_equal(again[1], ends[order])


def test_locked_joints_do_not_move_and_many_may_be_locked(study):
    start = np.array([[0.4, -0.9, 1.3]])
    _, ends, _ = study.runs(start, np.array([0b101]))
    assert ends[0, 0] == start[0, 0] and ends[0, 2] == start[0, 2] and ends[0, 1] != start[0, 1]
    endings, ends, _ = study.runs(start, np.array([0]))
    assert endings[0] == Ending.CORRECT


def test_time_of_success_is_that_of_the_law_with_gain_and_speed_limit(study):
    start, M = np.array([0.4, -0.9, 1.3]), np.linalg.inv(W)
    gain, v_max = 2.0, 0.4
    _, _, facts = study.runs(
        start[None], np.array([2]), tolerance=1e-8, horizon=50.0, success=0.01, gain=gain, v_max=v_max
    )

    def near(t, q):
        return abs(np.exp(1j * np.cumsum(q)) @ LINK - complex(*GOAL)) - 0.01

    near.terminal = True
    args = (LINK, GOAL, M, (1,), gain, v_max)
    expected = solve_ivp(lambda t, q: law(q, *args), (0, 50), start, rtol=1e-9, atol=1e-10, events=near)
    assert facts[0, 1] == pytest.approx(expected.t_events[0][0], rel=2e-3)


def test_creeping_along_a_nearly_singular_curve_ends_at_the_goal():
    study = PlanarStudy(np.ones(3), np.eye(3), np.array([1.5, 1.5]))
    starts = np.deg2rad([[-153.985, -0.01, 87.875], [-54.028, 0.354, -155.163], [-154.43, -1.153, 163.427]])
    endings, _, facts = study.runs(starts, np.full(3, 2))
    assert (endings == Ending.CORRECT).all() and (facts[:, 2] > 400).all()
