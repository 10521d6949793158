"""Files that once ended in another way than a clear sentence, whatever they are and say of their time."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import ftqp
from ftqp.app.campaign.episode_study import EpisodeWork, load_campaign
from ftqp.app.commands.cli import app
from ftqp.app.commands.mapping import load_study
from ftqp.app.output.console import json_text
from ftqp.app.run import runs
from ftqp.app.scenario.setup import load
from ftqp.app.view.verdicts_file import VERDICTS, read_verdicts
from ftqp.core.errors import FtqpError, InputError, ScenarioError
from ftqp.faults.detection.calibration import Calibration
from ftqp.qp import backend
from ftqp.sim.log.log_file import load_log
from ftqp.sim.number_files import waypoint_table

SCENARIO = "planar3-line"


def refused(*overrides: str) -> str:
    """What is said of a scenario that is changed so."""
    with pytest.raises(ScenarioError) as caught:
        load(SCENARIO, overrides)
    return str(caught.value)


def test_message_shows_what_a_terminal_would_obey():
    result = CliRunner().invoke(app, ["check", SCENARIO, "--set", "planner.\x1b[31mdt=1", "--json"])
    assert result.exit_code == 2
    assert "\x1b" not in result.output and '"\\u001b[31mdt" is not a key of [planner]' in result.stderr
    assert str(InputError("a\x1bb\u202ec\udcff\nd")) == "a\\x1bb\\u202ec\\udcff\nd"
    assert ScenarioError("x:", ["a\nb"]).errors == ("a\\nb",)


def test_key_with_a_line_break_is_told_in_one_line():
    assert '"a\\nb" is not a key' in refused('planner={"a\\nb" = 1}')


def test_word_without_end_is_cut():
    assert len(refused(f"planner.scheme={'x' * 5000}")) < 700


def test_half_a_letter_can_be_written_as_json():
    assert json.loads(json_text({"key": "\udcff"})) == {"key": "\udcff"}


def test_digit_of_another_script_is_no_index():
    assert "'\u00b2' is not a table of this scenario" in refused("faults.\u00b2.at=1")
    assert "'\u00b2' is not an index below 1" in refused("faults.\u00b2=1")


def test_choice_that_may_be_left_out_names_its_words():
    assert "path.reference is 'tim', expected one of progress, time" in refused("path.reference=tim")


def test_option_that_is_called_name_is_refused():
    assert "options has name" in refused("robot.options={name = 'j'}")


def test_failure_that_is_announced_after_all_time_does_not_stop_a_run():
    setup = load(SCENARIO, ["faults.0.announced=1e308", "simulation.duration=0.01"])
    assert setup.simulation().run().completed is not None


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("robot.options={lengths = [1e200, 1.0, 1.0]}", "positive numbers up to 1e+06 [m]"),
        ("sensors={latency = 1000000000000000}", "expected a whole number of ticks, 0 to 100000"),
        ("robot.tool={orientation = [1e308, 1e308, 0.0, 0.0]}", "orientation has the length 1.414e+308"),
        (f"planner.task.rows={['x', 'y'] * 200}", "expected at least one row and none twice"),
    ],
)
def test_number_beyond_all_arms_is_refused_without_a_warning(override: str, said: str):
    assert said in refused(override)
    assert len(refused(override)) < 600


@pytest.mark.parametrize("text", ["a = " + "[" * 50_000, "name = 1" + "0" * 5000], ids=["nested", "digits"])
def test_profile_that_cannot_be_read_is_refused(tmp_path: Path, text: str):
    (tmp_path / "deep.toml").write_text(text)
    with pytest.raises(InputError, match="is not valid TOML"):
        backend(tmp_path / "deep.toml")


@pytest.mark.parametrize("name", ["daqp", "proxqp", "dtrnn"])
def test_count_that_no_solver_can_hold_is_refused(name: str):
    with pytest.raises(InputError, match="expected a whole number from 1 to 2147483647"):
        backend({"name": name, "max_iterations": 2**63})


@pytest.mark.parametrize("cell", ["1_000", "\uff11", "0x10", "1e", "--1"])
def test_table_takes_numbers_as_other_programs_write_them(tmp_path: Path, cell: str):
    (tmp_path / "way.csv").write_text(f"x,y,z\n0,0,0\n+1,.5,-2E-3\n{cell},0,0\n", encoding="utf-8")
    with pytest.raises(InputError, match="expected a number"):
        waypoint_table(tmp_path / "way.csv")


CAMPAIGN = """
[campaign]
episodes = 3
[scenario]
robot = {{ name = "planar" }}
path = {{ kind = "circle", radius = 0.05, duration = 0.4 }}
[vary]
{vary}
"""


def campaign(folder: Path, vary: str):
    (folder / "campaign.toml").write_text(CAMPAIGN.format(vary=vary), encoding="utf-8")
    return load_campaign(str(folder / "campaign.toml"))


@pytest.mark.parametrize(
    ("vary", "said"),
    [
        ('"path.radius" = { uniform = [-1e308, 1e308] }', "expected two numbers from -1e\\+15"),
        ('"planner.level" = { one_of = ["a"], weights = [1' + 400 * "0" + "] }", "is a whole number beyond"),
        ('"robot.nam" = ["x"]\n"start.q" = { start = 0.1 }', "scenario.robot.nam is not a key"),
        ('"faults.\u00b2" = [1]', "leads to no table|is not a key|expected a list"),
    ],
)  # fmt: skip
def test_distribution_that_no_number_can_be_drawn_from_is_refused(tmp_path: Path, vary: str, said: str):
    with pytest.raises(FtqpError, match=said):
        campaign(tmp_path, vary).setup(0)


def test_date_that_is_drawn_is_an_episode_that_cannot_be(tmp_path: Path):
    made = campaign(tmp_path, '"path.radius" = [2026-01-01, 0.05]')
    rows = EpisodeWork(campaign=made)(range(12))
    (row,) = {row[:2] for row in rows if "2026" in row[0]}
    assert "refused" in row and json.loads(row[0]) == {"path.radius": "2026-01-01"}


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("map.grid=9223372036854775808", "grid is 9223372036854775808, expected a whole number from 2 to"),
        ("map.steps=10000000", "expected a whole number from 1 to 100000"),
        ("map.weights=[[1.0], [1.0, 2.0], []]", "W is not an array of numbers"),
    ],
)
def test_study_that_no_memory_can_hold_is_refused(override: str, said: str):
    with pytest.raises(ScenarioError, match=said):
        load_study("planar3-sample", [override])


def _calibration(folder: Path) -> tuple[Path, dict]:
    n, file = 2, folder / "c.json"
    Calibration(
        joints=("a", "b"), drive="position", dt=1e-3, sigma=1e-4, quantum=0.0, coulomb=np.zeros(n),
        viscous=np.zeros(n), hours=1.0,
    ).save(file)  # fmt: skip
    return file, json.loads(file.read_text())


@pytest.mark.parametrize(
    ("key", "value"),
    [("joints", 3), ("quantum", {}), ("sigma", "1"), ("drive", 1), ("dt", 10**400)],
)
def test_calibration_of_other_kinds_is_refused(tmp_path: Path, key: str, value: object):
    file, content = _calibration(tmp_path)
    assert Calibration.load(file).joints == ("a", "b")
    file.write_text(json.dumps(content | {key: value}))
    with pytest.raises(InputError, match=f"its {key} is"):
        Calibration.load(file)


def test_calibration_that_is_nested_without_end_is_refused(tmp_path: Path):
    (tmp_path / "c.json").write_text("[" * 100_000)
    with pytest.raises(InputError, match="cannot be read as a calibration"):
        Calibration.load(tmp_path / "c.json")


@pytest.mark.parametrize("value", [[[{}]], [[10**400]], 3, "x"])
def test_verdicts_of_other_kinds_are_refused_in_our_words(tmp_path: Path, value: object):
    content = {
        "format": 1,
        "scenario": "s",
        "failures": ["a"],
        "times": [0.0],
        "codes": value,
        "coverage": 1.0,
    }
    (tmp_path / VERDICTS).write_text(json.dumps(content | {"fault": "locked", "settings": {}}))
    with pytest.raises(InputError, match="is not the list of verdicts of a coverage report"):
        read_verdicts(tmp_path)


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    """The folder of a short run."""
    folder = tmp_path_factory.mktemp("files") / "run"
    runs.run(load(SCENARIO, ["simulation.duration=0.05"]), folder, drawn=False)
    return folder


def test_log_that_does_not_say_something_names_it(run: Path):
    with pytest.raises(InputError, match="the log does not say 'weather' of its run"):
        load_log(run).metadata["weather"]


@pytest.mark.parametrize("dt", [1e-9, 5e-324, 1e-300, 9e-7])
def test_sampling_period_that_no_arm_takes_is_refused(dt):
    with pytest.raises(InputError, match=r"dt is .* s, expected at least 1e-06 s"):
        ftqp.Planner(ftqp.robots.load("planar(4)"), dt)


@pytest.mark.parametrize("duration", [1e10, 1e300])
def test_path_of_a_thousand_years_is_refused(duration):
    with pytest.raises(InputError, match=r"duration of the path is .* expected at most 1e\+09 s"):
        ftqp.paths.Line(np.eye(4), (0.1, 0.0, 0.0), duration=duration)
