"""Encoders of which some numbers are wrong, or all are noisy from the first one on: the arm goes on."""

import numpy as np
import pytest
from tests.going import started
from tests.servo_arm import ServoArm, TorqueArm

import ftqp

PANDA = ftqp.robots.load("panda")
DT, JOINT, SHARE, SIZE, FROM = 1e-3, 3, 0.2, 0.02, 0.3
ARMS = {
    "position": lambda: ServoArm(PANDA.neutral, DT, takes="position only", wn=60.0),
    "velocity": lambda: ServoArm(PANDA.neutral, DT, takes="velocity", wn=60.0),
    "torque": lambda: TorqueArm(PANDA, PANDA.neutral, DT),
}


def led_round(drive, seconds, noise, share, off=lambda t: 0.0, push=lambda t: 0.0):
    """The planner and how far the true tip ends from its target, after a circle of 6 cm [m].

    The numbers of a joint are ``off`` by so much, and it is pushed by so much [rad/s2].
    """
    arm, rng = ARMS[drive](), np.random.default_rng(5)
    planner = started(PANDA, dt=DT, at=PANDA.neutral, drive=drive)
    path = ftqp.paths.Circle(PANDA.pose(PANDA.neutral), 0.06, duration=2.0).sample(DT * np.arange(2001))
    targets = ftqp.Targets(path.pose, path.twist, path.acceleration)
    for k in range(round(seconds / DT)):
        q = arm.q + noise * rng.standard_normal(7)
        if k * DT > FROM and rng.random() < share:
            q[JOINT] += SIZE * rng.standard_normal()
        q[JOINT] += off(k * DT)
        arm.push[JOINT] = push(k * DT)
        arm.command(planner.step(q, None, targets.at(min(k, 2000))))
    return planner, np.linalg.norm(PANDA.pose(arm.q)[:3, 3] - path.pose[-1][:3, 3])


@pytest.mark.long
@pytest.mark.parametrize("drive", ARMS)
def test_sensor_of_which_a_fifth_is_wrong_stops_no_arm(drive):
    """Its scatter let wrong numbers pass, after which true ones were refused, and it counted as lost."""
    planner, off = led_round(drive, 3.0, 2e-5, SHARE)
    assert planner.stopped_because is None and not planner.findings
    assert off < 3e-3


@pytest.mark.parametrize("drive", ["position", "velocity"])
def test_noise_of_a_slow_arm_loses_no_sensor_before_it_is_known(drive):
    """Of an encoder of 0.5 mrad most first numbers were refused, until its noise was learned."""
    slow = PANDA.with_limits(v_max=np.full(7, 0.2))
    arm = ServoArm(slow.neutral, DT, takes="velocity" if drive == "velocity" else "position only")
    rng = np.random.default_rng(1)
    planner = started(slow, dt=DT, at=slow.neutral, drive=drive)
    target = ftqp.Target(pose=slow.pose(slow.neutral))
    for _ in range(300):
        arm.command(planner.step(arm.q + 5e-4 * rng.standard_normal(7), None, target))
    assert planner.stopped_because is None and not planner.findings


@pytest.mark.parametrize("size", [0.02, -0.3])
@pytest.mark.parametrize("drive", ["velocity", "torque"])
def test_encoder_that_jumps_and_works_on_is_believed_less_its_step(drive, size):
    """A torque arm was stopped, and a velocity arm went on without the joint."""
    planner, off = led_round(drive, 2.5, 2e-5, 0.0, off=lambda t: size * (t > 0.8))
    assert planner.stopped_because is None and not planner.faults
    assert off < 1e-3
    (finding,) = planner.findings
    assert finding.kind == "sensor_biased" and finding.withdrawn_at is None
    said = float(finding.sentence.split("jumped by ")[1].split(" rad")[0])
    assert said == pytest.approx(size, abs=2e-3)
    assert 0.79 < finding.onset < 0.81 < finding.detected_at < 0.83


@pytest.mark.parametrize("drive", ["position", "velocity"])
def test_coarse_numbers_with_fine_noise_lose_no_sensor_of_a_slow_arm(drive):
    """Their step is more than the joint can go in a tick, and noise hides that they have one."""
    slow = PANDA.with_limits(v_max=np.full(7, 0.2), a_max=np.full(7, 1.0))
    arm = ServoArm(slow.neutral, DT, takes="velocity" if drive == "velocity" else "position only")
    rng, step = np.random.default_rng(1), 4e-3
    planner = started(slow, dt=DT, at=slow.neutral, drive=drive)
    goto = ftqp.GoTo(planner, q=slow.neutral + 0.1)
    for _ in range(2500):
        arm.command(goto.step(step * np.round(arm.q / step) + 1e-5 * rng.standard_normal(7), None))
    assert planner.stopped_because is None and not planner.findings


def test_encoder_that_jumps_back_is_right_again():
    planner, off = led_round("torque", 2.5, 2e-5, 0.0, off=lambda t: 0.1 * (0.6 < t < 1.2))
    assert planner.stopped_because is None and not planner.faults and off < 1e-3
    (finding,) = planner.findings
    assert finding.withdrawn_at == pytest.approx(1.22, abs=0.01)


@pytest.mark.parametrize("size", [300.0, 3000.0])
def test_true_motion_of_a_joint_that_is_pushed_is_no_jump_of_its_encoder(size):
    planner, _ = led_round("torque", 1.5, 2e-5, 0.0, push=lambda t: size * (0.8 < t < 0.81))
    assert not any(one.kind == "sensor_biased" and "taken from" in one.sentence for one in planner.findings)


def test_encoder_that_jumps_and_runs_on_is_not_believed():
    planner, _ = led_round("torque", 1.0, 2e-5, 0.0, off=lambda t: (0.2 + 2.0 * (t - 0.8)) * (t > 0.8))
    assert "sensor of panda_joint4" in planner.stopped_because
