"""``ftqp campaign``: a few short episodes, resumed, replayed, judged, refused."""

import json
import signal
import sqlite3
from contextlib import closing

import pytest
from tests.app.conftest import invoke

from ftqp.app.campaign import episode_study
from ftqp.app.commands.viewing import shown
from ftqp.app.run import runs
from ftqp.model import catalog
from ftqp.sim.plants.kinematic_plant import KinematicPlant
from ftqp.sim.session.session_arms import Choice

STUDY = """
[campaign]
seed = 5
episodes = 6
[scenario.robot]
name = "planar"
[scenario.path]
kind = "circle"
radius = 0.05
duration = 0.4
[[scenario.faults]]
kind = "locked"
joint = 0
at = 0.1
[vary]
"faults.0.joint" = { joint = "any" }
"planner.dt" = [0.005, 0.01]
"""


def campaign(*arguments):
    result = invoke("campaign", *arguments)
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture(autouse=True)
def no_figures(monkeypatch):
    monkeypatch.setattr(runs, "_figures", lambda log, folder: ())


@pytest.fixture
def study(tmp_path):
    file = tmp_path / "short.toml"
    file.write_text(STUDY)
    return file


def rows(folder):
    with closing(sqlite3.connect(folder / "results.sqlite")) as connection, connection:
        found = connection.execute("SELECT item, drawn, outcome, ticks FROM results ORDER BY item").fetchall()
    return found


def test_campaign_goes_on_where_it_was_and_counts_each_episode_once(study, tmp_path):
    code, out, errors = campaign(study, "--out", tmp_path / "c", "--set", "campaign.episodes=4", "--json")
    assert code == 0, errors
    first = rows(tmp_path / "c")
    assert json.loads(out)["computed_now"] == 4
    code, out, _ = campaign(study, "--out", tmp_path / "c", "--json")
    facts = json.loads(out)
    assert code == 0 and facts["computed_now"] == 2 and facts["sound"] == facts["episodes"] == 6
    assert facts["bound"] == pytest.approx(1.0 - 0.05 ** (1.0 / 6.0))
    assert rows(tmp_path / "c")[:4] == first
    assert facts["steps"] == sum(row[3] for row in rows(tmp_path / "c"))
    assert sum(value["episodes"] for value in facts["by_key"]["planner.dt"].values()) == 6


def test_any_episode_is_run_alone_by_its_number(study, tmp_path):
    campaign(study, "--out", tmp_path / "c")
    code, out, _ = campaign(study, "--replay", 3, "--out", tmp_path / "r", "--json")
    facts = json.loads(out)
    assert code == 0 and facts["broken"] == []
    assert facts["drawn"] == json.loads(rows(tmp_path / "c")[3][1])
    assert (tmp_path / "r" / "log.npy").exists()
    with shown(Choice(scenario=str(tmp_path / "r"))) as (kind, source):
        assert kind == "replay" and source.stage().duration == pytest.approx(0.4)
        assert source.stage().title == "short-3, a finished run" and source.frame().message == ""
    for number in (-1, 10**9):
        code, _, errors = campaign(study, "--replay", number, "--out", tmp_path / "s")
        assert code == 2 and f"episode {number} is none of short, expected 0 to 999999999" in errors


def test_table_tells_value_by_value(study, tmp_path):
    code, out, _ = campaign(study, "--out", tmp_path / "c", "--table")
    assert code == 0
    assert "6 random episodes" in out and "planner.dt" in out and "0.005" in out
    assert "With 0 of 6 broken, the share" in out and "is below 39 % at 95 %" in out


def test_scenario_that_cannot_be_is_counted_and_exception_is_not_hidden(study, tmp_path, monkeypatch):
    judged = episode_study.EpisodeWork._judged

    def some(self, setup):
        if setup.name == f"short-{first}":
            return 1 / 0
        return judged(self, setup)

    monkeypatch.setattr(episode_study.EpisodeWork, "_judged", some)
    study.write_text(STUDY + '"path.radius" = [0.05, 50.0]')
    made = episode_study.load_campaign(str(study))
    first = next(k for k in range(12) if made.drawn(k)[1]["path.radius"] == 0.05)
    code, out, _ = campaign(study, "--out", tmp_path / "c", "--set", "campaign.episodes=12", "--json")
    facts = json.loads(out)
    assert code == 1 and facts["bound"] is None
    assert facts["refused"] > 0 and facts["refused"] + facts["sound"] + facts["raised"] == 12
    assert facts["raised"] == 1
    assert facts["examples"][0]["sentences"] == "ZeroDivisionError: division by zero"
    assert facts["by_key"]["path.radius"]["50.0"]["refused"] == facts["refused"]
    assert "out of reach" in facts["refusals"][0]["sentences"]
    code, out, _ = campaign(study, "--out", tmp_path / "c", "--set", "campaign.episodes=12")
    assert code == 1 and "were not run, as what was drawn is no scenario; episode " in out


def test_arm_that_does_not_follow_what_it_could_follow_breaks_tracking(study, tmp_path):
    study.write_text(STUDY.replace("duration = 0.4", "duration = 3.0").replace("at = 0.1", "at = 1.5"))
    code, out, _ = campaign(study, "--out", tmp_path / "c", "--json")
    facts = json.loads(out)
    assert code == 0 and 8.5 < facts["followable"] <= 9.1
    robot = catalog.load("planar")
    kept = {name: [at - 1e-3, at + 1e-3] for name, at in zip(robot.joints, robot.neutral, strict=True)}
    words = ", ".join(f"{name} = {[float(end) for end in ends]}" for name, ends in kept.items())
    lazy = f"scenario.planner.branch_limits={{ {words} }}"
    code, out, _ = campaign(study, "--out", tmp_path / "d", "--set", lazy, "--json")
    facts = json.loads(out)
    assert code == 1 and facts["laws"]["tracking"] == facts["broken"] == 6 and facts["false_ok"] == 0


