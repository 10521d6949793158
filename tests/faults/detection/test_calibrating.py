"""Calibration from healthy motion, and the logs that it refuses."""

import numpy as np
import pinocchio as pin
import pytest
from tests.shaken import DT, SIGMA, Shaken

import ftqp
from ftqp.core.errors import InputError

TICKS = 50_000
RATE = 4000.0


@pytest.fixture(scope="module")
def motion(robot):
    return Shaken(robot, TICKS)


@pytest.fixture(scope="module")
def calibrated(robot, motion):
    return ftqp.Detector(robot=robot, dt=DT, noise=ftqp.Noise(q=SIGMA)).calibrate(motion.log(), RATE)


def changed(motion, **columns):
    return ftqp.MotionLog(**(motion.log().columns() | columns))


@pytest.mark.long
def test_thresholds_lie_above_what_is_in_the_log(calibrated, motion):
    room = calibrated.calibration.room[:3]
    assert np.isfinite(room).all() and (room[0] > 3.0 * SIGMA).all()
    for k in range(3000):
        command = ftqp.Commanded(motion.q_ref[k], motion.v_ref[k], motion.a_ref[k])
        assert calibrated.update(motion.q[k], None, None, command).suspicion < 1.0


def test_claim_names_hours_alarms_and_interval(calibrated):
    known = calibrated.calibration
    assert known.hours == pytest.approx(TICKS * DT / 3600.0)
    assert known.rate_low <= known.alarms / known.hours <= known.rate_high
    assert "95 %" in str(known) and "extrapolated" not in str(known)


def test_rate_that_the_log_is_too_short_for_is_refused_unless_extrapolated(robot, motion):
    detector = ftqp.Detector(robot=robot, dt=DT, noise=ftqp.Noise(q=SIGMA))
    with pytest.raises(InputError, match=r"50 s of .* takes 108000 s; record 30 h"):
        detector.calibrate(motion.log())
    assert "extrapolated" in str(detector.calibrate(motion.log(), extrapolate=True).calibration)


@pytest.mark.parametrize("extrapolate", [False, True])
def test_log_too_short_to_fit_a_tail_to_is_refused_in_seconds(robot, motion, extrapolate):
    detector = ftqp.Detector(robot=robot, dt=DT, noise=ftqp.Noise(q=SIGMA))
    for ticks, seconds in ((6000, "6 s"), (TICKS - 1, "49.975 s")):
        short = ftqp.MotionLog(
            **{k: c if c is None else c[:ticks] for k, c in motion.log().columns().items()}
        )
        with pytest.raises(InputError, match=rf"has {seconds} of healthy motion, expected 50 s at least"):
            detector.calibrate(short, RATE, extrapolate=extrapolate)


def test_calibration_survives_a_file(calibrated, tmp_path, robot):
    calibrated.calibration.save(tmp_path / "healthy.json")
    again = ftqp.Calibration.load(tmp_path / "healthy.json")
    np.testing.assert_array_equal(again.room, calibrated.calibration.room)
    assert str(again) == str(calibrated.calibration)
    assert ftqp.Detector(robot=robot, dt=DT, calibration=again).calibration is again


def test_foreign_file_and_foreign_arm_are_refused(calibrated, tmp_path, robot):
    (tmp_path / "other.json").write_text("{}")
    with pytest.raises(InputError, match="no calibration of format"):
        ftqp.Calibration.load(tmp_path / "other.json")
    with pytest.raises(InputError, match="cannot be read"):
        ftqp.Calibration.load(tmp_path / "none.json")
    with pytest.raises(InputError, match="calibrate anew"):
        ftqp.Detector(robot=robot, dt=DT, drive="torque", calibration=calibrated.calibration)


def test_unhealthy_logs_are_refused(robot, motion):
    detector = ftqp.Detector(robot=robot, dt=DT, noise=ftqp.Noise(q=SIGMA))
    q = motion.q
    q[1000, 2] = np.nan
    with pytest.raises(InputError, match="row 1000, panda_joint3"):
        detector.calibrate(changed(motion, q=q), RATE)
    q = motion.q
    q[1000:, 2] = q[1000, 2]
    with pytest.raises(InputError, match="encoder of joint 3"):
        detector.calibrate(changed(motion, q=q), RATE)
    q = motion.q
    q[1000:1060, 2] = motion.true[1000, 2] + motion.noise[1000:1060, 2]
    with pytest.raises(InputError, match=r"panda_joint3 stands out|encoder of joint 3"):
        detector.calibrate(changed(motion, q=q), RATE)


def test_joint_that_never_moves_is_named(robot, motion):
    detector = ftqp.Detector(robot=robot, dt=DT, noise=ftqp.Noise(q=SIGMA))
    q, q_ref = motion.q, motion.q_ref.copy()
    q[:, 4], q_ref[:, 4] = motion.noise[:, 4], 0.0
    with pytest.raises(InputError, match="panda_joint5 moves by 0 rad"):
        detector.calibrate(changed(motion, q=q, q_ref=q_ref), RATE)


@pytest.mark.parametrize("stated", [0.0, 1e-5])
def test_noise_that_is_stated_far_too_small_is_refused(robot, motion, stated):
    detector = ftqp.Detector(robot=robot, dt=DT, noise=ftqp.Noise(q=stated))
    with pytest.raises(InputError, match=r"is stated as .* but the log shows"):
        detector.calibrate(motion.log(), RATE)


@pytest.mark.long
def test_friction_and_load_are_told_apart(robot):
    """The motors of the log also carry 0.4 kg and overcome friction, of which the model knows nothing."""
    motion, carrying = Shaken(robot, TICKS), robot.with_payload(ftqp.Payload(0.4)).model
    coulomb, viscous = np.linspace(0.2, 0.8, 7), np.linspace(0.5, 0.1, 7)
    data, rows = carrying.createData(), zip(motion.q_ref, motion.v_ref, motion.a_ref, strict=True)
    tau = np.array([pin.rnea(carrying, data, *row) for row in rows])
    tau += coulomb * np.sign(motion.v_ref) + viscous * motion.v_ref
    detector = ftqp.Detector(robot=robot, dt=DT, drive="torque", noise=ftqp.Noise(q=SIGMA))
    known = detector.calibrate(motion.log(effort=tau), RATE).calibration
    np.testing.assert_allclose(known.coulomb, coulomb, atol=0.05)
    np.testing.assert_allclose(known.viscous, viscous, atol=0.1)
