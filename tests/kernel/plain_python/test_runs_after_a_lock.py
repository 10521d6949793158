"""Where an arm ends after a lock that nobody was told of: by both kernels, and by their stiff methods."""

import numpy as np
import pytest

import ftqp
from ftqp.analysis.goals import goal_study
from ftqp.kernel.entry.law_study import LawStudy
from ftqp.kernel.entry.planar_study import PlanarStudy
from ftqp.kernel.layout.endings import Ending
from ftqp.kernel.study import planar_runs, planar_stiff, spatial_rest, spatial_runs, spatial_stiff

GOALS = {"inside": (1.2, 0.9), "out of reach": (4.0, 1.0), "near the base": (0.5, 0.1)}
STARTS, LOCKED = {}, {}
for joints in (3, 4):
    rng = np.random.default_rng(6)
    STARTS[joints] = rng.uniform(-np.pi, np.pi, (200, joints))
    LOCKED[joints] = rng.integers(0, joints, 200)


def law(q, goal, lengths):
    """I_S G e before the locked joint is taken out, and J, by numpy."""
    p = np.cumsum((lengths * np.exp(1j * np.cumsum(q)))[::-1])[::-1]
    J = np.array([-p.imag, p.real])
    return J.T @ np.linalg.solve(J @ J.T, goal - np.array([p[0].real, p[0].imag])), J


def general(goal, joints):
    arm = ftqp.robots.load("planar", lengths=(1.0,) * joints, continuous=True)
    return LawStudy(goal_study(arm, np.array(goal), "position").free, np.eye(joints), 1.0)


def assert_ends(ending, q, start, locked, goal):
    """What an ending says, by numpy."""
    others = np.arange(len(q)) != locked
    assert np.allclose(np.exp(1j * q[~others]), np.exp(1j * start[~others]), atol=1e-12)
    miss = abs(np.exp(1j * np.cumsum(q)).sum() - complex(*goal))
    assert (miss < 1e-6) == (ending == Ending.CORRECT)
    v, J = law(q, goal, np.ones(len(q)))
    if ending == Ending.ERRONEOUS:
        assert np.abs(v[others]).max() < 1e-6, "it rests"
        step = 1e-6 * np.eye(len(q))
        slopes = np.array([law(q + d, goal, 1.0)[0] - law(q - d, goal, 1.0)[0] for d in step]).T / 2e-6
        assert np.linalg.eigvals(slopes[np.ix_(others, others)]).real.max() < 1e-5, "and is not left"
    elif ending == Ending.SINGULAR:
        assert np.linalg.svd(J, compute_uv=False)[1] < 1e-4


INSIDE = [Ending.CORRECT, Ending.CORRECT, Ending.ERRONEOUS, Ending.ERRONEOUS]
NEAR = [Ending.CORRECT, Ending.ERRONEOUS]
OUT = [Ending.ERRONEOUS, Ending.ERRONEOUS, Ending.SINGULAR, Ending.SINGULAR]


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of trial steps that are not taken
@pytest.mark.parametrize(
    ("goal", "which", "expected"),
    [
        pytest.param("inside", [0, 2, 1, 3], INSIDE, marks=pytest.mark.slow),
        pytest.param("out of reach", [0, 1, 21, 56], OUT, marks=pytest.mark.slow),
        pytest.param("near the base", [3, 5], NEAR, marks=pytest.mark.slow),
        ("inside", [0], INSIDE[:1]),
    ],
)
def test_runs_of_three_links_end_alike_by_every_method(goal, which, expected, monkeypatch):
    starts, locked = STARTS[3][which], LOCKED[3][which]
    planar = PlanarStudy(np.ones(3), np.eye(3), np.array(GOALS[goal]))
    said = [planar.runs(starts, 1 << locked)[:2], general(GOALS[goal], 3).runs(starts, locked)[:2]]
    monkeypatch.setattr(planar_runs, "STIFF", 0)
    monkeypatch.setattr(spatial_runs, "STEPS", 4)
    said.append(planar.runs(starts, 1 << locked)[:2])
    said.append(general(GOALS[goal], 3).runs(starts[::2], locked[::2])[:2])
    for endings, ends in said:
        at = slice(None) if len(endings) == len(starts) else slice(None, None, 2)
        assert endings.tolist() == expected[at]
        for ending, q, start, i in zip(endings, ends, starts[at], locked[at], strict=True):
            assert_ends(ending, q, start, i, GOALS[goal])


@pytest.mark.slow
def test_a_run_that_never_rests_has_no_end():
    """Three of those near the base go round for good, by both kernels; 60 rad are taken for that."""
    starts, locked = STARTS[3][[0, 29]], LOCKED[3][[0, 29]]
    planar = PlanarStudy(np.ones(3), np.eye(3), np.array(GOALS["near the base"]))
    endings, _, facts = planar.runs(starts, 1 << locked)
    assert endings.tolist() == [Ending.NONE] * 2 and (facts[:, 2] > planar_runs.STIFF).any()
    assert general(GOALS["near the base"], 3).runs(starts[:1], locked[:1])[0] == [Ending.NONE]


