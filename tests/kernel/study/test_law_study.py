"""Runs and lines of any arm: against the planar kernels, and against motions followed one by one."""

import numpy as np
import pytest

import ftqp
from ftqp.analysis import outcome
from ftqp.analysis.goals import goal_study
from ftqp.kernel.entry.law_study import LawStudy
from ftqp.kernel.entry.planar_study import PlanarStudy
from ftqp.kernel.layout.endings import Ending

GOAL = np.array([1.2, 0.9])
W = np.array([[2.0, 0.3, 0.0], [0.3, 1.0, -0.2], [0.0, -0.2, 0.7]])


@pytest.fixture(scope="module")
def both():
    """The same planar arm, in lanes and as any arm."""
    arm = ftqp.robots.load("planar", lengths=(1.0, 1.0, 1.0), continuous=True)
    M = np.linalg.inv(W)
    return PlanarStudy(np.ones(3), M, GOAL), LawStudy(goal_study(arm, GOAL, "position").free, M, 1.0)


def test_runs_end_as_those_of_planar_arms(both):
    planar, general = both
    rng = np.random.default_rng(6)
    starts, locked = rng.uniform(-np.pi, np.pi, (300, 3)), rng.integers(0, 3, 300)
    endings, ends, _ = planar.runs(starts, 1 << locked)
    found, others, sizes = general.runs(starts, locked)
    said = (found != Ending.UNRESOLVED) & (endings != Ending.UNRESOLVED)
    assert said.mean() > 0.97 and np.array_equal(found[said], endings[said])
    rest = said & (endings <= Ending.ERRONEOUS)
    tip, other = (np.exp(1j * np.cumsum(q[rest], axis=1)).sum(axis=1) for q in (ends, others))
    assert np.abs(tip - other).max() < 1e-6
    assert sizes[rest] == pytest.approx(np.abs(other - complex(*GOAL)), abs=1e-9)
    assert {Ending.CORRECT, Ending.ERRONEOUS} <= set(found)


def test_lines_are_those_of_planar_arms(both):
    planar, general = both
    start = np.array([[0.4, 0.9, 1.3]])
    whole = [[((-np.pi, np.pi),)] * 3]
    _, _, expected, _ = planar.lines(start, 20, whole, by_joints=False, keep=True)
    tip = np.exp(1j * np.cumsum(start[0])).sum()
    poses = np.tile(np.eye(4), (21, 1, 1))
    poses[:, :2, 3] = np.linspace([tip.real, tip.imag], GOAL, 21)
    q, done = general.lines(start, poses, (GOAL - [tip.real, tip.imag]) / 20)
    assert done[0] == 20 and np.abs(q - expected).max() < 1e-6


def test_a_line_through_a_singularity_is_said_to_have_failed():
    arm = ftqp.robots.load("planar", lengths=(1.0, 1.0, 1.0), continuous=True)
    law = LawStudy(goal_study(arm, GOAL, "position").free, np.eye(3), 1.0)
    poses = np.tile(np.eye(4), (11, 1, 1))
    poses[:, 0, 3] = np.linspace(2.5, 3.5, 11)
    bent = np.arccos((2.5 - 1.0) / 2.0)
    q, done = law.lines(np.array([[bent, -bent, -bent]]), poses, np.array([0.1, 0.0]))
    assert 0 < done[0] < 10 and np.isnan(q[0, -1]).all()


@pytest.mark.parametrize("rows", ["pose", "position"])
def test_runs_of_an_arm_in_space_end_as_motions_that_are_followed(rows):
    panda = ftqp.robots.load("panda")
    T = panda.pose(panda.neutral + 0.3 * np.array([1, -1, 0.5, 0.3, 0.2, 0.5, 1]))
    goal = T if rows == "pose" else T[:3, 3]
    law = LawStudy(goal_study(panda, goal, rows).free, np.eye(7), 6.0 * panda.length / 7)
    rng = np.random.default_rng(0)
    starts, locked = panda.neutral + 0.6 * rng.normal(size=(24, 7)), rng.integers(0, 7, 24)
    endings, ends, sizes = law.runs(starts, locked)
    said = endings != Ending.UNRESOLVED
    assert said.mean() > 0.95
    for k in np.flatnonzero(said):
        found = outcome(panda, goal, starts[k], int(locked[k]), rows=rows)
        assert found.kind == Ending(int(endings[k])).name.lower()
        assert sizes[k] == pytest.approx(found.error, abs=1e-6)
        assert ends[k, locked[k]] == starts[k, locked[k]]


@pytest.mark.parametrize(
    ("rows", "ending", "least"), [("position", Ending.ERRONEOUS, 10), ("pose", Ending.SINGULAR, 5)]
)
def test_curves_of_rests_and_singular_ends_are_told_as_they_are_one_by_one(rows, ending, least):
    panda = ftqp.robots.load("panda")
    T = panda.pose(panda.neutral + 0.3 * np.array([1, -1, 0.5, 0.3, 0.2, 0.5, 1]))
    goal = T if rows == "pose" else T[:3, 3]
    law = LawStudy(goal_study(panda, goal, rows).free, np.eye(7), 6.0 * panda.length / 7)
    rng = np.random.default_rng(3)
    starts, locked = panda.neutral + 0.8 * rng.normal(size=(500, 7)), rng.integers(0, 7, 500)
    endings, _, sizes = law.runs(starts, locked)
    assert (endings == Ending.UNRESOLVED).mean() < 0.06
    such = np.flatnonzero(endings == ending)
    assert len(such) >= least
    for k in such[:4]:
        found = outcome(panda, goal, starts[k], int(locked[k]), rows=rows)
        assert found.kind == ending.name.lower()
        assert sizes[k] == pytest.approx(found.error, abs=1e-4)
