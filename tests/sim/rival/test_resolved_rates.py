"""The rival is wired as well as an engineer would: it follows, keeps limits, believes what it is told."""

import numpy as np
import pytest

import ftqp
from ftqp.sim.rival import ResolvedRates, ride

PANDA = ftqp.robots.load("panda")
DT, JOINT = 2e-3, "panda_joint3"
LOCK = ftqp.Schedule([ftqp.FaultEvent(1.0, ftqp.Locked(JOINT, mode="instant"))])


def ridden(told: bool = False, schedule: ftqp.Schedule | None = LOCK, radius: float = 0.05):
    path = ftqp.paths.Circle(PANDA.pose(PANDA.neutral), radius, duration=2.0, axes=("y", "z"))
    plant = ftqp.KinematicPlant(PANDA, DT, "velocity")
    rates = ResolvedRates(PANDA, DT)
    return ride(rates, PANDA, path, PANDA.neutral, dt=DT, plant=plant, schedule=schedule, reported=told)


def test_a_healthy_arm_is_led_along_its_path():
    assert ridden(schedule=None).error.max() < 1e-4


def test_told_of_a_lock_it_goes_on_and_asks_nothing_of_the_joint():
    done, i = ridden(told=True), PANDA.joint(JOINT)
    assert done.error.max() < 2e-3 and done.error[-1] < 1e-5
    assert np.ptp(done.q[round(1.0 / DT) + 1 :, i]) == 0.0


def test_not_told_it_strays_and_comes_back_by_its_feedback():
    told, never = ridden(told=True), ridden()
    assert never.error.max() > 1.5 * told.error.max()
    assert never.error[-1] < 0.3 * never.error.max()


def test_it_keeps_its_limits_however_fast_the_path_is():
    done = ridden(schedule=None, radius=0.4)
    a = np.diff(done.v, axis=0) / DT
    limits = PANDA.limits
    assert (np.abs(done.v) <= limits.v_max * (1 + 1e-9)).all()
    assert (np.abs(a) <= limits.a_max * (1 + 1e-6)).all()
    assert ((done.q >= limits.q_min) & (done.q <= limits.q_max)).all()
    assert np.max(np.abs(done.v) / limits.v_max) == pytest.approx(1.0, abs=1e-6)
