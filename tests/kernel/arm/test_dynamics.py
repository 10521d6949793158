"""Inertia matrix and bias torque against pinocchio, on chains of every joint type."""

import numpy as np
import pinocchio as pin
import pytest
from random_chains import configuration, random_robot
from records import address, chain_record

from ftqp.kernel.entry import entries as entry
from ftqp.model.catalog import load
from ftqp.model.robot import Robot

SIZES = (*range(2, 13), 16, 20, 25, 31, 32)


@pytest.mark.parametrize("joints", SIZES)
def test_inertia_and_bias_agree_with_pinocchio(joints):
    rng = np.random.default_rng(joints)
    for _ in range(3):
        robot = random_robot(rng, joints)
        W, data = chain_record(robot), robot.model.createData()
        for _ in range(4):
            q, full, v = configuration(rng, robot)
            entry.inverse_dynamics(address(W), q, v)
            upper = np.triu(pin.crba(robot.model, data, full))
            expected = upper + np.triu(upper, 1).T
            M = W["M"][0, :joints, :joints]
            assert np.abs(M - expected).max() < 1e-12 * np.abs(expected).max()
            assert np.array_equal(M, M.T)
            bias = pin.rnea(robot.model, data, full, v, np.zeros(joints))
            assert np.abs(W["h"][0, :joints] - bias).max() < 1e-12 * np.abs(bias).max()


@pytest.mark.parametrize("held", [[], [2], [0, 5]])
def test_rotor_inertia_stands_on_the_diagonal_as_in_pinocchio(held):
    rng = np.random.default_rng(11)
    whole = load("panda").model.copy()
    whole.armature = rng.uniform(0.1, 2.0, 7)
    robot = Robot.from_pinocchio(whole, "panda_hand_tcp", held)
    bare = Robot.from_pinocchio(load("panda").model, "panda_hand_tcp", held)
    free = [i for i in range(7) if i not in held]
    W, W_bare, q = chain_record(robot), chain_record(bare), rng.uniform(-1.0, 1.0, robot.nv)
    for record in (W, W_bare):
        entry.inverse_dynamics(address(record), q, np.zeros(robot.nv))
    M, M_bare = (record["M"][0, : robot.nv, : robot.nv] for record in (W, W_bare))
    assert np.abs(M - M_bare - np.diag(whole.armature[free])).max() < 1e-14
    upper = np.triu(pin.crba(robot.model, robot.model.createData(), q))
    assert np.abs(M - upper - np.triu(upper, 1).T).max() < 1e-12 * np.abs(M).max()
    assert np.array_equal(W["h"], W_bare["h"])


def test_torque_of_an_acceleration_with_rotors_is_that_of_pinocchio():
    rng = np.random.default_rng(12)
    robot = random_robot(rng, 9)
    W, a = chain_record(robot), rng.normal(size=9)
    q, full, v = configuration(rng, robot)
    entry.inverse_dynamics(address(W), q, v)
    expected = pin.rnea(robot.model, robot.model.createData(), full, v, a)
    torque = W["M"][0, :9, :9] @ a + W["h"][0, :9]
    assert np.all(robot.chain.armature > 0.0)
    assert np.abs(torque - expected).max() < 1e-12 * np.abs(expected).max()


def test_configurations_by_cosine_and_sine_give_the_same_dynamics():
    rng = np.random.default_rng(3)
    robot = random_robot(rng, 24)
    assert robot.nq > robot.nv
    by_angle, by_pair = chain_record(robot), chain_record(robot)
    q, full, v = configuration(rng, robot)
    entry.inverse_dynamics(address(by_angle), q, v)
    entry.inverse_dynamics(address(by_pair), full, v)
    for name in ("M", "h"):
        largest = np.abs(by_angle[name]).max()
        assert np.abs(by_pair[name] - by_angle[name]).max() < 1e-12 * largest


def test_bias_torque_loses_no_power_to_coriolis_forces():
    """v'(Mdot v - 2 (h - h_gravity)) = 0, with Mdot by finite differences."""
    rng = np.random.default_rng(7)
    robot, eps = random_robot(rng, 10), 1e-6
    W = chain_record(robot)
    q, _, v = configuration(rng, robot)
    entry.inverse_dynamics(address(W), q, np.zeros(10))
    gravity = W["h"][0, :10].copy()
    entry.inverse_dynamics(address(W), q, v)
    coriolis, M = W["h"][0, :10] - gravity, []
    for sign in (1.0, -1.0):
        entry.inverse_dynamics(address(W), q + sign * eps * v, v)
        M.append(W["M"][0, :10, :10].copy())
    power = v @ (M[0] - M[1]) @ v / (2.0 * eps)
    assert abs(power) > 1.0
    assert abs(power - 2.0 * v @ coriolis) < 1e-6 * abs(power)


def test_planar_arm_has_the_published_check_values():
    q, v = np.full(6, np.pi / 12), np.array([0.1, -0.2, 0.3, -0.1, 0.2, 0.05])
    W = chain_record(load("planar6"))
    entry.inverse_dynamics(address(W), q, v)
    M, h = W["M"][0, :6, :6], W["h"][0, :6]
    assert np.abs(M[0] - (3.07087, 2.071825, 1.164001, 0.581081, 0.193268, 0.018158)).max() < 1e-5
    eigenvalues = (4.94955e-4, 1.87633e-3, 5.70791e-3, 2.25443e-2, 0.235669, 5.139285)
    assert np.abs(np.linalg.eigvalsh(M) / eigenvalues - 1.0).max() < 1e-5
    assert np.abs(h - (-0.013853, -0.003590, 0.001927, 0.003077, 0.002007, 0.000383)).max() < 1e-6


def test_vertical_planar_arm_has_the_published_static_torque():
    W = chain_record(load("planar6", vertical=True))
    entry.inverse_dynamics(address(W), np.full(6, np.pi / 12), np.zeros(6))
    expected = (29.41547, 15.58233, 6.54527, 2.35244, 0.45641, 0.0)
    assert np.abs(W["h"][0, :6] - expected).max() < 1e-5
