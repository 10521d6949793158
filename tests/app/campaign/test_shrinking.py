"""What is left of a scenario that breaks a law: a defect that is planted keeps what shows it, and no more."""

import json
import tomllib

import pytest
from tests.app.conftest import invoke

from ftqp.app.campaign.judged_scenario import broken_laws
from ftqp.app.commands.campaign_shrinking import shrunk
from ftqp.core.errors import ScenarioError
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


def content():
    return {
        "robot": {"name": "panda", "payload": {"mass": 1.0}},
        "faults": [{"joint": 1, "at": 0.123456}, {"joint": 4, "at": 0.5}],
        "path": {"kind": "line", "duration": 3.0},
        "planner": {"dt": 0.01, "scheme": "rmp", "task": {"rows": "pose", "mode": "hard"}},
        "start": {"q": [0.123456, 0.2, 0.3]},
    }


def run(broken, vary=None, **options):
    asked = []

    def counted(tables):
        asked.append(json.loads(json.dumps(tables)))
        return broken(tables)

    return shrunk(content(), vary or {}, counted, **options), asked


def test_what_does_not_matter_is_left_out_and_what_does_is_kept():
    def broken(tables):
        shows = any(fault.get("joint") == 4 for fault in tables.get("faults", ()))
        return ("failed", None) if shows and "path" in tables else None

    found, asked = run(broken)
    assert found.content == {"faults": [{"joint": 4}], "path": {}}
    assert (found.keys, found.keys_before) == (1, 13)
    assert found.tried == len(asked)


def test_numbers_lose_their_digits_as_far_as_the_law_stays_broken():
    found, _ = run(lambda t: ("x", None) if 0.12 <= t.get("start", {}).get("q", [0])[0] <= 0.13 else None)
    assert found.content["start"]["q"] == [0.12, 0.2, 0.3]


def test_another_law_is_not_the_same():
    def broken(tables):
        return ("first", None) if "payload" in tables.get("robot", {}) else ("second", None)

    found, _ = run(broken)
    assert found.content == {"robot": {"payload": {}}}


def test_run_ends_soon_after_the_law_was_broken_and_drawn_values_become_the_first():
    found, _ = run(
        lambda t: ("x", 0.5) if "path" in t and "scheme" in t.get("planner", {}) else None,
        vary={"planner.scheme": ["mvn", "rmp"]},
    )
    assert found.content["simulation"]["duration"] == 0.7
    assert found.content["planner"]["scheme"] == "mvn"


def test_no_more_scenarios_are_run_than_asked_for():
    found, asked = run(lambda t: ("x", None), most=5)
    assert found.tried == len(asked) == 5


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


def test_written_test_passes_once_the_defect_is_mended(tmp_path):
    assert broken_laws(STUDY.partition("[scenario.robot]")[2].join(["[robot]", ""]).partition("[vary]")[0]
                       .replace("scenario.", "")) == {}  # fmt: skip
    with pytest.raises(ScenarioError):
        broken_laws("[robot]\nname = 3")


def test_episode_that_breaks_no_law_has_nothing_to_shrink(tmp_path):
    code, _, errors = shrink(tmp_path, "--shrink", 1, "--out", tmp_path / "small")
    assert code == 2 and "episode 1 of planted breaks no law" in errors
    assert not (tmp_path / "small").exists()
    code, _, errors = shrink(tmp_path, "--shrink", -1)
    assert code == 2 and "episode -1 is none of planted, expected 0 to" in errors
    code, _, errors = shrink(tmp_path, "--shrink", 1, "--replay", 1)
    assert code == 2 and "leave one of them out" in errors
