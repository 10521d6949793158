"""Kinematics and dynamics of chains and trees against pinocchio, joints of every kind, tips anywhere."""

from functools import partial
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from random_chains import random_model
from records import empty_record

from ftqp.kernel.arm.dynamics import dynamics, gravity_torque, torques_of
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.entry.session import ArmSession
from ftqp.kernel.layout.record import load_chain
from ftqp.model.chain import chain_of
from ftqp.model.followers import Follower

random_tree = partial(random_model, branching=0.35)


def configuration(rng: np.random.Generator, model: Any) -> tuple[Any, Any, Any]:
    """Joint values (nv,), pinocchio's configuration (nq,) for them, and velocities (nv,)."""
    q, full = rng.uniform(-3.0, 3.0, model.nv), np.empty(model.nq)
    for i, at in enumerate(model.idx_qs[1:]):
        if model.nqs[i + 1] == 2:
            full[at : at + 2] = np.cos(q[i]), np.sin(q[i])
        else:
            full[at] = q[i]
    return q, full, rng.uniform(-2.0, 2.0, model.nv)


SIZES = (*range(2, 13), 16, 20, 25, 32, 40, 64)
BRANCHING = 0.0, 0.35


def close(found, expected, least=1.0):
    """Whether two arrays are the same to rounding; a tip at the root of a tree has numbers that vanish."""
    return np.abs(found - expected).max() <= 1e-12 * max(np.abs(expected).max(), least)


def inertia_matrix(model, full):
    """M, a column for each unit acceleration: ``crba`` is right for trees in depth-first order only."""
    data, rest = model.createData(), np.zeros(model.nv)
    gravity = pin.rnea(model, data, full, rest, rest)
    return np.array([pin.rnea(model, data, full, rest, unit) - gravity for unit in np.eye(model.nv)]).T


@pytest.mark.parametrize("branching", BRANCHING)
@pytest.mark.parametrize("joints", SIZES)
def test_jacobian_drift_inertia_and_bias_agree_with_pinocchio(joints, branching):
    rng = np.random.default_rng(joints)
    branched, alike = 0, partial(close, least=float(branching > 0.0))
    for _ in range(6):
        model = random_model(rng, joints, branching)
        chain = chain_of(model, "tip")
        branched += not chain.is_serial
        arm, data, tip = ArmSession(chain.constants()), model.createData(), model.getFrameId("tip")
        for _ in range(3):
            q, full, v = configuration(rng, model)
            arm.dynamics(q, v)
            X = arm.K.kinematics
            bias = pin.rnea(model, data, full, v, np.zeros(joints))
            M = X.M[:joints, :joints]
            assert alike(M, inertia_matrix(model, full)) and np.array_equal(M, M.T)
            assert alike(X.h[:joints], bias)
            pin.forwardKinematics(model, data, full, v, np.zeros(joints))
            pin.updateFramePlacements(model, data)
            J = pin.computeFrameJacobian(model, data, full, tip, pin.LOCAL_WORLD_ALIGNED)
            drift = pin.getFrameClassicalAcceleration(model, data, tip, pin.LOCAL_WORLD_ALIGNED)
            assert alike(X.J[:, :joints], J) and alike(X.drift, drift.vector)
            assert alike(X.o_tip, data.oMf[tip].translation)
            assert alike(X.R_tip.reshape(3, 3), data.oMf[tip].rotation)
    assert branched >= 4 * (branching > 0.0 and joints > 2)


@pytest.mark.parametrize("branching", BRANCHING)
@pytest.mark.parametrize("joints", [1, 2, 3, 5, 8])
def test_torques_of_an_acceleration_agree_with_pinocchio_and_leave_the_snapshot(joints, branching):
    rng = np.random.default_rng(joints)
    for _ in range(4):
        model, viscous = random_model(rng, joints, branching), rng.uniform(0.0, 2.0, joints)
        K, a, (q, full, v) = empty_record(), 5.0 * rng.normal(size=joints), configuration(rng, model)
        load_chain(K, **chain_of(model, "tip").constants())
        K.state.q[:joints], K.state.v[:joints], K.chain.viscous[:joints] = q, v, viscous
        forward_kinematics(K, K.state)
        motion(K, K.state)
        dynamics(K, K.state)
        M, h = K.kinematics.M.copy(), K.kinematics.h.copy()
        for _ in range(2):
            torques_of(K.state, K.kinematics, K.chain, a)
            expected = pin.rnea(model, model.createData(), full, v, a) + viscous * v
            assert close(K.kinematics.tau[:joints], expected, float(branching > 0.0))
        dynamics(K, K.state)
        assert np.array_equal(K.kinematics.M, M) and np.array_equal(K.kinematics.h, h)


