"""MuJoCo's equations of motion against pinocchio's, and what must not be left behind."""

import numpy as np
import pinocchio as pin
import pytest

from ftqp.model import catalog
from ftqp.model.payload import Payload

pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')

from ftqp.sim.plants.physics import Physics
from ftqp.sim.plants.true_arm import TrueArm

WITH_INERTIA = [name for name in catalog.names() if name != "planar" and catalog.load(name).has_inertia]


def differences(physics, model, robot, count=30):
    """Largest errors of M, h and the tip over random states; (3,)."""
    rng, data, worst = np.random.default_rng(7), model.createData(), np.zeros(3)
    for _ in range(count):
        q, v = rng.uniform(-2.0, 2.0, robot.nv), rng.normal(size=robot.nv)
        physics.reset(q, v)
        full = robot.configuration(q)
        upper = np.triu(pin.crba(model, data, full))
        M = upper + np.triu(upper, 1).T
        worst[0] = max(worst[0], np.abs(physics.mass_matrix() - M).max())
        worst[1] = max(
            worst[1], np.abs(physics.bias - pin.rnea(model, data, full, v, np.zeros(robot.nv))).max()
        )
        worst[2] = max(worst[2], np.abs(physics.tip() - robot.pose(q)).max())
    return worst


@pytest.mark.parametrize("name", WITH_INERTIA)
def test_inertia_bias_and_tip_are_those_of_pinocchio(name):
    robot = catalog.load(name)
    assert differences(Physics(robot.chain, 1e-3), robot.model, robot).max() < 1e-10


@pytest.mark.parametrize("name", WITH_INERTIA)
def test_load_counts_as_in_pinocchio(name):
    robot = catalog.load(name)
    load = Payload(1.5, (0.02, -0.03, 0.1))
    physics = Physics(TrueArm(payload=load).chain(robot), 1e-3)
    assert differences(physics, robot.with_payload(load).model, robot).max() < 1e-10


def inertia_and_bias(chain, robot):
    """M and h at one moving state."""
    physics = Physics(chain, 1e-3)
    physics.reset(robot.neutral, np.linspace(-1.0, 1.0, robot.nv))
    return physics.mass_matrix(), physics.bias.copy()


def test_scaled_masses_scale_inertia_and_bias_but_not_the_rotors(panda):
    M, h = inertia_and_bias(panda.chain, panda)
    M_true, h_true = inertia_and_bias(TrueArm(mass_scale=1.2).chain(panda), panda)
    rotors = np.diag(panda.chain.armature)
    np.testing.assert_allclose(M_true - rotors, 1.2 * (M - rotors), rtol=0, atol=1e-12)
    np.testing.assert_allclose(h_true, 1.2 * h, rtol=0, atol=1e-11)


@pytest.mark.parametrize(
    ("rotors", "added"), [(0.1, [0.1] * 7), ({"panda_joint2": 0.3}, [0.0, 0.3] + [0.0] * 5)]
)
def test_rotors_add_to_the_inertia_of_their_own_joint_and_to_nothing_else(panda, rotors, added):
    M, h = inertia_and_bias(panda.chain, panda)
    M_true, h_true = inertia_and_bias(TrueArm(rotors=rotors).chain(panda), panda)
    np.testing.assert_allclose(M_true - M, np.diag(added), rtol=0, atol=1e-12)
    np.testing.assert_allclose(h_true, h, rtol=0, atol=1e-11)
    np.testing.assert_allclose(TrueArm(rotors=rotors).geared(panda).chain.armature, added)


def test_rotors_are_not_scaled_with_the_masses_and_add_to_those_of_the_model():
    xarm = catalog.load("xarm7")
    chain = TrueArm(rotors=0.1, mass_scale=1.5).chain(xarm)
    np.testing.assert_allclose(chain.armature, xarm.chain.armature + 0.1, atol=1e-15)


def test_load_of_an_arm_with_scaled_masses_keeps_its_own_mass(panda):
    load = Payload(2.0, (0.0, 0.0, 0.1), np.diag([0.01, 0.01, 0.02]))
    adds = (
        inertia_and_bias(panda.with_payload(load).chain, panda)[0] - inertia_and_bias(panda.chain, panda)[0]
    )
    heavy = TrueArm(mass_scale=1.2), TrueArm(mass_scale=1.2, payload=load)
    bare, carrying = (inertia_and_bias(true.chain(panda), panda)[0] for true in heavy)
    np.testing.assert_allclose(carrying - bare, adds, rtol=0, atol=1e-12)


def test_equations_stay_those_of_pinocchio_after_lock_and_release(panda):
    physics = Physics(panda.chain, 1e-3)
    physics.reset(panda.neutral, np.full(7, 0.3))
    physics.fix(2)
    physics.resist(4, 50.0, 3.0)
    for _ in range(20):
        physics.step()
    physics.release(2)
    physics.resist(4, 0.0, 0.0)
    assert differences(physics, panda.model, panda).max() < 1e-10


def test_impulse_of_a_fixed_joint_keeps_the_momentum_of_the_others(panda):
    physics = Physics(panda.chain, 1e-3)
    v = np.linspace(-0.5, 1.0, 7)
    physics.reset(panda.neutral, v)
    M = physics.mass_matrix()
    physics.fix(3)
    assert physics.v[3] == 0.0
    others = [0, 1, 2, 4, 5, 6]
    np.testing.assert_allclose((M @ physics.v)[others], (M @ v)[others], atol=1e-12)


def test_joint_outside_its_end_stop_comes_back_without_rebound(panda):
    physics = Physics(panda.chain, 2.5e-4)
    physics.reset(panda.neutral, np.zeros(7))
    physics.stop_at(6, -0.5, 0.5)
    physics.q[6], physics.v[6] = 0.49, 2.0
    speeds = []
    for _ in range(200):
        physics.tau[:] = physics.bias
        physics.step()
        speeds.append(physics.v[6])
    assert 0.5 - 1e-3 < physics.q[6] < 0.5 + 1e-3
    assert min(speeds) > -0.05


def test_broken_motion_is_told_with_time_and_joint_and_leaves_no_file(panda, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    physics = Physics(panda.chain, 1e-3)
    physics.reset(panda.neutral, np.zeros(7))
    assert physics.failure is None
    physics.step()
    physics.tau[4] = np.nan
    physics.step()
    assert physics.failure is not None
    assert "panda_joint5" in physics.failure
    assert "t = 0.00" in physics.failure
    assert not list(tmp_path.iterdir())
    physics.reset(panda.neutral, np.zeros(7))
    assert physics.failure is None
