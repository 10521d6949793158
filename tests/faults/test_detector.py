"""A detector alone: what it says of sensors and joints beside somebody else's planner, and what it takes."""

from types import SimpleNamespace

import numpy as np
import pytest
from tests.shaken import DT, SIGMA, Shaken, watch

import ftqp
from ftqp.core.errors import InputError

TICKS = 1500
AT = 1200


@pytest.fixture(scope="module")
def motion(robot):
    return Shaken(robot, TICKS)


def by_torque(robot, motion, q):
    """The diagnosis of an arm that is sent the torques that its reference takes, and feedback."""
    drive = ftqp.Drive(kind="torque", inertia_error=0.0)
    detector = ftqp.Detector(robot=robot, dt=DT, drive=drive, noise=ftqp.Noise(q=SIGMA))
    pushes = np.diag(robot.mass_matrix(robot.neutral)) * 1600.0
    for k, tau in enumerate(motion.torques[: len(q)]):
        reference = motion.q_ref[k], motion.v_ref[k], motion.a_ref[k]
        sent = tau + pushes * (motion.true[k] - q[k] + motion.noise[k])
        diagnosis = detector.update(q[k], None, None, ftqp.Commanded(*reference, sent))
    return diagnosis


def test_noise_alone_raises_no_suspicion(detector, motion):
    diagnosis = watch(detector, motion, motion.q)
    assert not diagnosis.watching and not diagnosis.isolated


@pytest.mark.parametrize(("drive", "joint"), [("position", 0), ("position", 6), ("torque", 0), ("torque", 3)])
def test_joint_that_stops_is_locked(robot, detector, motion, drive, joint):
    q = motion.q
    q[AT:, joint] = motion.true[AT, joint] + motion.noise[AT:, joint]
    diagnosis = watch(detector, motion, q) if drive == "position" else by_torque(robot, motion, q)
    assert set(diagnosis.isolated) == {f"panda_joint{joint + 1}"}
    found = diagnosis.isolated[f"panda_joint{joint + 1}"]
    assert found.kind == "locked" and found.sentence.startswith(f"panda_joint{joint + 1} does not move")
    assert AT * DT < found.onset < found.detected_at < (AT + 300) * DT


def test_torques_of_a_healthy_arm_raise_no_suspicion(robot, motion):
    diagnosis = by_torque(robot, motion, motion.q)
    assert not diagnosis.watching and not diagnosis.isolated


@pytest.mark.parametrize("kind", ["sensor_dropped", "sensor_biased"])
def test_sensor_is_found_when_patience_is_at_an_end(detector, motion, kind):
    q = motion.q
    if kind == "sensor_biased":
        q[AT:, 2] += 0.2
    else:
        q[AT:, 2] = np.nan
    diagnosis = watch(detector, motion, q[: AT + 30])
    assert diagnosis.isolated["panda_joint3"].kind == kind


@pytest.mark.parametrize("glitches", [1, 2])
def test_glitch_is_no_biased_sensor_and_raises_no_suspicion(detector, motion, glitches):
    q = motion.q
    q[AT : AT + glitches, 2] += 0.5
    diagnosis = watch(detector, motion, q)
    assert not diagnosis.isolated and not diagnosis.watching


def test_believed_joint_is_not_diagnosed_again_and_the_others_are(detector, motion):
    q = motion.q
    q[AT:, 2] = motion.true[AT, 2] + motion.noise[AT:, 2]
    detector.believe(ftqp.Locked("panda_joint3"))
    q[AT + 60 :, 4] = np.nan
    diagnosis = watch(detector, motion, q)
    assert set(diagnosis.isolated) == {"panda_joint5"}
    detector.forget("panda_joint5")
    assert not diagnosis.isolated


def test_what_was_found_is_forgotten_after_a_reset(detector, motion):
    q = motion.q
    q[AT:, 2] = np.nan
    assert watch(detector, motion, q).isolated
    detector.reset()
    assert not detector.diagnosis.isolated
    assert not watch(detector, motion, motion.q).isolated


def test_joint_at_rest_says_what_cannot_be_seen(detector, robot):
    still = Shaken(robot, 50, speed=0.0)
    diagnosis = watch(detector, still, still.q)
    assert "a lock" in diagnosis.of("panda_joint2").unobservable


@pytest.mark.parametrize("spoilt", ["q_ref", "v_ref", "a_ref", "q", "tau"])
def test_no_number_makes_update_raise(robot, motion, spoilt):
    detector = ftqp.Detector(robot=robot, dt=DT, drive="torque", noise=ftqp.Noise(q=SIGMA, tau=0.3))
    rest = np.zeros(7)
    for k in range(400):
        given = {name: getattr(motion, name)[k] for name in ("q", "q_ref", "v_ref", "a_ref")} | {"tau": rest}
        if k % 7 == 3:
            given[spoilt] = np.array([np.nan, np.inf, -np.inf, 1e308, 0.0, 0.0, 0.0])
        command = ftqp.Commanded(given["q_ref"], given["v_ref"], given["a_ref"], rest)
        diagnosis = detector.update(given["q"], None, given["tau"], command)
    assert diagnosis is detector.diagnosis


@pytest.mark.parametrize("spoilt", ["q", "reference", "tau"])
def test_wrong_shapes_are_named(detector, robot, spoilt):
    right, wrong = np.zeros(7), np.zeros(6)
    command = ftqp.Commanded(wrong if spoilt == "reference" else right, right, right)
    with pytest.raises(InputError, match=r"\(nv,\) = \(7,\)"):
        detector.update(wrong if spoilt == "q" else right, None, wrong if spoilt == "tau" else None, command)


def test_detector_without_arm_says_what_it_lacks(robot):
    detector = ftqp.Detector()
    with pytest.raises(InputError, match="knows no arm"):
        detector.update(np.zeros(7), None, None, ftqp.Commanded(*np.zeros((3, 7))))
    working = detector.for_arm(robot, DT, drive=ftqp.Drive(latency=2e-3), noise=ftqp.Noise(q=SIGMA))
    assert working.update(robot.neutral, None, None, ftqp.Commanded(robot.neutral, *np.zeros((2, 7)))).joints


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"false_alarms_per_hour": 0.0}, "false_alarms_per_hour"),
        ({"drive": "steam"}, "steam"),
        ({"delay": 1.0}, "at most"),
        ({"delay": -1.0}, "delay"),
    ],
)
def test_wrong_settings_are_refused(robot, wrong, sentence):
    with pytest.raises(InputError, match=sentence):
        ftqp.Detector(robot=robot, dt=DT, **wrong)


@pytest.mark.parametrize(
    "old", [{"bandwidths": (60.0, 200.0)}, {"patience": 0.02}, {"quantum": 0.0}, {"probe_after": 0.5}]
)
def test_settings_of_the_detector_before_warn_and_change_nothing(robot, motion, old):
    with pytest.warns(DeprecationWarning, match=f"{next(iter(old))} of a detector: no effect any more"):
        detector = ftqp.Detector(robot=robot, dt=DT, noise=ftqp.Noise(q=SIGMA), **old)
    assert not watch(detector, motion, motion.q).isolated


def test_what_is_no_fault_is_not_believed(detector):
    for strange in (SimpleNamespace(joint=2), "locked", None):
        with pytest.raises(InputError, match="is not a fault; expected"):
            detector.believe(strange)


def test_detector_prints_how_often_it_may_be_wrong():
    assert repr(ftqp.Detector(false_alarms_per_hour=0.01)) == "Detector(false_alarms_per_hour=0.01)"
