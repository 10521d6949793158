"""Encoders that repeat their number: which are looked through, which count as frozen, and which work."""

from types import SimpleNamespace

import numpy as np
import pytest

import ftqp
from ftqp.kernel.feedback import repeats
from ftqp.kernel.layout.enums import POSITION_DRIVE, TORQUE_DRIVE, VELOCITY_DRIVE

DT = 1e-3
KINDS = {"position": POSITION_DRIVE, "velocity": VELOCITY_DRIVE, "torque": TORQUE_DRIVE}
PLANAR = ftqp.robots.load("planar", count=3)


class Encoder:
    """What is known of one encoder; ``look`` at samples while the reference moves at some speed."""

    def __init__(self, drive="torque", sigma=0.0):
        names = ("same", "moved", "increment", "way", "restless", "raw", "v_hat")
        self.loop = SimpleNamespace(
            **{name: np.zeros(1) for name in names}, held=np.zeros(1, int), age=np.zeros(1, int),
            kind=KINDS[drive], sigma=sigma, stiffness=80.0, M=np.full((1, 1), 0.005),
        )  # fmt: skip
        self.state, self.limits = SimpleNamespace(dt=DT), SimpleNamespace(tau_max=np.full(1, 12.0))

    def look(self, samples, speeds):
        """What ``held`` becomes, sample by sample; the observer follows the samples a little late."""
        found = []
        for sample, v in zip(samples, np.broadcast_to(speeds, len(samples)), strict=True):
            last = self.loop.raw[0]
            repeats.look_at_repeats(self.state, self.limits, self.loop, 0, sample, v)
            self.loop.v_hat[0] += 0.3 * ((sample - last) / DT - self.loop.v_hat[0])
            found.append(int(self.loop.held[0]))
        return found


@pytest.mark.parametrize("drive", list(KINDS))
@pytest.mark.parametrize(
    ("quantum", "top"), [(1e-6, 2.0), (1e-5, 0.02), (1e-4, 0.3), (1e-3, 1e-3), (1e-3, 2.0)]
)
def test_quantised_encoder_of_a_joint_that_starts_runs_creeps_and_reverses_is_believed(drive, quantum, top):
    t = DT * np.arange(4000)
    speeds = top * np.sin(3.0 * t) * np.minimum(t, 1.0)
    places = np.cumsum(speeds) * DT
    lagging = np.concatenate([np.zeros(8), places[:-8]])  # behind its reference, as servos are
    assert not any(Encoder(drive).look(np.round(lagging / quantum) * quantum, speeds))


@pytest.mark.parametrize(
    ("drive", "restless", "held", "at_last"),
    [("torque", False, 1, 2), ("torque", True, 1, 2), ("velocity", False, 1, 1), ("velocity", True, 1, 2),
     ("position", False, 0, 0)],
)  # fmt: skip
def test_moving_encoder_that_freezes_is_looked_through_at_its_second_repeat(drive, restless, held, at_last):
    """It counts as frozen in a torque drive, and where it never repeated its number at rest."""
    encoder = Encoder(drive)
    rng = np.random.default_rng(0)
    encoder.look(1e-7 * rng.standard_normal(90) if restless else np.zeros(90), 1e-9)
    speeds = np.minimum(0.45, 10.0 * DT * np.arange(300))
    places = np.cumsum(speeds) * DT
    assert not any(encoder.look(places, speeds))
    found = encoder.look(np.full(40, places[-1]), 0.45)
    assert found[0] == 0 and found[1] == held and found[-1] == at_last
    if at_last == 2:
        assert found.index(2) * DT < 0.01, "20 rad/s2 behind a stiffness of 80 1/s are 3 mrad"
    assert encoder.look([places[-1] + 0.01], 0.45) == [0], "a number that changes is believed again"


def test_joint_that_sticks_keeps_the_feedback_that_brings_it_loose():
    """At rest until the reference is 15 mrad ahead, from rest and at speeds at which joints stick."""
    encoder = Encoder()
    for speed in (0.02, 0.05, 0.09):
        ticks = int(0.015 / (speed * DT))
        assert not any(encoder.look(np.full(ticks, encoder.loop.raw[0]), speed))
        assert not any(encoder.look(encoder.loop.raw[0] + 1e-4 * np.arange(1, 21), speed))


def test_stated_noise_below_the_steps_of_the_encoder_does_not_make_it_frozen():
    quantum, v = 1e-3, 0.02
    places = v * DT * np.arange(4000)
    assert not any(Encoder(sigma=1e-5).look(np.round(places / quantum) * quantum, v)[200:])


