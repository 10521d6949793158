"""What a residual stands for: a load unknown to the model, or the joint at fault; filtered accelerations."""

import numpy as np
import pytest
from scipy import signal
from tests.shaken import DT, SIGMA, Shaken, watch

import ftqp
from ftqp.faults.detection.residual_thresholds import noise_of_acceleration
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


AT = 400


@pytest.mark.parametrize("name", ["panda", "iiwa14"])
@pytest.mark.parametrize("joint", range(7))
def test_joint_is_found_though_others_move_more(name, joint):
    robot = ftqp.robots.load(name)
    motion = Shaken(robot, AT + 25, speed=0.3, seed=joint)
    detector = ftqp.Detector(robot=robot, dt=DT, noise=ftqp.Noise(q=SIGMA))
    q = motion.q
    along = np.linalg.inv(robot.mass_matrix(motion.true[AT]))[:, joint]
    t = DT * np.arange(25)
    q[AT:] += np.outer(0.5 * t * t, 200.0 * along / np.abs(along).max())
    diagnosis = watch(detector, motion, q)
    assert diagnosis.suspect == robot.joints[joint]


BANDWIDTHS = (60.0, 200.0)


def observed(robot, samples, sigma=0.0):
    """d of both observers at every tick, (2, K, nv), of an arm whose reference rests at zero."""
    n = robot.nv
    detector = ftqp.Detector(robot=robot, dt=DT, bandwidths=BANDWIDTHS, noise=ftqp.Noise(q=sigma))
    d = np.zeros((2, len(samples), n))
    rest = ftqp.Commanded(*np.zeros((3, n)))
    for k, sample in enumerate(samples):
        detector.update(sample, None, None, rest)
        d[:, k] = detector._session.D.d[:, :n]
    return d


@pytest.fixture(scope="module")
def robot():
    return ftqp.robots.load("panda")


@pytest.mark.parametrize("bank", [0, 1])
def test_step_of_acceleration_comes_out_as_three_poles_make_it(robot, bank):
    ticks = 250
    t = DT * np.arange(ticks)
    d = observed(robot, np.outer(0.5 * t * t, np.ones(7)))[bank]
    p = np.exp(-BANDWIDTHS[bank] * DT)
    steps = np.ones(ticks)
    steps[0] = 0.0  # the acceleration of the tick that ends with each sample
    b, a = (1.0 - p) ** 3 * np.array([0.5, 0.5]), np.poly([p, p, p])
    expected = signal.lfilter(b, a, steps)
    np.testing.assert_allclose(d[2:], np.tile(expected[2:, None], 7), atol=1e-9)
    continuous = signal.step(signal.lti([], [-BANDWIDTHS[bank]] * 3, BANDWIDTHS[bank] ** 3), T=t)[1]
    np.testing.assert_allclose(d[:, 0], continuous, atol=0.08)


@pytest.mark.parametrize("bank", [0, 1])
def test_noise_of_an_observed_acceleration_is_as_derived(robot, bank):
    noise = SIGMA * np.random.default_rng(0).standard_normal((20_000, 7))
    d = observed(robot, noise, SIGMA)[bank, 300:]
    assert d.std() == pytest.approx(noise_of_acceleration(SIGMA, BANDWIDTHS[bank], DT), rel=0.06)


@pytest.mark.parametrize("delay", [0, 3])
def test_reference_that_is_followed_late_by_the_delay_leaves_no_acceleration(robot, delay):
    motion = Shaken(robot, 600)
    detector = ftqp.Detector(robot=robot, dt=DT, delay=delay * DT)
    late = np.concatenate([np.tile(motion.true[0], (delay, 1)), motion.true])[: len(motion.true)]
    watch(detector, motion, late)
    assert np.abs(detector._session.D.d[:, :7]).max() < 1e-6
