"""Torque arms that lag, that fall at first, and that hear nothing for a while: none is a failure."""

import numpy as np
import pytest
from tests.ride import DT, START, Ride, circle, target_at
from tests.servo_arm import TorqueArm

import ftqp

PANDA = ftqp.robots.load("panda")
PUSH = 60.0


def drawn_aside(rows):
    """A cable draws the wrist of a healthy arm aside from 0.5 s on, farther than joints usually lag."""
    robot = PANDA.with_rotors(PANDA.chain.armature + 0.01)
    planner = ftqp.Planner(PANDA, DT, drive="torque", task=ftqp.Task(rows=rows))
    arm, path = TorqueArm(robot, START, DT), circle(PANDA, START)
    events = {
        500 + k: [lambda planner, arm, k=k: arm.push.__setitem__(6, -PUSH * min(k / 300.0, 1.0))]
        for k in range(301)
    }
    wrist = []
    ride = Ride(PANDA, planner, arm, path, 3.0, events, lambda k, q: wrist.append(q[6]) or q)
    assert np.max(np.abs(np.array(wrist) - ride.sent[:, 6])) > 0.03  # beyond its error band
    return planner, ride, path


@pytest.mark.long
def test_a_wrist_that_is_drawn_aside_holds_up_no_path_that_does_not_need_it():
    planner, ride, _ = drawn_aside("position")
    assert planner.stopped_because is None and not planner.findings
    assert ride.error.max() < 2e-3  # on time, too


@pytest.mark.long
def test_a_joint_that_lags_moves_no_target_of_a_torque_arm():
    """The target gave way by as much as the wrist was behind, and swung with it once it was back."""
    planner, ride, path = drawn_aside("pose")
    assert planner.stopped_because is None
    led = path.sample(DT * np.arange(len(ride.sent)))
    turned = [
        np.arccos(np.clip((np.trace(PANDA.pose(q)[:3, :3] @ pose[:3, :3].T) - 1.0) / 2.0, -1.0, 1.0))
        for q, pose in zip(ride.sent[::20], led.pose[::20], strict=True)
    ]
    assert max(turned) < 1e-4


NOISE, AT = 5e-5, 1000


def ridden(gap, frozen=False, quantum=0.0, noise=NOISE, seconds=3.0, robot=PANDA):
    """The planner, the fastest joint as a share of its limit, the tip's last error [m], and what was said.

    It ends where all brakes are asked for. No sample comes for ``gap`` ticks, or all are the last one, of an
    arm with rotors of which nobody told.
    """
    rng = np.random.default_rng(3)
    planner = ftqp.Planner(robot, DT, drive="torque")
    arm = TorqueArm(robot.with_rotors(robot.chain.armature + 0.05), START, DT)
    path, fastest, said, last = circle(robot, START), 0.0, [], START
    planner.reset(START)
    for k in range(round(seconds / DT)):
        target = target_at(path, min(k * DT, path.duration))
        q = arm.q if quantum == 0.0 else quantum * np.round(arm.q / quantum)
        q = q + noise * rng.standard_normal(robot.nv)
        if AT <= k < AT + gap:
            q = last if frozen else np.full(robot.nv, np.nan)
        last = q
        step = planner.step(q, None, target)
        said.append(step.status.name)
        if step.brakes.all():
            break
        arm.command(step)
        fastest = max(fastest, float(np.max(np.abs(arm.v) / robot.limits.v_max)))
    error = float(np.linalg.norm(robot.pose(arm.q)[:3, 3] - target.position))
    return planner, fastest, error, said


@pytest.mark.long
@pytest.mark.parametrize("frozen", [False, True])
@pytest.mark.parametrize("gap", [40, 150, 250])
def test_gap_of_all_samples_stops_no_torque_arm(gap, frozen):
    planner, fastest, error, said = ridden(gap, frozen, seconds=6.0)
    assert planner.stopped_because is None and not planner.faults
    assert fastest < 1.0 and error < 2e-3
    assert "INVALID_INPUT" in said[AT : AT + gap] and "HELD" not in said
    assert said[-1] == "OK"


@pytest.mark.long
def test_torque_arm_that_hears_nothing_for_good_is_stopped_and_asks_for_its_brakes():
    planner, fastest, _, said = ridden(5000)
    assert planner.stopped_because is not None and fastest < 1.0
    assert said[-1] in ("STOPPED", "STOPPING") and 300 < len(said) - AT < 400


@pytest.mark.long
def test_coarse_and_noisy_encoders_of_a_slow_torque_arm_are_no_broken_sensors():
    slow = PANDA.with_limits(v_max=[0.6] * 7)
    planner, _, error, _ = ridden(0, quantum=1.5e-3, noise=1e-4, robot=slow)
    assert planner.stopped_because is None and not planner.faults
    assert error < 0.02


@pytest.mark.parametrize("mass", [2.0, 3.0])
def test_light_wrist_that_falls_under_a_load_is_caught_within_its_speed_limit(mass):
    """When its rotor became known, its load was fed forward ten times: it came up at 1.2 times its limit."""
    robot, fastest = ftqp.robots.load("iiwa14"), 0.0
    q = robot.neutral - 0.5 * (np.arange(7) == 5)
    arm = TorqueArm(robot.with_rotors(0.02), q, DT, mass=mass, sigma=NOISE)
    planner = ftqp.Planner(robot, DT, drive="torque", emergency=None)
    planner.reset(q)
    target = ftqp.Target(pose=robot.pose(q))
    for _ in range(500):
        arm.command(planner.step(1.5e-3 * np.round(arm.measured() / 1.5e-3), None, target))
        fastest = max(fastest, float(np.max(np.abs(arm.v) / robot.limits.v_max)))
    assert fastest < 0.9 and not planner.findings
