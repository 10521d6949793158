"""Maps of arms in space."""

import pickle

import numpy as np
import pytest

import ftqp
from ftqp.analysis import map_chunk, points, spatial_task, workspace
from ftqp.core.errors import InputError


@pytest.fixture(scope="module")
def panda():
    return ftqp.robots.load("panda")


@pytest.fixture(scope="module")
def task(panda):
    goal = panda.pose(panda.neutral)[:3, 3]
    return spatial_task(panda, goal, "position", grid=9, configurations=24, steps=20, instants=2)


def test_any_part_is_computed_alone_and_by_a_task_that_was_sent(task):
    some = points(task)[[20, 21, 30]]
    whole = map_chunk(task, some)
    parts = [map_chunk(pickle.loads(pickle.dumps(task)), point[None]) for point in some]
    for name, value in whole.items():
        assert np.array_equal(value, np.concatenate([part[name] for part in parts]), equal_nan=True)
    assert whole["runs"].sum() > 100 and whole["R100"].shape == (3, 8)


def test_share_with_all_is_at_most_the_mean_and_nobody_starts_outside_the_limits(panda, task):
    found = map_chunk(task, points(task)[20:26])
    said = found["configurations"] > 0
    assert said.any()
    assert (found["R100"][said] <= found["Ravg"][said] + 1e-9).all()
    assert (found["Ravg"][said, 7:] <= found["Ravg"][said, :7].min(axis=1, keepdims=True) + 1e-9).all()


def test_map_of_poses_has_a_report_with_intervals(panda):
    report = workspace(
        panda, panda.pose(panda.neutral), rows="pose", grid=5, configurations=12, steps=10, instants=1
    )
    low, high = report.interval("R100").T
    assert (low <= high).all() and (low >= -1e-9).all() and (high <= 100.0).all()
    mean = np.nansum(report.R100 * report.configurations[:, None], axis=0) / report.configurations.sum()
    assert report.points.shape[1] == 3 and "unresolved" in report.table() and (mean <= 100.0).all()
    with pytest.raises(InputError, match="is not a share of configurations"):
        report.interval("Ravg")
