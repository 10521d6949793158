"""A detector alone: what it says of sensors and joints, and what it takes."""

from types import SimpleNamespace

import numpy as np
import pytest
from tests.shaken import DT, SIGMA, Shaken, watch

import ftqp
from ftqp.core.errors import InputError

TICKS = 700
AT = 500


@pytest.fixture(scope="module")
def motion(robot):
    return Shaken(robot, TICKS)


def test_noise_alone_raises_no_suspicion(detector, motion):
    diagnosis = watch(detector, motion, motion.q)
    assert not diagnosis.watching and not diagnosis.isolated and 0.0 < diagnosis.suspicion < 1.0


@pytest.mark.parametrize("joint", [0, 6])
def test_joint_that_stops_is_locked_or_held_by_friction(detector, motion, joint):
    q = motion.q
    q[AT:, joint] = motion.true[AT, joint] + motion.noise[AT:, joint]
    diagnosis = watch(detector, motion, q)
    assert set(diagnosis.isolated) == {f"panda_joint{joint + 1}"}
    found = diagnosis.isolated[f"panda_joint{joint + 1}"]
    assert "locked" in found.kinds and found.sentence.startswith(f"panda_joint{joint + 1} does not move")
    assert AT * DT < found.detected_at < (AT + 50) * DT
    assert abs(found.onset - AT * DT) < 0.01


@pytest.mark.parametrize(("held", "named"), [(0.012, set()), (np.inf, {"panda_joint7"})])
def test_joint_that_stood_when_its_reference_turned_is_locked_only_if_friction_would_let_it_go(
    detector, robot, held, named
):
    motion = Shaken(robot, 2000)
    q, turned = motion.q, 1770
    behind = np.clip(motion.true[turned:, 6] - motion.true[turned, 6], -held, held)
    q[turned:, 6] -= behind
    assert set(watch(detector, motion, q).isolated) == named


@pytest.mark.parametrize(
    ("kind", "within"), [("sensor_dropped", 4), ("sensor_frozen", 6), ("sensor_biased", 5)]
)
def test_sensor_is_found_within_milliseconds(detector, motion, kind, within):
    q = motion.q
    if kind == "sensor_biased":
        q[AT:, 2] += 0.02
    else:
        q[AT:, 2] = np.nan if kind == "sensor_dropped" else q[AT, 2]
    diagnosis = watch(detector, motion, q[: AT + within])
    found = diagnosis.isolated["panda_joint3"]
    assert found.kind == kind and found.onset == pytest.approx(AT * DT, abs=1.5 * DT)
    if kind == "sensor_biased":
        assert found.size == pytest.approx(0.02, abs=2e-3)


@pytest.mark.parametrize("glitches", [1, 2])
def test_glitch_is_no_biased_sensor_and_raises_no_suspicion(detector, motion, glitches):
    q = motion.q
    q[AT : AT + glitches, 2] += 0.5
    diagnosis = watch(detector, motion, q)
    assert not diagnosis.isolated and not diagnosis.watching


def test_coarse_encoder_that_repeats_its_number_is_not_called_frozen(robot, motion):
    detector = ftqp.Detector(robot=robot, dt=DT, noise=ftqp.Noise(q=1e-6), quantum=1e-3)
    q = 1e-3 * np.round(motion.true / 1e-3)
    assert (np.diff(q, 8, axis=0) == 0.0).any(), "some numbers are repeated nine times"
    diagnosis = watch(detector, motion, q)
    assert not any("sensor_frozen" in found.kinds for found in diagnosis.isolated.values())


def test_believed_joint_is_not_diagnosed_again_and_the_others_are(detector, motion):
    q = motion.q
    q[AT:, 2] = q[AT, 2]
    watch(detector, motion, q[: AT + 10])
    detector.believe(ftqp.Locked("panda_joint3"))
    q[AT + 60 :, 4] = np.nan
    for k in range(AT + 10, AT + 80):
        diagnosis = watch(detector, motion, q[: k + 1], first=k)
    assert diagnosis.isolated["panda_joint5"].kind == "sensor_dropped"


def test_joint_at_rest_says_what_cannot_be_seen(detector, robot):
    still = Shaken(robot, 50, speed=0.0)
    diagnosis = watch(detector, still, still.q)
    assert "a lock" in diagnosis.of("panda_joint2").unobservable
    assert detector.wants_probing("panda_joint2")


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
        ({"bandwidths": (200.0, 60.0)}, "slow one first"),
        ({"drive": "steam"}, "steam"),
        ({"delay": 1.0}, "at most"),
        ({"patience": -1.0}, "patience"),
    ],
)
def test_wrong_settings_are_refused(robot, wrong, sentence):
    with pytest.raises(InputError, match=sentence):
        ftqp.Detector(robot=robot, dt=DT, **wrong)


def test_what_is_no_fault_is_not_believed(detector):
    for strange in (SimpleNamespace(joint=2), "locked", None):
        with pytest.raises(InputError, match="is not a fault; expected"):
            detector.believe(strange)
