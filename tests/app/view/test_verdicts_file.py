"""Verdicts of a coverage report, written and read."""

import json

import numpy as np
import pytest

import ftqp
from ftqp.app.run.healthy_motion import healthy_motion
from ftqp.app.scenario.setup import load
from ftqp.app.view.verdicts_file import VERDICTS, read_verdicts, write_verdicts
from ftqp.core.errors import InputError


@pytest.fixture(scope="module")
def report():
    setup = load("planar3-line", ["faults="])
    task, q = healthy_motion(setup)
    return setup, ftqp.analysis.coverage(setup.robot, task, q, stride=200, lock="ramp")


def test_verdicts_come_back_as_they_were(report, tmp_path):
    setup, rep = report
    write_verdicts(tmp_path, rep, setup.name, setup.toml, None)
    found = read_verdicts(tmp_path)
    np.testing.assert_array_equal(found.heat.codes, rep.status)
    np.testing.assert_allclose(found.heat.times, rep.t)
    assert found.heat.joints == rep.names and found.heat.coverage == rep.coverage
    assert (found.name, found.kind, found.settings) == ("planar3-line", "locked", {"mode": "ramp"})
    assert load(str(found.scenario)).robot.name == setup.robot.name
    assert set(np.unique(rep.status)) <= set(found.heat.words) == set(found.heat.colours)


@pytest.mark.parametrize(
    "change",
    [
        {"codes": [[0]]}, {"codes": [[99] * 12] * 3}, {"format": 7}, {"times": ["x"] * 11}, {"codes": None},
        {"coverage": "all"}, None,
    ],
)  # fmt: skip
def test_damaged_verdicts_are_refused_in_one_sentence(report, tmp_path, change):
    setup, rep = report
    write_verdicts(tmp_path, rep, setup.name, setup.toml, None)
    file = tmp_path / VERDICTS
    content = json.loads(file.read_text())
    file.write_text("{" if change is None else json.dumps(content | change))
    with pytest.raises(InputError, match="is not the list of verdicts of a coverage report"):
        read_verdicts(tmp_path)
