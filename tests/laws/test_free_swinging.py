"""Laws of an arm with a free-swinging joint in physics that is not the planner's own: MuJoCo, torque drive.

``python studies/study_free_swinging.py --physics mujoco`` looks at more postures.
"""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')

import ftqp
from ftqp.sim.plants.joint_servo import JointServo
from ftqp.sim.plants.mujoco_plant import MujocoPlant
from ftqp.sim.plants.plant import Arm
from ftqp.sim.plants.true_arm import TrueArm

DT = 1e-3
CASES = [("panda", 2), ("panda", 3), ("panda", 4), ("panda", 6), ("iiwa14", 3), ("xarm7", 4)]
"""Arms and joints, counted from 1."""


class Fall:
    """An arm that loses a joint in motion: its stops are at the range, its friction is known."""

    def __init__(self, name, joint, damping, seconds):
        self.robot = ftqp.robots.load(name)
        self.i, self.damping = joint - 1, damping
        limits, n = self.robot.limits, self.robot.nv
        rng = np.random.default_rng(joint)
        self.q = limits.q_min + (limits.q_max - limits.q_min) * rng.uniform(0.25, 0.75, n)
        self.v = 0.15 * limits.v_max * rng.uniform(-1.0, 1.0, n)
        self.seconds, self.healthy = seconds, np.arange(n) != self.i
        self.arm = Arm(self.robot)

    def run(self, command):
        """The impact's speed, and the largest shares of speed and torque limits before it."""
        limits, i = self.robot.limits, self.i
        plant = MujocoPlant(self.robot, DT, JointServo(self.robot, "torque"), TrueArm(end_stops=0.0))
        plant.reset(self.q, self.v)
        plant.fail(ftqp.FreeSwinging(i, damping=self.damping))
        hit = fast = strong = 0.0
        for _ in range(round(self.seconds / DT)):
            step, before = command(plant), float(plant.v[i])
            if hit == 0.0:
                fast = max(fast, (np.abs(plant.v) / limits.v_max)[self.healthy].max())
                strong = max(strong, (np.abs(step.tau) / limits.tau_max)[self.healthy].max())
            plant.advance(step)
            room = min(plant.q[i] - limits.q_min[i], limits.q_max[i] - plant.q[i])
            if room < 0.01 and abs(before) > 0.05 and abs(plant.v[i]) < 0.5 * abs(before):
                hit = max(hit, abs(before))
        assert plant.failure is None
        return SimpleNamespace(hit=hit, fast=fast, strong=strong)

    def braked(self):
        """The others brake as hard as they can."""

        def command(plant):
            i, limits = self.i, self.robot.limits
            a = np.clip(-plant.v / DT, -limits.a_max, limits.a_max)
            M, h = self.arm.dynamics(plant.q, plant.v)
            a[i] = 0.0
            if min(plant.q[i] - limits.q_min[i], limits.q_max[i] - plant.q[i]) > 1e-3:
                a[i] = -(h[i] + M[i] @ a + self.damping * plant.v[i]) / M[i, i]
            return SimpleNamespace(q=plant.q, v=plant.v, tau=M @ a + h, brakes=np.zeros(len(a), bool))

        return self.run(command)

    def led(self):
        """What a planner makes of it, and how it ends."""
        planner = ftqp.Planner(self.robot, DT, drive="torque")
        planner.reset(self.q, self.v)
        planner.report(ftqp.FreeSwinging(self.i, damping=self.damping))
        target = ftqp.Target(pose=self.robot.pose(self.q))
        statuses = []

        def command(plant):
            step = planner.step(plant.q.copy(), plant.v.copy(), target)
            statuses.append(step.status)
            return step

        result = self.run(command)
        result.final = statuses[-1]
        result.stopped = next((k * DT for k, s in enumerate(statuses) if s is ftqp.StepStatus.STOPPED), None)
        return result


@pytest.fixture(scope="module", params=CASES, ids=str)
def fall(request):
    name, joint = request.param
    fall = Fall(name, joint, 0.5, 1.7)
    return fall.led(), fall.braked()


def test_others_keep_speed_and_torque_before_an_impact(fall):
    led, _ = fall
    assert led.fast <= 1.02 and led.strong <= 1.0 + 1e-9


def test_impact_is_no_harder_than_that_of_braking(fall):
    led, braked = fall
    assert led.hit <= braked.hit + 0.05


def test_arm_ends_stopped_or_holds_what_it_can_of_the_task(fall):
    led, _ = fall
    if led.stopped is None:
        assert led.final in (ftqp.StepStatus.OK, ftqp.StepStatus.RELAXED)
    else:
        assert led.stopped < 1.5 and led.final is ftqp.StepStatus.STOPPED


@pytest.mark.parametrize(("name", "joint", "dry"), [("xarm7", 7, 1.0), ("xarm7", 5, 1.5), ("panda", 7, 1.0)])
def test_circle_goes_on_beside_a_joint_that_its_gear_holds(name, joint, dry):
    """Dry friction that nobody knows of holds the joint, which is told to be free."""
    robot = ftqp.robots.load(name)
    q = robot.neutral
    gear = TrueArm(coulomb={robot.joints[joint - 1]: dry})
    plant = MujocoPlant(robot, DT, JointServo(robot, "position"), gear)
    plant.reset(q, np.zeros(robot.nv))
    planner = ftqp.Planner(robot, DT)
    planner.reset(q)
    way = ftqp.paths.Circle(robot.pose(q), 0.05, duration=2.0).sample(DT * np.arange(2001))
    target, errors = ftqp.Target(pose=robot.pose(q)), []
    for k in range(2001):
        if k == 600:
            plant.fail(ftqp.FreeSwinging(joint - 1))
            planner.report(ftqp.FreeSwinging(joint - 1))
        target.at(way.pose[k], way.twist[k], way.acceleration[k])
        step = planner.step(plant.q, None, target)
        errors.append(step.position_error + robot.length * step.rotation_error)
        plant.advance(step)
    assert planner.stopped_because is None and step.rows == planner.task_rows
    assert max(errors) < 0.01 and errors[-1] < 2e-3
