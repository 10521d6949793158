"""A finished run, played from its log by a clock of the test's own."""

import numpy as np
import pytest

from ftqp.app.run.recorded_robot import notes_of
from ftqp.app.scenario.setup import load
from ftqp.app.view.replay_source import ReplaySource
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.loop import Simulation
from ftqp.sim.session.frame import frames_of
from ftqp.sim.session.session_commands import Break, Pause, Reset, Seek, Speed

CLOCK = [0.0]


def run_of(scenario="panda-y-line", duration=1.0, **metadata):
    setup = load(scenario)
    return Simulation(
        setup.planner, setup.path, q=setup.q, v=setup.v, schedule=setup.schedule, plant=setup.plant,
        world=setup.world, duration=duration, log="memory",
        metadata={"scenario": scenario, "resolved": setup.toml, **metadata},
    ).run().log  # fmt: skip


@pytest.fixture(scope="module")
def log():
    return run_of()


@pytest.fixture
def source(log):
    CLOCK[0] = 100.0
    return ReplaySource(log, "a run", clock=lambda: CLOCK[0])


def at(source, seconds):
    CLOCK[0] += seconds
    return source.frame()


def test_replay_shows_the_frames_of_the_log(source, log):
    shown = at(source, 0.5)
    expected = next(frames_of(log, source.stage().robot, [250]))
    assert shown.tick == 250 and shown.status == expected.status
    for name in ("joints", "target", "share", "axes", "axes_rotation", "truth"):
        np.testing.assert_array_equal(getattr(shown, name), getattr(expected, name))


def test_time_slider_pause_and_speed(source):
    source.put(Seek(0.3))
    assert source.frame().t == pytest.approx(0.3)
    source.put(Pause(True))
    assert at(source, 5.0).t == pytest.approx(0.3) and source.frame().paused
    source.put(Speed(0.5))
    source.put(Pause(False))
    assert at(source, 0.2).t == pytest.approx(0.4)
    source.put(Seek(-7.0))
    assert source.frame().tick == 0
    source.put(Seek(99.0))
    assert at(source, 9.0).t == source.stage().duration == 1.0
    source.put(Reset())
    assert source.frame().tick == 0


@pytest.mark.parametrize(
    ("command", "said"),
    [(Break(1), "finished run"), (Speed(-1.0), "expected a factor"), (Seek(float("nan")), "finished run")],
)
def test_what_a_finished_run_cannot_do_is_said(source, command, said):
    source.put(command)
    assert said in source.frame().message and source.frame().t == 0.0


def test_log_cut_short_and_run_of_another_version_are_told(log):
    assert notes_of(log.metadata, 1.0) == []
    cut = Log(None, {name: log[name] for name in log.names}, log.units, log.descriptions, log.metadata | {
        "state": "running", "versions": {"ftqp": "0.0.1"},
    })  # fmt: skip
    notes = " ".join(notes_of(cut.metadata, 1.0))
    assert "cut short: it ends at 1.000 s" in notes and "made by ftqp 0.0.1" in notes
    assert ReplaySource(cut, "cut").frame().message == notes


def test_base_that_moves_is_replayed_in_the_frame_of_the_base():
    log = run_of("iiwa-moving-base-locked", duration=2.0)
    source = ReplaySource(log, "x", clock=lambda: CLOCK[0])
    source.put(Seek(2.0))
    frame = source.frame()
    error = np.linalg.norm(frame.target[:3, 3] - frame.tip[:3, 3])
    assert error == pytest.approx(frame.position_error, abs=1e-9)
    assert source.stage().path is None
