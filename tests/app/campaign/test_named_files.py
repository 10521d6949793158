"""The files of a campaign: found wherever a key names one, and told apart by what they hold."""

import pytest

from ftqp.app.campaign.episode_study import ABSENT, named_files


@pytest.fixture
def folder(tmp_path):
    for name in ("a.urdf", "b.urdf", "way.csv"):
        (tmp_path / name).write_text(name)
    return tmp_path


@pytest.mark.parametrize(
    ("scenario", "vary", "names"),
    [
        ({"robot": {"name": "a.urdf"}, "description": "way.csv"}, {"planner.dt": [0.1]}, []),
        ({"robot": {"urdf": "a.urdf"}, "path": {"file": "way.csv"}}, {}, ["a.urdf", "way.csv"]),
        ({}, {"robot.urdf": ["b.urdf", "a.urdf"]}, ["a.urdf", "b.urdf"]),
        ({}, {"robot": {"one_of": [{"mjcf": "a.urdf"}], "chance": 0.5}}, ["a.urdf"]),
        ({}, {"path.file": {"one_of": ["way.csv"]}}, ["way.csv"]),
        ({"base": {"disturbances": [{"kind": "recorded", "file": "way.csv"}]}}, {}, ["way.csv"]),
        ({"planner": {"plan": "way.csv", "profile": "a.urdf"}}, {}, ["a.urdf", "way.csv"]),
        ({}, {"planner.detector": [{"calibration": "way.csv"}]}, ["way.csv"]),
    ],
)
def test_file_is_found_where_a_key_names_it(folder, scenario, vary, names):
    found = named_files(scenario, vary, folder)
    assert list(found) == names and ABSENT not in found.values()


def test_hash_is_that_of_the_bytes_and_files_that_are_not_there_have_none(folder):
    scenario = {"robot": {"urdf": "a.urdf"}}
    first = named_files(scenario, {}, folder)
    (folder / "a.urdf").write_text("changed")
    assert named_files(scenario, {}, folder) != first
    for name in ("nowhere", ".", "x" * 300, "\0"):
        assert named_files({"robot": {"urdf": name}}, {}, folder) == {name: ABSENT}
