"""Calibration from healthy motion: noise and friction, the logs that it refuses, and what follows."""

import numpy as np
import pinocchio as pin
import pytest
from tests.shaken import DT, SIGMA, Shaken

import ftqp
from ftqp.core.errors import InputError

TICKS = 20_000


@pytest.fixture(scope="module")
def motion(robot):
    return Shaken(robot, TICKS)


@pytest.fixture(scope="module")
def rubbing(robot, motion):
    """A detector calibrated on motors that also carry 0.4 kg and overcome friction, which the model lacks."""
    carrying = robot.with_payload(ftqp.Payload(0.4)).model
    data, rows = carrying.createData(), zip(motion.q_ref, motion.v_ref, motion.a_ref, strict=True)
    tau = np.array([pin.rnea(carrying, data, *row) for row in rows])
    tau += COULOMB * np.sign(motion.v_ref) + VISCOUS * motion.v_ref
    detector = ftqp.Detector(robot=robot, dt=DT, drive="torque", noise=ftqp.Noise(q=SIGMA))
    return detector.calibrate(motion.log(effort=tau))


COULOMB, VISCOUS = np.linspace(0.2, 0.8, 7), np.linspace(0.5, 0.1, 7)


def changed(motion, **columns):
    return ftqp.MotionLog(**(motion.log().columns() | columns))


def test_friction_and_load_are_told_apart(rubbing):
    known = rubbing.calibration
    np.testing.assert_allclose(known.coulomb, COULOMB, atol=0.05)
    np.testing.assert_allclose(known.viscous, VISCOUS, atol=0.1)
    assert known.sigma == pytest.approx(SIGMA, rel=0.1) and "7 of 7 joints" in str(known)


def test_a_planner_begins_with_the_friction_that_was_found(robot, rubbing):
    planner = ftqp.Planner(robot, DT, drive="torque", detector=rubbing)
    M = planner._session.K.monitor
    np.testing.assert_allclose(M.stated[:7, 2] / M.unit[:7], rubbing.calibration.coulomb)
    assert (M.doubt[:7, 2] < 0.25).all()


def test_calibration_survives_a_file(rubbing, tmp_path, robot):
    rubbing.calibration.save(tmp_path / "healthy.json")
    again = ftqp.Calibration.load(tmp_path / "healthy.json")
    np.testing.assert_array_equal(again.coulomb, rubbing.calibration.coulomb)
    assert str(again) == str(rubbing.calibration)
    assert ftqp.Detector(robot=robot, dt=DT, calibration=again).calibration is again


def test_foreign_file_and_foreign_arm_are_refused(rubbing, tmp_path):
    (tmp_path / "other.json").write_text("{}")
    with pytest.raises(InputError, match="no calibration of format"):
        ftqp.Calibration.load(tmp_path / "other.json")
    with pytest.raises(InputError, match=r"none.json does not exist, expected a calibration; make a new one"):
        ftqp.Calibration.load(tmp_path / "none.json")
    other = ftqp.robots.load("iiwa14")
    with pytest.raises(InputError, match="calibrate anew"):
        ftqp.Detector(robot=other, dt=DT, calibration=rubbing.calibration)
    with pytest.raises(InputError, match="calibrate anew"):
        ftqp.Planner(other, DT, drive="torque", detector=ftqp.Detector(calibration=rubbing.calibration))


def test_unhealthy_logs_are_refused(robot, motion):
    detector = ftqp.Detector(robot=robot, dt=DT, noise=ftqp.Noise(q=SIGMA))
    q = motion.q
    q[1000, 2] = np.nan
    with pytest.raises(InputError, match="row 1000, panda_joint3"):
        detector.calibrate(changed(motion, q=q))


def test_joint_that_never_moves_is_named(robot, motion):
    detector = ftqp.Detector(robot=robot, dt=DT, noise=ftqp.Noise(q=SIGMA))
    q, q_ref = motion.q, motion.q_ref.copy()
    q[:, 4], q_ref[:, 4] = motion.noise[:, 4], 0.0
    with pytest.raises(InputError, match="panda_joint5 moves by 0 rad"):
        detector.calibrate(changed(motion, q=q, q_ref=q_ref))


@pytest.mark.parametrize("stated", [0.0, 1e-5])
def test_noise_that_is_stated_far_too_small_is_refused(robot, motion, stated):
    detector = ftqp.Detector(robot=robot, dt=DT, noise=ftqp.Noise(q=stated))
    with pytest.raises(InputError, match=r"is stated as .* but the log shows"):
        detector.calibrate(motion.log())
