"""A motion that excites an arm, the log of its torques, and what is found from it."""

import numpy as np
import pytest

import ftqp
from ftqp.model.fitting.fitted_arm import KINDS, symmetric, torques
from ftqp.model.fitting.torque_log import Pieces, pieces_of


def test_it_begins_and_ends_at_rest_where_it_is_told(panda, motion):
    for end in (0, -1):
        np.testing.assert_allclose(motion.q[end], panda.neutral, atol=1e-12)
        np.testing.assert_allclose(motion.v[end], 0.0, atol=1e-12)
        np.testing.assert_allclose(motion.a[end], 0.0, atol=1e-12)


def test_it_keeps_limits(panda, motion):
    limits = panda.limits
    assert (motion.q > limits.q_min).all() and (motion.q < limits.q_max).all()
    assert (np.abs(motion.v) <= 0.61 * limits.v_max).all()
    assert (np.abs(motion.a) <= 0.61 * limits.a_max).all()
    tau = [panda.mass_matrix(q) @ a + panda.bias(q, v) for q, v, a in
           zip(motion.q[::50], motion.v[::50], motion.a[::50], strict=True)]  # fmt: skip
    assert (np.abs(tau) <= 0.75 * limits.tau_max).all()


def test_it_is_made_smaller_until_it_is_clear(panda):
    def near(q):
        return bool(np.abs(q - panda.neutral).max() < 0.3)

    motion = ftqp.exciting_motion(panda, duration=6.0, dt=0.01, clear=near)
    assert near(motion.q)


@pytest.mark.slow
def test_where_no_size_is_clear_there_is_no_motion(panda):
    with pytest.raises(ftqp.InputError, match="no motion of panda from this posture is clear"):
        ftqp.exciting_motion(panda, duration=6.0, dt=0.01, clear=lambda q: False)


def test_too_short_a_motion_is_refused(panda):
    with pytest.raises(ftqp.InputError, match="duration is 3 s, expected 6 s or more"):
        ftqp.exciting_motion(panda, duration=3.0)


def wave(t):
    q = np.stack([np.sin(2.0 * t), 0.5 * np.cos(3.0 * t)], axis=1)
    return ftqp.TorqueLog(t=t, q=q, tau=q)


@pytest.mark.parametrize("jitter", [0.0, 0.4])
def test_speed_and_acceleration_are_those_of_the_motion(jitter):
    t = np.arange(0.0, 5.0, 0.004)
    pieces = pieces_of(wave(t + jitter * 0.004 * np.random.default_rng(0).random(len(t))))
    np.testing.assert_allclose(pieces.v[:, 0], 2.0 * np.cos(2.0 * pieces.t), atol=1e-3)
    np.testing.assert_allclose(pieces.a[:, 0], -4.0 * np.sin(2.0 * pieces.t), atol=1e-2)


def test_torques_that_act_later_are_put_beside_their_positions():
    t, late = np.arange(0.0, 5.0, 0.004), 0.01
    q = np.sin(2.0 * t)[:, None]
    pieces = pieces_of(ftqp.TorqueLog(t=t, q=np.sin(2.0 * (t - late))[:, None], tau=q, late=late))
    np.testing.assert_allclose(pieces.q, pieces.tau, atol=1e-4)


def test_samples_that_are_too_rare_are_refused():
    with pytest.raises(ftqp.InputError, match="has 10 samples a second, expected 33 at least"):
        pieces_of(wave(np.arange(0.0, 20.0, 0.1)))


@pytest.mark.parametrize(
    ("t", "q", "message"),
    [
        ([0.0, 0.1, 0.1] * 4, np.zeros((12, 2)), "t of the log does not rise from row 1"),
        (np.arange(12.0), np.full((12, 2), np.nan), "q of the log is not finite at row 0"),
        (np.arange(12.0), np.zeros((11, 2)), r"expected \(K,\), \(K, nv\) and \(K, nv\)"),
        (np.arange(3.0), np.zeros((3, 2)), "the log has 3 samples"),
        (np.arange(12.0), "positions", "q of the log is not an array of numbers"),
    ],
)
def test_what_is_no_log_is_refused(t, q, message):
    with pytest.raises(ftqp.InputError, match=message):
        ftqp.TorqueLog(t=t, q=q, tau=np.zeros((12, 2)) if np.shape(q) != (3, 2) else q)  # type: ignore[arg-type]


def _at(motion):
    every = slice(100, None, 400)
    q, v, a = motion.q[every], motion.v[every], motion.a[every]
    return Pieces(motion.t[every], q, v, a, np.zeros_like(q), 0.0, 0.0)


def test_torques_are_those_of_the_model(panda, motion):
    robot, at = panda.with_friction(viscous=0.4).with_rotors(0.1), _at(motion)
    own = [robot.mass_matrix(q) @ a + robot.bias(q, v) for q, v, a in zip(at.q, at.v, at.a, strict=True)]
    np.testing.assert_allclose(torques(robot, at), own, atol=1e-10)


