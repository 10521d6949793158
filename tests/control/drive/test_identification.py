"""The lag of a servo, found from what it was sent and what was measured."""

import numpy as np
import pytest
from tests.ride import DT, START, circle, target_at
from tests.servo_arm import ServoArm

import ftqp
from ftqp.control.drive.identification import servo_lag


def recorded(takes, hertz, latency=0, sigma=1e-4):
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, DT)
    arm = ServoArm(START, DT, takes, 2 * np.pi * hertz, latency=latency, sigma=sigma)
    planner.reset(START)
    path, sent, measured = circle(robot, START, 0.1, 3.0), [], []
    for k in range(2500):
        q = arm.measured()
        step = planner.step(q, None, target_at(path, k * DT))
        arm.command(step)
        sent.append(step.q.copy())
        measured.append(q)
    return np.array(sent), np.array(measured)


@pytest.mark.long
@pytest.mark.parametrize(("hertz", "latency"), [(15, 0), (5, 5)])
def test_a_servo_on_positions_only_gets_its_lead(hertz, latency):
    true = 2.0 / (2 * np.pi * hertz)
    found = servo_lag(*recorded("position only", hertz, latency), DT, latency=latency * DT)
    assert found.lag == pytest.approx(true, rel=0.08)
    assert found.drive.lead == found.lag and not found.drive.takes_velocity


@pytest.mark.long
@pytest.mark.parametrize("hertz", [15, 60])
def test_a_servo_that_takes_velocities_has_no_lag(hertz):
    found = servo_lag(*recorded("position", hertz), DT)
    assert abs(found.lag) < 2e-3 and found.drive == ftqp.Drive()


def test_too_little_motion_and_wrong_shapes_are_one_sentence():
    still = np.tile(START, (2000, 1))
    with pytest.raises(ftqp.InputError, match="the log has 0 averaged samples of joints faster than"):
        servo_lag(still, still, DT)
    with pytest.raises(ftqp.InputError, match="sent has shape"):
        servo_lag(still[:5], still, DT)
    with pytest.raises(ftqp.InputError, match=r"measured has shape \(7,\), expected \(K, nv\)"):
        servo_lag(START, START, DT)
