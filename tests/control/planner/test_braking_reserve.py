"""The braking reserve is deceleration that the motors have, whatever the arm is doing."""

import numpy as np
import pytest

import ftqp
from ftqp.control.planner.mounted_robot import SPEED_SHARE, BrakingReserve


@pytest.fixture(scope="module")
def panda_reserve():
    return BrakingReserve(ftqp.robots.load("panda"))


def test_every_joint_can_brake_at_the_share_within_its_torque(panda, panda_reserve):
    pinocchio = pytest.importorskip("pinocchio")
    reserve = panda_reserve
    limits, generator = panda.limits, np.random.default_rng(1)
    guard = reserve.guard(limits.a_max, limits.tau_max)
    share = reserve.share(limits.a_max, limits.tau_max)
    assert 0.0 < guard <= share <= 1.0
    data = panda.model.createData()
    for _ in range(300):
        q = generator.uniform(limits.q_min, limits.q_max)
        v = generator.uniform(-1.0, 1.0, 7) * SPEED_SHARE * limits.v_max
        a = guard * limits.a_max * generator.choice([-1.0, 1.0], 7)
        assert np.all(np.abs(pinocchio.rnea(panda.model, data, q, v, a)) <= limits.tau_max)


def test_share_is_the_largest_that_all_samples_allow():
    """A planar arm without gravity has |h| = 0 at rest: the share follows from |M| a_max alone."""
    robot = ftqp.robots.load("planar(1)")
    reserve = BrakingReserve(robot)
    inertia = 4.0 * 1.5 * 1.5**2 / 3.0  # a rod about its end
    for share in (0.3, 0.7):
        tau_max = np.array([share * inertia * robot.limits.a_max[0]])
        assert reserve.share(robot.limits.a_max, tau_max) == pytest.approx(share, rel=1e-9)
        assert reserve.guard(robot.limits.a_max, tau_max) == pytest.approx(share / 1.3, rel=1e-9)