def test_a_load_is_linear_in_mass_moments_and_inertia(panda, motion):
    load, at = ftqp.Payload(2.0, (0.05, -0.1, 0.2), np.diag([0.01, 0.02, 0.025])), _at(motion)
    about = np.array(load.inertia) + load.mass * (
        load.com @ load.com * np.eye(3) - np.outer(load.com, load.com)
    )
    six = [about[i, j] for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))]
    np.testing.assert_allclose(symmetric(np.array(six)), about)
    unknown = np.array([load.mass, *(load.mass * load.com), *six])
    added = torques(panda.with_payload(load), at) - torques(panda, at)
    columns = KINDS["load"].columns(panda, at, added)
    np.testing.assert_allclose(columns @ unknown, added, atol=1e-10)


@pytest.fixture(scope="module")
def found(panda, log):
    return ftqp.fitted_arm(panda, log)


def test_rotors_and_friction_are_found_to_a_tenth(found, truth):
    for name in ("rotors", "coulomb", "viscous"):
        shown = ~found.not_shown[name]
        assert shown.sum() >= 6
        wrong = np.abs(getattr(found, name) / getattr(truth, name) - 1.0)
        assert wrong[shown].max() < 0.1, name


def test_a_load_is_found_to_a_twentieth_and_its_centre_to_5_mm(found, truth):
    payload = found.payload
    assert payload is not None
    assert payload.mass == pytest.approx(truth.payload.mass, rel=0.05)
    np.testing.assert_allclose(payload.com, truth.payload.com, atol=5e-3)


def test_gains_and_offsets_of_the_log_are_found_where_they_are_told(found, truth):
    assert np.abs(found.gains - truth.gains)[~found.not_shown["gains"]].max() < 0.02
    assert np.abs(found.offsets - truth.offsets)[~found.not_shown["offsets"]].max() < 5e-3


def test_the_truth_lies_within_three_standard_errors(found, truth):
    for name in ("rotors", "coulomb", "viscous", "gains", "offsets"):
        z = (getattr(found, name) - getattr(truth, name)) / found.errors[name]
        assert np.abs(z).max() < 3.5, name


def test_what_a_joint_that_stands_has_is_not_shown(panda, motion, truth):
    from tests.model.fitting.conftest import recorded

    q, v, a = motion.q.copy(), motion.v.copy(), motion.a.copy()
    q[:, 2], v[:, 2], a[:, 2] = q[0, 2], 0.0, 0.0
    still = ftqp.ExcitingMotion(t=motion.t, q=q, v=v, a=a)
    found = ftqp.fitted_arm(panda, recorded(panda, still, truth))
    for name in ("rotors", "coulomb", "viscous"):
        assert found.not_shown[name][2], name
        assert not found.not_shown[name][[1, 3]].any(), name
    assert found.fitted.chain.armature[2] == panda.chain.armature[2]
    with pytest.warns(DeprecationWarning, match="not_shown now"):
        assert found.untold is found.not_shown


def test_a_motion_that_excites_nothing_is_refused(panda):
    t = np.arange(0.0, 5.0, 0.002)
    rest = np.tile(panda.neutral, (len(t), 1))
    with pytest.raises(ftqp.InputError, match=r"no joint of the log moves by 0.01 rad"):
        ftqp.fitted_arm(panda, ftqp.TorqueLog(t=t, q=rest, tau=np.ones_like(rest)))


def test_a_log_of_another_arm_is_refused(panda, log):
    with pytest.raises(
        ftqp.InputError, match=r"panda does not explain the log: of the .* N m of panda_joint2"
    ):
        turned = log.tau.copy()
        turned[:, 1] *= -1.0
        ftqp.fitted_arm(panda, ftqp.TorqueLog(t=log.t, q=log.q, tau=turned))
    with pytest.raises(ftqp.InputError, match=r"the log is of another arm, or in degrees"):
        ftqp.fitted_arm(panda, ftqp.TorqueLog(t=log.t, q=np.rad2deg(log.q), tau=log.tau))
    with pytest.raises(ftqp.InputError, match=r"has 6 joints, but panda has 7"):
        ftqp.fitted_arm(panda, ftqp.TorqueLog(t=log.t, q=log.q[:, :6], tau=log.tau[:, :6]))


@pytest.mark.parametrize(
    ("unknowns", "message"),
    [(("rotor",), "'rotor' is not an? unknown of an arm"), ((), "no log or no unknown was given")],
)
def test_kinds_that_are_none_are_refused(panda, log, unknowns, message):
    with pytest.raises(ftqp.InputError, match=message):
        ftqp.fitted_arm(panda, log, unknowns=unknowns)
