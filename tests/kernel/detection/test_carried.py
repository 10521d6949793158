"""A load that nobody told of is known by what it weighs at all joints, and is no lost torque."""

import numpy as np
import pytest
from tests.shaken import DT, SIGMA, Shaken

import ftqp
from ftqp.kernel.detection.detecting import FOUND

TICKS = 4000
LOAD = ftqp.Payload(0.8, (0.05, 0.0, 0.02))


def played(robot, log, *, learn=True, until=3):
    """The detector after a log, and the largest residual of torque of its second half, (nv,) [N m]."""
    detector = ftqp.Detector(robot=robot, dt=DT, drive="position", noise=ftqp.Noise(q=SIGMA))
    session = detector._session
    if not learn:
        session.D.finest[:] = 1e30  # nothing tells of a load
    _, peaks, _ = session.run(log.columns(), TICKS // 2, until)
    return session.D, peaks[1, 3, : robot.nv]


@pytest.fixture(scope="module", params=["panda", "iiwa14"])
def arm(request):
    return ftqp.robots.load(request.param)


def test_mass_and_centre_of_an_unknown_load_are_learned(arm):
    log = Shaken(arm, TICKS).log(effort=Shaken(arm.with_payload(LOAD), TICKS).torques)
    D, _ = played(arm, log)
    np.testing.assert_allclose(D.load[0], LOAD.mass, rtol=0.25)
    np.testing.assert_allclose(D.load[1:], LOAD.mass * np.array(LOAD.com), atol=0.03)


def test_learned_load_leaves_little_of_the_residual_that_it_made(arm):
    log = Shaken(arm, TICKS).log(effort=Shaken(arm.with_payload(LOAD), TICKS).torques)
    (_, with_it), (_, without) = (played(arm, log, learn=learn) for learn in (True, False))
    assert (with_it[3:6] < 0.7 * without[3:6]).all()


def test_arm_without_a_load_has_none(arm):
    D, _ = played(arm, Shaken(arm, TICKS).log(effort=Shaken(arm, TICKS).torques))
    assert abs(D.load[0]) < 0.05 and np.abs(D.load[1:]).max() < 0.02


def test_torque_that_one_motor_loses_is_not_taken_for_a_load(arm):
    torques = Shaken(arm, TICKS).torques
    asked = torques.copy()
    asked[3000:, 1] *= 2.0  # twice of what it gives
    D, _ = played(arm, Shaken(arm, TICKS).log(effort=asked), until=FOUND)
    assert int(D.kinds[1]) != 0 and abs(D.load[0]) < 0.1
