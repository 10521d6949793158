"""What the arm takes, and the bandwidths that follow."""

import numpy as np
import pytest

import ftqp
from ftqp.control.drive.joint_drive import Drive, by_name

QUIET = ftqp.Noise()


def loops(drive, dt=1e-3):
    gains = drive.gains(dt, QUIET, 0.9)
    return gains, (drive.ticks(dt) + 1) * dt


def sensitivity(loop):
    """Largest |1/(1 + L)| over the frequencies."""
    s = 1j * np.geomspace(0.05, 1500.0, 40000)
    return np.abs(1.0 / (1.0 + loop(s))).max()


@pytest.mark.parametrize("latency", [0.0, 2e-3, 5e-3])
@pytest.mark.parametrize("hertz", [5, 15, 60])
@pytest.mark.parametrize("takes_velocity", [True, False])
def test_the_loop_of_the_tip_has_its_margin(latency, hertz, takes_velocity):
    wn = 2 * np.pi * hertz
    gains, delay = loops(Drive(bandwidth=wn, takes_velocity=takes_velocity, latency=latency))
    kappa = gains["kappa"]

    def loop(s):
        servo = (2 * wn * s + wn**2 if takes_velocity else wn**2) / (s + wn) ** 2
        if not takes_velocity:
            servo = servo * (1.0 + gains["lead"] * s)
        return kappa**2 * servo * np.exp(-s * delay) / (s * (s + 2 * kappa))

    assert sensitivity(loop) < 2.0


@pytest.mark.parametrize("latency", [0.0, 2e-3, 5e-3])
@pytest.mark.parametrize("hertz", [15, 60])
def test_the_position_loop_of_a_velocity_arm_has_its_margin(latency, hertz):
    wv = 2 * np.pi * hertz
    gains, delay = loops(Drive(kind="velocity", bandwidth=wv, latency=latency))
    assert sensitivity(lambda s: gains["hold"] * wv / (s + wv) * np.exp(-s * delay) / s) < 2.0


def test_bandwidths_are_lower_with_delay_and_noise():
    fast, slow = Drive(bandwidth=100.0), Drive(bandwidth=100.0, latency=0.02)
    assert slow.gains(1e-3, QUIET, 0.9)["kappa"] < fast.gains(1e-3, QUIET, 0.9)["kappa"] == 25.0
    noisy = fast.gains(1e-3, ftqp.Noise(q=1e-3), 0.9)["kappa"]
    assert noisy == pytest.approx(np.sqrt(0.05 / (1e-3 * 0.9)))


def test_a_servo_on_positions_only_gets_its_lead():
    assert Drive(bandwidth=100.0, takes_velocity=False).gains(1e-3, QUIET, 0.9)["lead"] == 0.02
    assert Drive(bandwidth=100.0).gains(1e-3, QUIET, 0.9)["lead"] == 0.0


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ("velocty", "drive is 'velocty' (did you mean 'velocity'?), expected one of"),
        (3, "drive is 3, expected one of position, velocity, torque"),
        ({"kind": "torque", "bandwith": 3.0}, "'bandwith' is not a key of a drive"),
        ({"bandwidth": -1.0}, "bandwidth of the drive is -1"),
        ({"bandwidth": float("nan")}, "bandwidth of the drive is nan"),
        ({"kind": "velocity", "lead": 0.1}, "lead is for drive 'position', but the drive is 'velocity'"),
        ({"stiffness": 10.0}, "stiffness is for drive 'torque', but the drive is 'position'"),
        ({"kind": "torque", "takes_velocity": False}, "takes_velocity=False is for drive 'position'"),
    ],
)
def test_a_wrong_drive_is_one_sentence(given, sentence):
    with pytest.raises(ftqp.InputError) as error:
        by_name(given)
    assert sentence in str(error.value)


def test_too_much_latency_and_a_robot_without_inertia_are_refused():
    robot = ftqp.robots.load("panda")
    with pytest.raises(ftqp.InputError, match=r"latency of the drive is 1 s, expected at most 0\.062 s"):
        ftqp.Planner(robot, drive=Drive(latency=1.0))
    with pytest.raises(ftqp.InputError, match="drive 'torque' needs inertia, which srs7 has not"):
        ftqp.Planner(ftqp.robots.load("srs7"), drive="torque")
    with pytest.raises(ftqp.InputError, match="noise is 3, expected an"):
        ftqp.Planner(robot, noise=3)
