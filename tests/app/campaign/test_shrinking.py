"""What is left of a scenario that breaks a law: a defect that is planted keeps what shows it, and no more."""

import json
import tomllib

import pytest
from tests.app.conftest import invoke

from ftqp.app.campaign.judged_scenario import broken_laws
from ftqp.sim.plants.kinematic_plant import KinematicPlant

STUDY = """
[campaign]
episodes = 4
[scenario.robot]
name = "planar"
[scenario.planner]
noise = { q = 1e-5 }
dt = 0.01
[scenario.path]
kind = "circle"
radius = 0.05123
duration = 0.8
[[scenario.faults]]
kind = "locked"
joint = 2
at = 0.1234
mode = "instant"
[[scenario.faults]]
kind = "degraded"
joint = 1
at = 0.2
velocity = 0.5
[vary]
"planner.level" = { one_of = ["acceleration", "velocity"], weights = [0, 1] }
"planner.scheme" = ["rmp"]
"path.radius" = { uniform = [0.051, 0.052] }
"""


@pytest.fixture
def defect(monkeypatch):
    """A locked joint 2 creeps at the velocity level."""
    advance = KinematicPlant.advance

    def creeping(self, command):
        advance(self, command)
        if 2 in self._faults and not self._holds_acceleration:
            self._q[2] += 1e-5

    monkeypatch.setattr(KinematicPlant, "advance", creeping)
    monkeypatch.setattr(KinematicPlant, "obeys", lambda self, believed: False)


def shrink(tmp_path, *arguments):
    study = tmp_path / "planted.toml"
    study.write_text(STUDY)
    result = invoke("campaign", study, *arguments)
    return result.exit_code, result.stdout, result.stderr


def test_planted_defect_is_shrunk_to_a_scenario_and_a_test_that_fails_until_it_is_mended(tmp_path, defect):
    code, out, errors = shrink(tmp_path, "--shrink", 1, "--out", tmp_path / "small", "--json")
    assert code == 1, errors
    facts = json.loads(out)
    assert facts["law"] == "failed" and facts["keys"] < facts["keys_before"]
    text = (tmp_path / "small" / "scenario.toml").read_text()
    small = tomllib.loads(text)
    assert [fault["joint"] for fault in small["faults"]] == [2]
    assert small["planner"] == {"level": "velocity"}
    assert broken_laws(text).keys() == {"failed"}
    test = {}
    exec(compile((tmp_path / "small" / "test_failed_planted_1.py").read_text(), "test", "exec"), test)
    with pytest.raises(AssertionError):
        test["test_failed_planted_1_holds"]()


def test_episode_that_breaks_no_law_has_nothing_to_shrink(tmp_path):
    code, _, errors = shrink(tmp_path, "--shrink", 1, "--out", tmp_path / "small")
    assert code == 2 and "episode 1 of planted breaks no law" in errors
    assert not (tmp_path / "small").exists()
    code, _, errors = shrink(tmp_path, "--shrink", -1)
    assert code == 2 and "episode -1 is none of planted, expected 0 to" in errors
    code, _, errors = shrink(tmp_path, "--shrink", 1, "--replay", 1)
    assert code == 2 and "leave one of them out" in errors
