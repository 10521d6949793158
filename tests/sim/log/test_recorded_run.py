"""The QPs of a simulation come with names, times and what the run was about."""

import numpy as np
import pytest

import ftqp
from ftqp.qp import Recorder
from ftqp.sim.log.description import recorded
from ftqp.sim.schedule import FaultEvent, Schedule


@pytest.fixture(scope="module")
def recording():
    robot = ftqp.robots.load("planar6")
    recorder = Recorder("daqp", first=5, last=24)
    planner = ftqp.Planner(robot, 0.01, backend=recorder)
    recorder.follow(planner)
    path = ftqp.paths.Line(robot.pose(robot.neutral), (0.01, 0.0, 0.0), duration=0.5)
    schedule = Schedule([FaultEvent(0.2, ftqp.Locked(2, mode="instant"))])
    ftqp.Simulation(planner, path, q=robot.neutral, schedule=schedule).run()
    return recorded(recorder, planner, path, schedule, {"scenario": "a line"})


def test_ticks_are_those_of_the_run(recording):
    assert recording.tick.tolist() == list(range(5, 25))
    np.testing.assert_allclose(recording.time, 0.01 * recording.tick)


def test_metadata_tell_robot_fault_and_backend(recording):
    about = recording.metadata
    assert (about["robot"], about["backend"], about["scenario"]) == ("planar6", "daqp", "a line")
    assert about["faults"][0] | {"joint": "j3", "at": 0.2} == about["faults"][0]
    assert about["length"] > 0.0 and about["level"] == "acceleration" and "ftqp" in about["versions"]


def test_a_lock_shows_as_equal_bounds_and_a_cold_start(recording):
    fixed = recording.lb[:, 2] == recording.ub[:, 2]
    assert fixed.tolist() == [False] * 15 + [True] * 5
    assert np.flatnonzero(recording.cold).tolist() == [15]