class Standing:
    """An arm that follows exactly, but for the joint whose number stays the same from tick 80 on."""

    def __init__(self, drive):
        self.planner = ftqp.Planner(PLANAR, DT, drive=drive, task=ftqp.Task(("x", "y")))
        self.planner.reset(PLANAR.neutral)
        self.target = ftqp.Target(pose=PLANAR.pose(PLANAR.neutral))
        self.q, self.k, self.stuck = PLANAR.neutral.copy(), 0, None
        self.joint = None

    def ticks(self, count):
        said = []
        for _ in range(count):
            self.target.position[1] += DT * min(0.3, 2.0 * DT * self.k)
            step = self.planner.step(self.q, None, self.target)
            self.q = step.reference.q.copy()
            if self.k >= 180:
                if self.joint is None:
                    self.joint = int(np.argmax(np.abs(step.reference.v)))
                    self.stuck = self.q[self.joint]
                self.q[self.joint] = self.stuck
            self.k += 1
            said.append((step.status.name, self.planner.stopped_because))
        return said


def test_brake_that_was_not_told_is_a_following_error_of_a_position_drive():
    said = Standing("position").ticks(900)
    assert "INVALID_INPUT" not in {status for status, _ in said}
    assert "LAGGING" in {status for status, _ in said}
    assert "sensor" not in str(said[-1][1]) and "encoder" not in str(said[-1][1])


def test_velocity_drive_gives_no_feedback_to_a_joint_whose_number_repeats():
    arm = Standing("velocity")
    arm.ticks(180)
    for _ in range(30):
        arm.ticks(1)
    step = arm.planner.step(arm.q, None, arm.target)
    assert abs(step.v[arm.joint] - step.reference.v[arm.joint]) < 1e-9
    assert arm.planner.stopped_because is None


@pytest.mark.parametrize("told", [True, False])
def test_torque_drive_stops_for_a_number_that_repeats_and_goes_on_once_it_is_told_of_a_lock(told):
    arm = Standing("torque")
    said = arm.ticks(330)
    why = said[-1][1]
    assert "INVALID_INPUT" in {status for status, _ in said}
    assert "it is frozen, or the joint stands" in why and PLANAR.joints[arm.joint] in why
    if told:
        arm.planner.report(ftqp.Locked(arm.joint))
        arm.ticks(2)
    assert arm.planner.resume() is told


@pytest.mark.long
@pytest.mark.parametrize(("name", "joint"), [("panda", 1), ("panda", 3), ("iiwa14", 1), ("xarm7", 1)])
def test_torque_joint_whose_encoder_freezes_stays_below_its_speed_limit_without_stated_noise(name, joint):
    """At 0.45 rad/s; it went at four to twelve times its limit."""
    pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')
    robot = ftqp.robots.load(name)
    planner = ftqp.Planner(robot, DT, drive="torque")
    plant = ftqp.MujocoPlant(robot, DT, ftqp.JointServo(robot, "torque"))
    planner.reset(robot.neutral)
    q_r, peak, stuck = robot.neutral.copy(), 0.0, None
    for k in range(1800):
        v_r = np.zeros(robot.nv)
        v_r[joint] = 0.45 * min(1.0, k / 300.0)
        q_r = q_r + DT * v_r
        target = ftqp.Target(pose=robot.pose(q_r), twist=robot.jacobian(q_r) @ v_r)
        sample = plant.q.copy()
        if k >= 1000:
            stuck = sample[joint] if stuck is None else stuck
            sample[joint] = stuck
            peak = max(peak, float(np.max(np.abs(plant.v) / robot.limits.v_max)))
        step = planner.step(sample, None, target)
        plant.advance(step)
    assert peak < 0.8
    assert step.status is ftqp.StepStatus.STOPPED and step.brakes[joint]
    assert robot.joints[joint] in planner.stopped_because


@pytest.mark.long
@pytest.mark.parametrize("name", ["panda", "iiwa14"])
@pytest.mark.parametrize("quantum", [1e-5, 5e-4])
def test_torque_joints_that_stick_behind_quantised_encoders_are_no_broken_sensors(name, quantum):
    """0.5 N m of dry friction that nobody told, on wrists without rotors: they stick for 0.1 s."""
    pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')
    robot = ftqp.robots.load(name)
    planner = ftqp.Planner(robot, DT, drive="torque", emergency=None)
    plant = ftqp.MujocoPlant(robot, DT, ftqp.JointServo(robot, "torque"), ftqp.TrueArm(coulomb=0.5))
    planner.reset(robot.neutral)
    path = ftqp.paths.Circle(robot.pose(robot.neutral), 0.05, duration=1.5, axes=("y", "z"))
    led = path.sample(np.minimum(DT * np.arange(1700), path.duration))
    for pose, twist, acceleration in zip(led.pose, led.twist, led.acceleration, strict=True):
        target = ftqp.Target(pose=pose, twist=twist, acceleration=acceleration)
        step = planner.step(quantum * np.round(plant.q / quantum), None, target)
        assert step.status is not ftqp.StepStatus.INVALID_INPUT
        plant.advance(step)
    assert planner.stopped_because is None
