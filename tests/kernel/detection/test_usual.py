"""What is usual of residuals: means that take what nobody knows of, and not what has just failed."""

import numpy as np
import pytest
from tests.shaken import DT, SIGMA, Shaken

import ftqp

TICKS = 2500
AT = 1000


@pytest.fixture(scope="module")
def arm():
    return ftqp.robots.load("panda")


def suspicion(arm, **changes):
    """z of every tick, with changes to the log of healthy motion."""
    motion = Shaken(arm, TICKS)
    columns = motion.log(effort=motion.torques).columns() | changes
    detector = ftqp.Detector(robot=arm, dt=DT, noise=ftqp.Noise(q=SIGMA))
    _, _, trace = detector._session.run(columns, 25)
    return detector._session.D, trace


def test_distance_that_stays_becomes_usual(arm):
    q = Shaken(arm, TICKS).q
    q[AT:] += 0.015 * np.sin(0.5 * np.pi * np.minimum(1.0, np.arange(TICKS - AT) / 400.0))[:, None] ** 2
    D, z = suspicion(arm, q=q)
    assert not D.kinds[:7].any()
    assert z[AT : AT + 600].max() > 1.0 and z[-200:].max() < 0.5


def test_load_of_the_first_tick_on_is_no_suspicion(arm):
    heavier = arm.with_payload(ftqp.Payload(1.5))
    D, z = suspicion(arm, effort=Shaken(heavier, TICKS).torques)
    assert z.max() < 1.0 and not D.kinds[:7].any()


def test_friction_larger_than_identified_does_not_count_after_a_reversal(arm):
    motion = Shaken(arm, TICKS)
    coulomb = 10.0
    sizes = []
    for share in (0.0, 1.0):  # of what is known of the friction
        detector = ftqp.Detector(robot=arm, dt=DT, noise=ftqp.Noise(q=SIGMA))
        detector._session.D.coulomb[:7] = coulomb
        rubs = coulomb * (1.0 + 0.25 * share) * np.sign(motion.v_ref)
        log = motion.log(effort=motion.torques + rubs)
        _, peaks, _ = detector._session.run(log.columns(), TICKS // 5)
        sizes.append(peaks[2:, 3, :7].max(axis=0))
    np.testing.assert_allclose(sizes[1], sizes[0], atol=0.35 * coulomb * 0.25)