@pytest.mark.parametrize("branching", BRANCHING)
@pytest.mark.parametrize("joints", [2, 3, 5, 7, 8])
def test_torque_of_gravity_is_pinocchio_s_and_its_gradient_that_of_finite_differences(joints, branching):
    rng = np.random.default_rng(joints)
    for _ in range(4):
        model = random_model(rng, joints, branching)
        K, slope, step = empty_record(), np.zeros(joints), 1e-6
        load_chain(K, **chain_of(model, "tip").constants())
        q, full, _ = configuration(rng, model)
        K.state.q[:joints] = q
        forward_kinematics(K, K.state)

        def gravity(change, model=model, full=full):
            return pin.computeGeneralizedGravity(
                model, model.createData(), pin.integrate(model, full, change)
            )

        expected = np.array(gravity(np.zeros(joints)))
        for i in range(joints):
            g = gravity_torque(K.kinematics, K.chain, i, slope)
            assert abs(g - expected[i]) <= 1e-12 * np.abs(expected).max()
            for j in range(joints):
                d = step * np.eye(joints)[j]
                change = (gravity(d)[i] - gravity(-d)[i]) / (2.0 * step)
                assert abs(slope[j] - change) < 1e-7 * np.abs(expected).max()


COUPLED = (3, 5, 8, 13, 21, 40)


def couple(rng, model):
    """Followers of a tree, one joint in three, and the matrix E with v = E v_leaders."""
    names = [str(name) for name in model.names][1:]
    plain = [i for i in range(len(names)) if model.nqs[i + 1] == 1]
    order = rng.permutation(plain)
    count = max(1, len(plain) // 3)
    led, leaders = order[:count], order[count:]
    followers, E = {}, np.eye(len(names))
    for m in led:
        leader = int(rng.choice(leaders))
        ratio, offset = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.2, 2.0)), float(rng.uniform(-0.5, 0.5))
        followers[names[m]] = Follower(leader=names[leader], ratio=ratio, offset=offset)
        E[m, m], E[m, leader] = 0.0, ratio
    return followers, E


@pytest.mark.parametrize("joints", COUPLED)
def test_folded_jacobian_drift_inertia_and_bias_agree_with_pinocchio(joints):
    rng = np.random.default_rng(100 + joints)
    for _ in range(4):
        model = random_tree(rng, joints)
        if sum(n == 1 for n in model.nqs) < 3:
            continue
        followers, E = couple(rng, model)
        chain = chain_of(model, "tip", followers=followers)
        arm, data, tip = ArmSession(chain.constants()), model.createData(), model.getFrameId("tip")
        q, _, v = configuration(rng, model)
        q = np.where(chain.lead != np.arange(joints), chain.ratio * q[chain.lead] + chain.offset, q)
        v = E @ v
        arm.dynamics(q, v)
        X, full = arm.K.kinematics, np.empty(model.nq)
        for i, at in enumerate(model.idx_qs[1:]):
            full[at : at + model.nqs[i + 1]] = (np.cos(q[i]), np.sin(q[i])) if model.nqs[i + 1] == 2 else q[i]
        M = E.T @ inertia_matrix(model, full) @ E
        leads = chain.lead == np.arange(joints)
        assert close(X.M[:joints, :joints][np.ix_(leads, leads)], M[np.ix_(leads, leads)])
        assert not X.M[:joints, :joints][np.ix_(leads, ~leads)].any()
        assert close(X.h[:joints], E.T @ pin.rnea(model, data, full, v, np.zeros(joints)))
        pin.forwardKinematics(model, data, full, v, np.zeros(joints))
        pin.updateFramePlacements(model, data)
        J = pin.computeFrameJacobian(model, data, full, tip, pin.LOCAL_WORLD_ALIGNED)
        drift = pin.getFrameClassicalAcceleration(model, data, tip, pin.LOCAL_WORLD_ALIGNED)
        assert close(X.J[:, :joints], J @ E) and close(X.drift, drift.vector)
        assert close(X.J[:, :joints] @ v, J @ v)


def test_places_of_followers_are_taken_as_a_caller_gives_them():
    rng = np.random.default_rng(3)
    model = random_tree(rng, 8)
    followers, _ = couple(rng, model)
    chain = chain_of(model, "tip", followers=followers)
    arm = ArmSession(chain.constants())
    q, _, v = configuration(rng, model)
    arm.dynamics(q, v)
    placed = arm.K.kinematics.o_tip.copy()
    arm.dynamics(q, v)
    assert np.array_equal(arm.K.kinematics.o_tip, placed)
    arm.dynamics(np.where(chain.lead != np.arange(8), q + 1.0, q), v)
    assert not np.allclose(arm.K.kinematics.o_tip, placed)
