"""Encoders that repeat their number: which are looked through, which count as frozen, and which work."""

import numpy as np
import pytest

import ftqp

DT = 1e-3
PLANAR = ftqp.robots.load("planar", count=3)


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
