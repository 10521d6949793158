"""Maps of a workspace for failures that nobody is told of, of planar arms and in space."""

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
def tasks(arm, panda):
    """A planar map, whose starts lie on traced self-motions, and one of the positions of a Panda."""
    goal = panda.pose(panda.neutral)[:3, 3]
    return {
        "planar": workspace_task(arm, GOAL, configurations=12, steps=20),
        "panda": workspace_task(panda, goal, grid=9, configurations=24, steps=20, instants=2),
    }


@pytest.mark.parametrize(("name", "at"), [("planar", [700, 701, 703]), ("panda", [20, 21, 30])])
def test_any_part_is_computed_alone_and_by_a_task_that_was_sent(tasks, name, at):
    task = tasks[name]
    some = points(task)[at]
    whole = map_chunk(task, some)
    parts = [map_chunk(pickle.loads(pickle.dumps(task)), point) for point in some]
    for what, value in whole.items():
        assert np.array_equal(value, np.concatenate([part[what] for part in parts]), equal_nan=True)
    assert whole["runs"].sum() > 80 and whole["R100"].shape == (3, len(task.joints) + 1)


@pytest.mark.parametrize(("name", "at"), [("planar", slice(None, None, 40)), ("panda", slice(20, 26))])
def test_share_with_all_is_at_most_the_mean_and_any_joint_at_most_each(tasks, name, at):
    found = map_chunk(tasks[name], points(tasks[name])[at])
    said = found["configurations"] > 0
    assert said.any() and (found["R100"][said] <= found["Ravg"][said] + 1e-9).all()
    least = found["Ravg"][said, :-1].min(axis=1, keepdims=True)
    assert (found["Ravg"][said, -1:] <= least + 1e-9).all()


def test_measures_do_not_depend_on_the_size_of_the_arm(tasks):
    large = ftqp.robots.load("planar", lengths=(2.5, 2.5, 2.5), continuous=True)
    other = workspace_task(large, (3.75, 3.75), configurations=12, steps=20)
    some = points(tasks["planar"])[::97]
    one, two = map_chunk(tasks["planar"], some), map_chunk(other, 2.5 * some)
    for name in ("Ravg", "Favg"):
        np.testing.assert_allclose(one[name], two[name], atol=0.5)


def test_failures_in_range_that_miss_the_goal_are_found():
    """A second link longer than the third puts sinks into the range."""
    odd = ftqp.robots.load("planar", lengths=(1, 1.2, 0.8), continuous=True)
    task = workspace_task(odd, (1.5, 0.6), configurations=12, steps=25, instants=25)
    found = map_chunk(task, points(task)[::61])
    assert found["F100"][:, 0].min() < 90.0 and found["Cavg"].min() >= 0.0


def test_arms_of_more_joints_are_mapped():
    four = ftqp.robots.load("planar", lengths=(1.0, 0.8, 0.6, 0.5), continuous=True)
    task = workspace_task(four, (1.2, 0.8), configurations=20, steps=10)
    found = map_chunk(task, np.array([[0.5, -1.0, 0.0], [5.0, 5.0, 0.0]]))
    assert 10 < found["configurations"][0] <= 20 and found["configurations"][1] == 0
    assert found["R100"].shape == (2, 5) and np.isnan(found["R100"][1]).all()
    assert (found["Ravg"][0] > 0.0).all()


def test_a_map_without_simulated_failures_says_nothing_of_what_they_end_in(arm):
    found = map_chunk(
        workspace_task(arm, GOAL, configurations=4, steps=5, instants=0), np.array([1.0, 1.0, 0.0])
    )
    assert found["runs"] == 0 and (found["Ravg"] > 0.0).all()
    assert np.isnan(found["Favg"]).all() and np.isnan(found["Cavg"]).all()


def test_report_says_what_was_counted(arm):
    report = workspace(arm, GOAL, grid=6, configurations=4, steps=5)
    table = report.table()
    assert "R100" in table and "any" in table and f"{len(report.points)} points" in table


def test_map_of_poses_has_a_report(panda):
    report = workspace(
        panda, panda.pose(panda.neutral), rows="pose", grid=5, configurations=12, steps=10, instants=1
    )
    mean = np.nansum(report.R100 * report.configurations[:, None], axis=0) / report.configurations.sum()
    assert report.points.shape[1] == 3 and "unresolved" in report.table() and (mean <= 100.0).all()
