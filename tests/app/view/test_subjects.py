"""What a path on the command line stands for, and what a page then shows."""

import numpy as np
import pytest
from tests.waiting import until

import ftqp
from ftqp.app.commands.covering import healthy_motion
from ftqp.app.commands.viewing import shown
from ftqp.app.run import runs
from ftqp.app.scenario.setup import load
from ftqp.app.view.verdicts_file import read_verdicts, write_verdicts
from ftqp.core.errors import InputError
from ftqp.sim.session.session_arms import Choice
from ftqp.sim.session.session_commands import Play


def test_scenario_is_live_with_its_twin_unless_told_otherwise():
    with shown(Choice(scenario="planar3-line"), speed=2.0) as (kind, source):
        until(lambda: source.frame().tick > 10)
        assert kind == "live" and source.frame().rival is not None
        until(lambda: source.frame().speed == 2.0)
    with shown(Choice(scenario="planar3-line"), rival=False) as (_, source):
        assert source.frame().rival is None


def test_folder_of_a_run_is_a_replay(tmp_path):
    setup = load("planar3-line", ["simulation.duration=0.5"])
    runs.run(setup, tmp_path / "run", drawn=False)
    with shown(Choice(scenario=str(tmp_path / "run"))) as (kind, source):
        stage = source.stage()
        assert kind == "replay" and not stage.live and stage.duration == pytest.approx(0.5)
        assert "planar3-line" in stage.title and source.frame().message == ""


def test_folder_of_a_campaign_is_refused_with_what_shows_it(tmp_path):
    (tmp_path / runs.CAMPAIGN).write_text("")
    with (
        pytest.raises(InputError, match=r"holds a campaign, .* `ftqp report .* --replay N"),
        shown(Choice(scenario=str(tmp_path))),
    ):
        pass


@pytest.fixture(scope="module")
def report():
    setup = load("planar3-line", ["faults="])
    task, q = healthy_motion(setup)
    return setup, ftqp.analysis.coverage(setup.robot, task, q, stride=200, lock="instant")


def test_failure_of_a_coverage_report_is_played_at_its_time(report, tmp_path):
    setup, rep = report
    write_verdicts(tmp_path, rep, setup.name, setup.toml, None)
    with shown(Choice(scenario=str(tmp_path))) as (kind, source):
        stage = source.stage()
        assert kind == "coverage" and "planar3-line" in stage.title
        assert stage.heat is not None and stage.heat.codes.shape == rep.status.shape
        until(lambda: source.frame().tick > 30)
        assert not source.frame().truth.any()
        source.put(Play("j2", 0.2))
        until(lambda: source.frame().truth.any())
        frame = source.frame()
        assert frame.truth.tolist() == frame.belief.tolist() == [0, 1, 0]
        assert frame.t >= 0.2 and frame.v[1] == 0.0


def test_verdicts_come_back_as_they_were(report, tmp_path):
    setup, rep = report
    write_verdicts(tmp_path, rep, setup.name, setup.toml, None)
    found = read_verdicts(tmp_path)
    np.testing.assert_array_equal(found.heat.codes, rep.status)
    np.testing.assert_allclose(found.heat.times, rep.t)
    assert found.heat.joints == rep.names and found.heat.coverage == rep.coverage
    assert (found.name, found.kind, found.settings) == ("planar3-line", "locked", {"mode": "instant"})
    assert load(str(found.scenario)).robot.name == setup.robot.name
    assert set(np.unique(rep.status)) <= set(found.heat.words) == set(found.heat.colours)
