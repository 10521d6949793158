"""Planners wired to arms that take positions, velocities or torques, in physics that is not the planner's."""

import numpy as np
import pytest
from tests.ride import DT, START, Ride, circle, target_at, wired

import ftqp

STOPS = ("STOPPING", "STOPPED")


ROBOTS = ("panda", "puma560", "srs7")
LATE = 3
"""Samples are so many ticks late."""


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
@pytest.mark.parametrize(("mode", "late"), [("none", 0), ("instant", 0), ("ramp", LATE)])
@pytest.mark.parametrize("name", ROBOTS)
def test_on_an_arm_that_follows_exactly_all_drives_move_alike(name, mode, late, level):
    robot = ftqp.robots.load(name)
    q0 = START if name == "panda" else robot.neutral
    path = circle(robot, q0, 0.05, 0.6)
    targets = [target_at(path, k * DT) for k in range(500)]
    ways = []
    for kind in ("position", "velocity", *(("torque",) if robot.has_inertia else ())):
        drive = ftqp.Drive(kind=kind, latency=late * DT)
        planner = ftqp.Planner(robot, DT, drive=drive, level=level, noise=ftqp.Noise(q=1e-5))
        planner.reset(q0)
        way = [q0] * (late + 1)
        for k, target in enumerate(targets):
            if k == 250 and mode != "none":
                planner.report(ftqp.Locked(2, mode=mode))
            way.append(planner.step(way[k], None, target).reference.q.copy())
        ways.append(np.array(way))
    assert np.abs(np.diff(ways[0], axis=0)).max() > 1e-5
    for way in ways[1:]:
        np.testing.assert_allclose(way, ways[0], rtol=0, atol=1e-9)


LASTING = {
    "wrap": lambda k, q: q + 2 * np.pi * np.eye(7)[6] * (k >= 1000),
    "NaN": lambda k, q: q if k < 1000 else np.where(np.arange(7) == 2, np.nan, q),
    "bias": lambda k, q: q + 0.05 * np.eye(7)[1] * (k >= 1000),
}


@pytest.mark.parametrize("drive", ["velocity"])
@pytest.mark.parametrize("fault", LASTING)
def test_a_sensor_that_stays_impossible_stops_the_arm_after_its_patience(drive, fault):
    robot = ftqp.robots.load("panda")
    planner, arm = wired(robot, drive)
    ride = Ride(robot, planner, arm, circle(robot, START, 0.07, 3.0), 2.0, sensor=LASTING[fault])
    assert ride.status[1025] in STOPS and ride.status[-1] == "STOPPED" and ride.rest < 1e-3
    assert ride.status[1000] == "INVALID_INPUT" and planner.stopped_because is not None
    assert not planner.resume()


def test_measured_velocity_is_used_nowhere():
    robot = ftqp.robots.load("panda")
    ends = []
    for v in (None, np.zeros(7), np.full(7, 50.0)):
        planner = ftqp.Planner(robot, DT)
        planner.reset(START)
        path, q = circle(robot, START), START
        for k in range(300):
            step = planner.step(q, v, target_at(path, k * DT))
            q = step.q.copy()
        ends.append(q)
    assert (ends[0] == ends[1]).all() and (ends[0] == ends[2]).all()
