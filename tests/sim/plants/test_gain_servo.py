"""Servos with gains of their own: droop, delay, elastic gears and play are what their formulas say."""

from types import SimpleNamespace

import numpy as np
import pytest

import ftqp
from ftqp.sim.plants.joint_servo import Gains, GainServo, Gear

ARM = ftqp.robots.load("panda")
N, H = ARM.nv, 5e-4
NONE = np.zeros(N)


def mass():
    return np.diag(ARM.mass_matrix(ARM.neutral))


def sent(q=ARM.neutral, v=NONE, tau=NONE):
    return SimpleNamespace(q=q, v=v, tau=tau, brakes=np.zeros(N, dtype=bool))


def asked(servo, q=ARM.neutral, v=NONE, limit=ARM.limits.tau_max):
    tau = np.empty(N)
    servo.torques(q, v, limit, tau)
    return tau


def test_position_servo_is_the_spring_and_damper_of_its_bandwidth_and_asks_for_the_weight_if_it_is_to():
    gains = {"bandwidth": 20.0, "damping": 0.7}
    servo = GainServo(ARM, "position", Gains(**gains, weight=False), H)
    servo.take(sent(ARM.neutral + 0.01, np.full(N, 0.1)))
    v = np.full(N, 0.05)
    expected = mass() * (400.0 * 0.01 + 2.0 * 0.7 * 20.0 * 0.05)
    assert asked(servo, v=v) == pytest.approx(expected)
    other = GainServo(ARM, "position", Gains(**gains, weight=True), H)
    other.take(sent(ARM.neutral + 0.01, np.full(N, 0.1)))
    assert asked(other, v=v) - expected == pytest.approx(ARM.bias(ARM.neutral, NONE), abs=1e-9)


def test_velocity_servo_that_stands_holds_the_arm_and_a_motor_that_is_off_winds_nothing_up():
    servo = GainServo(ARM, "velocity", Gains(weight=False), H)
    servo.reset(ARM.neutral)
    assert asked(servo) == pytest.approx(ARM.bias(ARM.neutral, NONE), abs=1e-9)
    servo.take(sent(v=np.full(N, 0.5)))
    for _ in range(1000):
        asked(servo, limit=NONE)
    servo.take(sent())
    assert asked(servo) == pytest.approx(ARM.bias(ARM.neutral, NONE), abs=1e-9)


def test_command_comes_as_late_as_is_said():
    servo = GainServo(ARM, "torque", Gains(delay=5 * H), H)
    servo.take(sent(tau=np.ones(N)))
    assert [asked(servo)[0] for _ in range(7)] == [0, 0, 0, 0, 0, 1, 1]


def test_elastic_gear_rings_at_its_resonance_and_play_pulls_at_nothing():
    m, w = np.array([2.0]), np.array([100.0])
    gear = Gear(m, w, np.zeros(1))
    gear.reset(np.array([0.01]))  # the joint is held at 0, and the rotor lets go
    pulls = [gear.spring_torque(np.zeros(1), np.zeros(1), np.zeros(1), 1e-4)[0] for _ in range(5000)]
    turns = np.flatnonzero(np.diff(np.sign(pulls)))
    assert np.pi / (np.mean(np.diff(turns)) * 1e-4) == pytest.approx(100.0 * np.sqrt(2.0), rel=0.01)
    play = Gear(m, w, np.array([0.02]))
    play.reset(np.array([0.009]))
    assert play.spring_torque(np.zeros(1), np.zeros(1), np.zeros(1), 1e-4)[0] == 0.0
    play.reset(np.array([0.012]))
    assert play.spring_torque(np.zeros(1), np.zeros(1), np.zeros(1), 1e-4)[0] == pytest.approx(
        2.0 * 1e4 * 0.002
    )


def test_arm_in_physics_droops_by_its_weight_over_the_stiffness():
    pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')
    gains = Gains(bandwidth=60.0, weight=False)
    plant = ftqp.MujocoPlant(ARM, 1e-3, GainServo(ARM, "position", gains, H), substeps=2)
    plant.reset(ARM.neutral, NONE)
    for _ in range(1500):
        plant.advance(sent())
    droop = ARM.neutral - plant.q
    assert np.abs(plant.v).max() < 1e-4
    assert droop == pytest.approx(ARM.bias(plant.q, NONE) / (3600.0 * mass()), abs=1e-5)
    assert droop.max() > 0.005
