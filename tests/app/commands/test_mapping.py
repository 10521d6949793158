"""The command ``ftqp workspace``: maps are computed, continued, summed up and drawn."""

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from tests.app.conftest import invoke

from ftqp.analysis.workspace_map import map_chunk, points
from ftqp.app.commands.mapping import load_study
from ftqp.app.scenario.document import bundled

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


asked = partial(invoke, "workspace")


def test_a_map_is_computed_summed_up_and_drawn(tmp_path):
    """By two processes, which come to what one computes."""
    file = tmp_path / "small.toml"
    file.write_text(SMALL, encoding="utf-8")
    result = asked(file, "--out", tmp_path / "out", "--jobs", 2, "--json")
    assert result.exit_code == 0, result.output
    facts, study = json.loads(result.stdout), load_study(str(file))
    found = map_chunk(study.task, points(study.task))
    assert facts["starts"] == len(points(study.task))
    assert facts["means"]["R100"]["any"] == pytest.approx(np.nanmean(found["R100"][:, 3]), abs=1e-9)
    assert facts == json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert [Path(file).name for file in facts["figures"]] == ["R.png", "F.png", "C.png"]
    assert load_study(str(tmp_path / "out" / "study.toml")).key == study.key


@pytest.mark.parametrize(
    "name", [name if name.endswith("sample") else pytest.param(name, marks=pytest.mark.slow)
             for name in sorted(bundled("study"))],
)  # fmt: skip
def test_bundled_studies_are_valid(name: str) -> None:
    assert len(load_study(name).places) >= 60


def test_bundled_studies_are_listed() -> None:
    assert set(json.loads(asked("--json").stdout)["studies"]) == set(bundled("study"))
