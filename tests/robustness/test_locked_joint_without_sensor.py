"""Found by `ftqp campaign wide`: a joint that is reported as locked after its sensor had stopped the arm.

Its command crept away for ever, by the last following error in every tick, while its velocity was sent as 0.
"""

import pytest

import ftqp

DT, JOINT = 0.01, 3


@pytest.mark.parametrize("mode", ["instant", "ramp"])
@pytest.mark.parametrize("drive", ["position", "velocity"])
@pytest.mark.parametrize("level", ["acceleration", "velocity"])
def test_command_of_a_locked_joint_whose_sensor_is_lost_stays_where_it_is(level, drive, mode):
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, DT, level=level, drive=drive)
    path = ftqp.paths.Circle(robot.pose(robot.neutral), 0.1, duration=1.5)
    q, v = robot.neutral.copy(), robot.neutral * 0.0
    planner.reset(q)
    sent, held = [], 0.0
    for k in range(90):
        sample = path.sample([k * DT])
        if k == 60:
            assert planner.stopped_because
            planner.report(ftqp.Locked(JOINT, mode=mode))
        target = ftqp.Target(sample.pose[0], twist=sample.twist[0], acceleration=sample.acceleration[0])
        step = planner.step(q, v, target)
        sent.append(step.q[JOINT])
        q, v = step.q.copy(), step.v.copy()
        if k == 20:  # the brake closes, and nobody says so
            held = sent[19] - 0.01
        if k >= 20:
            q[JOINT], v[JOINT] = held if k < 25 else float("nan"), 0.0
    assert len(set(sent[62:])) == 1
    assert abs(sent[-1] - sent[59]) < 1e-3
