"""The command ``ftqp workspace``: maps are computed, continued, summed up and drawn."""

import json
import shutil
import sqlite3
from contextlib import closing
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from tests.app.conftest import invoke

from ftqp.analysis.workspace_map import map_chunk, points
from ftqp.app.commands.mapping import load_study
from ftqp.app.scenario.document import bundled
from ftqp.app.study.results_file import FILE_NAME

SMALL = """
[robot]
name = "planar"
options = { lengths = [1.0, 0.8, 0.6], continuous = true }

[map]
goal = [1.2, 0.9]
grid = 5
configurations = 3
steps = 6
instants = 2
"""


@pytest.fixture
def small(tmp_path: Path) -> Path:
    file = tmp_path / "small.toml"
    file.write_text(SMALL, encoding="utf-8")
    return file


asked = partial(invoke, "workspace")


def rows(folder: Path) -> list[tuple[float, ...]]:
    """Every row of a study without its time and worker."""
    with closing(sqlite3.connect(folder / FILE_NAME)) as connection:
        return [row[:-2] for row in connection.execute("SELECT * FROM results ORDER BY item")]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a map that was computed to its end."""
    folder = tmp_path_factory.mktemp("whole")
    (folder / "small.toml").write_text(SMALL, encoding="utf-8")
    result = asked(folder / "small.toml", "--out", folder / "out", "--jobs", 1, "--json")
    assert result.exit_code == 0, result.output
    (folder / "told.json").write_text(result.stdout, encoding="utf-8")
    return folder


@pytest.fixture
def out(whole: Path, tmp_path: Path) -> Path:
    """A copy of that folder for one test."""
    return Path(shutil.copytree(whole / "out", tmp_path / "out"))


def test_a_map_is_computed_summed_up_and_drawn(whole: Path, small: Path, out: Path) -> None:
    facts = json.loads((whole / "told.json").read_text(encoding="utf-8"))
    study = load_study(str(small))
    found = map_chunk(study.task, points(study.task))
    assert facts["starts"] == len(points(study.task))
    assert facts["means"]["R100"]["any"] == pytest.approx(np.nanmean(found["R100"][:, 3]), abs=1e-9)
    assert facts == json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert [Path(file).name for file in facts["figures"]] == ["R.png", "F.png", "C.png"]
    assert load_study(str(out / "study.toml")).key == study.key


@pytest.mark.slow
def test_a_map_goes_on_where_it_was(small: Path, out: Path) -> None:
    whole = rows(out)
    with closing(sqlite3.connect(out / FILE_NAME)) as connection:
        connection.execute("DELETE FROM results WHERE item % 3 = 1")
        connection.commit()
    result = asked(small, "--out", out, "--jobs", 1, "--json")
    assert json.loads(result.stdout)["computed_now"] == len(range(1, len(whole), 3))
    assert rows(out) == whole


@pytest.mark.slow
def test_processes_compute_the_same_bits(small: Path, tmp_path: Path) -> None:
    assert asked(small, "--out", tmp_path / "one", "--jobs", 1).exit_code == 0
    assert asked(small, "--out", tmp_path / "two", "--jobs", 2).exit_code == 0
    assert rows(tmp_path / "one") == rows(tmp_path / "two")


def test_another_study_does_not_go_on_in_the_folder(small: Path, out: Path) -> None:
    before = rows(out)
    result = asked(small, "--out", out, "--set", "map.steps=7")
    assert result.exit_code == 2
    assert "holds results of another study ('steps = 6' there, 'steps = 7' here)" in result.stderr
    assert rows(out) == before


SPACE = """
[robot]
name = "panda"

[map]
goal = [0.5, 0.0, 0.4]
rows = "position"
grid = 5
configurations = 3
steps = 6
instants = 1
"""


@pytest.mark.slow
def test_a_plane_through_the_space_of_a_panda_is_mapped_and_drawn(tmp_path: Path) -> None:
    file = tmp_path / "space.toml"
    file.write_text(SPACE, encoding="utf-8")
    result = asked(file, "--out", tmp_path / "out", "--json")
    assert result.exit_code == 0, result.output
    facts = json.loads(result.stdout)
    assert set(facts["means"]["C100"]) == {*(f"panda_joint{k}" for k in range(1, 8)), "any"}
    assert 0.0 < facts["means"]["Ravg"]["any"] <= facts["means"]["Ravg"]["panda_joint4"] <= 100.0
    assert len(facts["figures"]) == 3
    assert all(row[2] == 0.0 for row in rows(tmp_path / "out"))  # y of every start
    assert load_study(str(tmp_path / "out" / "study.toml")).key == load_study(str(file)).key


@pytest.mark.parametrize(
    "name", [name if name.endswith("sample") else pytest.param(name, marks=pytest.mark.slow)
             for name in sorted(bundled("study"))],
)  # fmt: skip
def test_bundled_studies_are_valid(name: str) -> None:
    assert len(load_study(name).places) >= 60


def test_bundled_studies_are_listed() -> None:
    assert set(json.loads(asked("--json").stdout)["studies"]) == set(bundled("study"))