def test_broken_law_ends_with_1_and_names_the_episode(study, tmp_path, monkeypatch):
    monkeypatch.setattr(episode_study, "KINEMATIC", episode_study.Strictness(speed=-1.0))
    code, out, _ = campaign(study, "--out", tmp_path / "c")
    assert code == 1
    assert "6 broke one" in out and "episode 0: speed from tick" in out and "--replay N" in out


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("episodes = 6", "episodes = 0"), "campaign.episodes"),
        (('"planner.dt"', '"planner.dtt"'), "planner.dtt is not a key of [planner] (did you mean 'dt'?)"),
        (("[0.005, 0.01]", "[-1.0, 0.0]"), "draws no scenario: none of its first 6 episodes can be run"),
        (('"planner.dt"', '"sensors.faults.1.at"'), "entry 1 of faults, which the scenario does not have"),
        (("scenario.robot", "robot"), "tables stand below [scenario], here as [scenario.robot]"),
    ],
)
def test_campaign_that_contradicts_itself_is_refused_before_anything_is_made(
    study, tmp_path, change, message
):
    study.write_text(STUDY.replace(*change))
    code, _, errors = campaign(study, "--out", tmp_path / "c")
    assert code == 2 and message in errors
    assert not (tmp_path / "c").exists()


def test_interrupt_within_an_episode_leaves_no_row_of_half_an_episode(study, tmp_path, monkeypatch):
    drawn, calls = KinematicPlant.advance, []

    def advance(self, *arguments):
        calls.append(self)
        if len(calls) == 200:
            signal.raise_signal(signal.SIGINT)
        return drawn(self, *arguments)

    ignored = signal.signal(signal.SIGINT, signal.default_int_handler)  # pytest-xdist ignores Ctrl-C
    with monkeypatch.context() as patched:
        patched.setattr(KinematicPlant, "advance", advance)
        code, _, errors = campaign(study, "--out", tmp_path / "c", "--jobs", 1)
    signal.signal(signal.SIGINT, ignored)
    assert code == 130 and "interrupted" in errors
    onward = f"the same command with --out {tmp_path / 'c'} goes on from there"
    assert f"what is done is kept; {onward}" in " ".join(errors.split())
    kept = rows(tmp_path / "c")
    assert len(kept) < 6
    assert campaign(study, "--out", tmp_path / "c", "--jobs", 1)[0] == 0
    assert campaign(study, "--out", tmp_path / "whole", "--jobs", 1)[0] == 0
    assert rows(tmp_path / "c")[: len(kept)] == kept
    assert rows(tmp_path / "c") == rows(tmp_path / "whole")


def test_results_of_an_arm_whose_file_was_changed_meanwhile_are_refused(study, tmp_path):
    arm = tmp_path / "arm.urdf"
    arm.write_text(catalog.load("panda").to_urdf())
    study.write_text(STUDY.replace('name = "planar"', 'urdf = "arm.urdf"'))
    code, _, errors = campaign(study, "--out", tmp_path / "c", "--episodes", 1)
    assert code == 0, errors
    assert campaign(study, "--out", tmp_path / "c", "--episodes", 2)[0] == 0
    arm.write_text(arm.read_text() + "<!-- another one -->")
    code, _, errors = campaign(study, "--out", tmp_path / "c", "--episodes", 3)
    assert code == 2 and "of another study" in errors and "of arm.urdf" in errors
    assert len(rows(tmp_path / "c")) == 2


def test_bundled_campaign_can_be_drawn():
    from ftqp.app.scenario import document

    for name in document.bundled("campaign"):
        made = episode_study.load_campaign(name)
        assert made.setup(0).robot.name


@pytest.mark.parametrize("key, has", [("drive.velocty", "position"), ("drives.velocity", "none of that")])
def test_weight_of_a_bundle_that_there_is_not_is_refused(key, has):
    """It was taken for a bundle of its own, and the drive that was meant to be left out was drawn."""
    code, _, errors = campaign("strangers", "--episodes", 1, "--set", f"bundles.{key}.weight=0")
    assert code == 2 and f"bundles.{key}.weight: there is no such bundle" in errors and has in errors


BESIDE = """
[campaign]
seed = 5
episodes = 1
judged = "beside a rival"
[scenario.robot]
name = "panda"
[scenario.planner]
dt = 0.005
[scenario.path]
kind = "circle"
radius = 0.02
duration = 0.5
reference = "goal"
[scenario.simulation]
plant = "mujoco"
duration = 1.0
[bundles.event.brake]
faults = [{ kind = "locked", joint = 0, at = 0.2, announced = "never" }]
[bundles.drive.position]
"planner.drive" = "position"
[vary]
"faults.0.joint" = { joint = "any" }
"""


@pytest.mark.long
def test_campaign_beside_a_rival_counts_both_and_replays_one(tmp_path):
    pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')
    file = tmp_path / "beside.toml"
    file.write_text(BESIDE)
    code, out, errors = campaign(file, "--out", tmp_path / "c")
    assert code == 0, errors
    assert "By event" in out and "brake" in out and "damped least squares" in out
    code, out, errors = campaign(file, "--replay", 0, "--out", tmp_path / "r", "--json")
    facts = json.loads(out)
    assert set(facts["beside"]) >= {"ftqp", "rival"}, errors
    assert code == (1 if facts["broken"] else 0) and (tmp_path / "r" / "log.npy").is_file()