def test_a_way_that_is_too_long_and_steps_that_are_too_many_end_a_run(monkeypatch):
    start, locked, goal = STARTS[3][[0]], LOCKED[3][[0]], GOALS["inside"]
    planar = PlanarStudy(np.ones(3), np.eye(3), np.array(goal))
    for module in (planar_runs, planar_stiff, spatial_rest):
        monkeypatch.setattr(module, "LONG_WAY", 0.05)
    assert planar.runs(start, 1 << locked)[0] == [Ending.NONE]
    assert general(goal, 3).runs(start, locked)[0] == [Ending.NONE]
    monkeypatch.setattr(planar_runs, "LONG_WAY", 60.0)
    monkeypatch.setattr(planar_runs, "STIFF", 0)
    monkeypatch.setattr(spatial_runs, "STEPS", 0)
    assert planar.runs(start, 1 << locked)[0] == [Ending.NONE]
    monkeypatch.setattr(planar_stiff, "STEPS", 3)
    monkeypatch.setattr(spatial_stiff, "STEPS", 3)
    for module in (planar_stiff, spatial_rest):
        monkeypatch.setattr(module, "LONG_WAY", 60.0)
    endings, ends, _ = planar.runs(start, 1 << locked)
    others, far, sizes = general(goal, 3).runs(start, locked)
    assert endings == others == [Ending.UNRESOLVED]
    for q in (ends[0], far[0]):  # where it was given up: on its way
        assert 0.0 < np.abs(q - start[0]).max() < 1.0
    assert sizes[0] == pytest.approx(abs(np.exp(1j * np.cumsum(far[0])).sum() - complex(*goal)), abs=1e-9)


@pytest.mark.parametrize(
    ("goal", "which", "ending"),
    [
        ((3.8, 0.5), 0, Ending.CORRECT),
        ((3.8, 0.5), 1, Ending.ERRONEOUS),
        pytest.param((5.0, 0.5), 8, Ending.SINGULAR, marks=pytest.mark.slow),
    ],
)
def test_four_links_end_at_the_goal_on_a_curve_of_rests_or_stretched(goal, which, ending):
    start, locked = STARTS[4][[which]], LOCKED[4][[which]]
    endings, ends, _ = general(goal, 4).runs(start, locked)
    assert endings == [ending]
    assert_ends(ending, ends[0], start[0], locked[0], goal)


def test_a_run_that_counts_by_its_time_is_correct_if_it_arrives_by_then():
    start, locked = STARTS[3][[0, 2]], LOCKED[3][[0, 2]]
    planar = PlanarStudy(np.ones(3), np.eye(3), np.array(GOALS["inside"]))
    endings, _, facts = planar.runs(start, 1 << locked, horizon=50.0, success=0.01)
    assert endings.tolist() == [Ending.CORRECT] * 2
    last = facts[:, 1].max()
    early = planar.runs(start, 1 << locked, horizon=0.99 * last, success=0.01)
    assert sorted(early[0].tolist()) == [Ending.CORRECT, Ending.UNRESOLVED]
    assert early[0][facts[:, 1].argmax()] == Ending.UNRESOLVED


@pytest.mark.parametrize("n", [2, 3, 5])
def test_slopes_are_those_of_differences_and_stability_that_of_all_eigenvalues(n):
    from ftqp.kernel.entry.session import rooms
    from ftqp.kernel.layout.planar_memory import planar_dtype
    from ftqp.kernel.study.planar_rest import all_left, slopes

    rng = np.random.default_rng(n)
    P = rooms(np.zeros(1, planar_dtype(n)))
    B = rng.normal(size=(n, n))
    P.link[:], P.M[:], P.goal[:] = rng.uniform(0.5, 1.5, n), B @ B.T + np.eye(n), (0.7, -0.4)
    free, q = np.ones(8 * n), rng.uniform(-3.0, 3.0, n)
    free[8:16] = 0.0

    def at(q):
        _, det, _ = slopes(P, np.repeat(q, 8), free)
        return P.F.copy(), det

    at(q)
    slope, det_slope = P.slope.copy(), P.det_slope.copy()
    for l in range(n):
        h = 1e-6 * np.eye(n)[l]
        (a, da), (b, db) = at(q + h), at(q - h)
        moves = 0.0 if l == 1 else 1.0
        assert np.allclose(slope[:, l], moves * (a - b) / 2e-6, rtol=1e-7, atol=1e-7)
        assert np.isclose(det_slope[l], moves * (da - db) / 2e-6, rtol=1e-7, atol=1e-7)
    said = set()
    for k in range(40):
        S = rng.normal(size=(n, n)) - rng.uniform(0.0, 3.0) * np.eye(n)
        S *= 0.0 if k == 0 else 1.0
        S[1], S[:, 1] = 0.0, 0.0
        P.slope[:] = S
        left = np.linalg.eigvals(np.delete(np.delete(S, 1, 0), 1, 1)).real.max() < 0.0
        assert all_left(P, free) == left
        said.add(bool(left))
    assert said == {True, False}
