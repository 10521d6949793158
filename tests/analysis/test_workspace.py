"""Maps of a workspace for failures that nobody is told of."""

import pickle

import numpy as np
import pytest

import ftqp
from ftqp.analysis import map_chunk, points, workspace, workspace_task

GOAL = (1.5, 1.5)


@pytest.fixture(scope="module")
def arm():
    return ftqp.robots.load("planar", lengths=(1, 1, 1), continuous=True)


@pytest.fixture(scope="module")
def task(arm):
    return workspace_task(arm, GOAL, configurations=12, steps=20)


def same(one, other):
    return all(np.array_equal(one[name], other[name], equal_nan=True) for name in one)


def test_result_does_not_depend_on_how_points_are_cut_into_chunks(arm):
    task = workspace_task(arm, GOAL, configurations=7, steps=9, screen=False)
    some = points(task)[700:704]
    whole = map_chunk(task, some)
    parts = [map_chunk(pickle.loads(pickle.dumps(task)), point) for point in some]
    assert same(whole, {name: np.concatenate([part[name] for part in parts]) for name in whole})
    assert whole["runs"].sum() > 300


def test_share_with_all_is_at_most_the_mean_and_any_joint_at_most_each(task):
    found = map_chunk(task, points(task)[::40])
    assert (found["R100"] <= found["Ravg"] + 1e-9).all()
    assert (found["Ravg"][:, 3:] <= found["Ravg"][:, :3].min(axis=1, keepdims=True) + 1e-9).all()
    assert np.allclose(found["Cavg"], found["Ravg"])  # screened: every failure in range ends at the goal


def test_measures_do_not_depend_on_the_size_of_the_arm(arm, task):
    large = ftqp.robots.load("planar", lengths=(2.5, 2.5, 2.5), continuous=True)
    other = workspace_task(large, (3.75, 3.75), configurations=12, steps=20)
    some = points(task)[::97]
    assert same(map_chunk(task, some), map_chunk(other, 2.5 * some))


def test_lines_are_those_of_the_least_rates(arm):
    """Against an integration of v = J^+ (goal - tip) by scipy, which knows no correction."""
    from scipy.integrate import solve_ivp

    task = workspace_task(arm, GOAL, configurations=1, steps=4, screen=False)
    start = np.array([-1.38, 0.785, 0.7465])

    def rates(s, q):
        psi = np.cumsum(q)
        p = np.cumsum(np.exp(1j * psi)[::-1])[::-1]
        J = np.array([-p.imag, p.real])
        return np.linalg.pinv(J) @ line

    tip = np.exp(1j * np.cumsum(start)).sum()
    line = np.array([GOAL[0] - tip.real, GOAL[1] - tip.imag])
    expected = solve_ivp(rates, (0.0, 1.0), start, rtol=1e-11, atol=1e-11).y[:, -1]
    _, _, q, _ = task.study().lines(start[None], 100, task.box, keep=True)
    assert q[0, -1] == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(
    ("lengths", "goal", "W"),
    [
        ((1, 1.2, 0.8), (1.5, 0.6), None),
        pytest.param((1, 1.4, 0.5), (0.6, 0.3), None, marks=pytest.mark.slow),
        ((1, 1, 1), (1.5, 1.5), [[1.0, -2.5, 0.0], [-2.5, 9.0, 0.0], [0.0, 0.0, 1.0]]),
    ],
)
def test_screened_and_simulated_maps_agree_where_failures_in_range_miss_the_goal(lengths, goal, W):
    """A second link longer than the third, or weights that are not diagonal, put sinks into the range."""
    arm = ftqp.robots.load("planar", lengths=lengths, continuous=True)
    options = {"configurations": 12, "steps": 25, "W": W}
    screened = workspace_task(arm, goal, **options)
    some = points(screened)[::61]
    one = map_chunk(screened, some)
    other = map_chunk(workspace_task(arm, goal, screen=False, **options), some)
    assert other["F100"][:, 0].min() < 90.0 and one["runs"].sum() < 0.5 * other["runs"].sum()
    assert np.abs(one["F100"].mean(axis=0) - other["F100"].mean(axis=0)).max() < 0.1
    assert np.abs(one["Favg"].mean(axis=0) - other["Favg"].mean(axis=0)).max() < 0.1


def test_arms_of_more_joints_are_mapped(arm):
    four = ftqp.robots.load("planar", lengths=(1.0, 0.8, 0.6, 0.5), continuous=True)
    task = workspace_task(four, (1.2, 0.8), configurations=20, steps=10, screen=False)
    found = map_chunk(task, np.array([[0.5, -1.0], [5.0, 5.0]]))
    assert found["configurations"].tolist() == [20, 0]
    assert found["R100"].shape == (2, 5) and np.isnan(found["R100"][1]).all()
    assert (found["Ravg"][0] > 0.0).all()


def test_report_says_what_was_counted_and_is_saved(arm, tmp_path):
    report = workspace(arm, GOAL, grid=6, configurations=4, steps=5)
    table = report.table()
    assert "R100" in table and "any" in table and f"{len(report.points)} points" in table
    report.save(tmp_path / "map.npz")
    with np.load(tmp_path / "map.npz") as saved:
        assert np.array_equal(saved["R100"], report.R100) and saved["joints"].tolist() == ["j1", "j2", "j3"]
