"""No motion brings a joint that has lost torque to where it could not hold the arm."""

import numpy as np
import pinocchio as pin
import pytest

import ftqp

DT = 2e-3
ARMS = ("panda", "iiwa14", "xarm7")


def weight(robot, q):
    """The torques that hold the arm still, by pinocchio."""
    return pin.computeGeneralizedGravity(robot.model, robot.model.createData(), robot.configuration(q))


def posture(robot, rng):
    """A posture well inside the ranges."""
    low = np.where(np.isfinite(robot.limits.q_min), robot.limits.q_min, -3.0)
    high = np.where(np.isfinite(robot.limits.q_max), robot.limits.q_max, 3.0)
    return low + (high - low) * rng.uniform(0.2, 0.8, robot.nv)


def loaded(robot, q):
    """Joints that gravity loads at q, the heaviest first."""
    held = np.abs(weight(robot, q))
    return [int(i) for i in np.argsort(-held) if held[i] > 0.02 * held.max()]


@pytest.mark.long
@pytest.mark.parametrize("emergency", [None, ftqp.EmergencyStop()], ids=["goes on", "stops"])
@pytest.mark.parametrize("name", ARMS)
def test_arm_that_can_hold_itself_is_led_to_where_it_can(name, level, emergency):
    """From rest to a random place: gravity takes less than what the weak joint has left, at every tick."""
    robot, rng = ftqp.robots.load(name), np.random.default_rng(ARMS.index(name))
    tempted = 0
    for _ in range(6):
        q = posture(robot, rng)
        goal = robot.pose(posture(robot, rng))
        joint = int(rng.choice(loaded(robot, q)))
        left = min(rng.uniform(1.06, 1.6) * abs(weight(robot, q)[joint]), robot.limits.tau_max[joint])
        planner = ftqp.Planner(robot, DT, level=level, task=ftqp.Task(rows="position"), emergency=emergency)
        planner.reset(q)
        planner.report(ftqp.Degraded(joint, torque=left / robot.limits.tau_max[joint]))
        begin, v, most = robot.pose(q)[:3, 3], np.zeros(robot.nv), 0.0
        for k in range(1500):
            share = min(1.0, k / 1000)
            target = ftqp.Target(position=begin + share * (goal[:3, 3] - begin))
            step = planner.step(q, v, target)
            q, v = step.q.copy(), step.v.copy()
            assert (np.abs(v) <= robot.limits.v_max * (1.0 + 1e-9)).all()
            most = max(most, abs(weight(robot, q)[joint]) / left)
        assert most <= 1.0, (joint, most)
        tempted += most > 0.9
    assert tempted > 0 or emergency is not None, "an arm that is stopped for its error may not come near"


def test_weak_shoulder_goes_round_a_circle_whose_shortest_way_it_could_not_hold(level):
    """A Panda whose second joint has 8 % of its torque, a twentieth more than it needs where that is told."""
    robot = ftqp.robots.load("panda")
    rng = np.random.default_rng(100)
    q = np.clip(robot.neutral + rng.uniform(-0.6, 0.6, 7), robot.limits.q_min + 0.3, robot.limits.q_max - 0.3)
    axes = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    path = ftqp.paths.Circle(robot.pose(q), 0.1, duration=5.0, axes=(axes[0], axes[1]))
    way, left = path.sample(DT * np.arange(2800)), np.inf
    for tells in (True, False):
        planner = ftqp.Planner(robot, DT, level=level, task=ftqp.Task(rows="position"))
        planner.reset(q)
        at, v, needed = q, np.zeros(7), 0.0
        for k in range(2800):
            if k == 500 and tells:
                left = 1.05 * abs(weight(robot, at)[1])
                planner.report(ftqp.Degraded(1, torque=left / robot.limits.tau_max[1]))
            target = ftqp.Target(pose=way.pose[k], twist=way.twist[k], acceleration=way.acceleration[k])
            step = planner.step(at, v, target)
            at, v = step.q.copy(), step.v.copy()
            needed = max(needed, abs(weight(robot, at)[1]) if k >= 500 else 0.0)
        assert step.position_error < 1e-3
        assert (needed <= left) == tells, "healthy it goes where the weak joint could not hold the arm"
    assert planner.stopped_because is None


def test_stop_brakes_the_arm_before_a_weak_joint_is_where_it_could_not_hold_it(level):
    """A Panda loses its task because its second joint keeps 5 % of its torque, and is stopped on the way."""
    robot = ftqp.robots.load("panda")
    rng = np.random.default_rng(107)
    q = np.clip(robot.neutral + rng.uniform(-0.6, 0.6, 7), robot.limits.q_min + 0.3, robot.limits.q_max - 0.3)
    axes = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    planner = ftqp.Planner(robot, DT, level=level)
    planner.reset(q)
    path = ftqp.paths.Circle(robot.pose(q), 0.1, duration=6.0, axes=(axes[0], axes[1]))
    way, v, left, stopped = path.sample(DT * np.arange(3500)), np.zeros(7), 0.05 * robot.limits.tau_max[1], 0
    for k in range(3500):
        if k == 900:
            planner.report(ftqp.Degraded(1, torque=0.05))
        target = ftqp.Target(pose=way.pose[k], twist=way.twist[k], acceleration=way.acceleration[k])
        step = planner.step(q, v, target)
        q, v = step.q.copy(), step.v.copy()
        stopped += planner.stopped_because is not None
        assert abs(weight(robot, q)[1]) <= left or k < 900, k
    assert stopped > 500
    assert step.status == ftqp.StepStatus.STOPPED


def test_arm_that_cannot_hold_itself_is_stopped_as_before(level):
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, DT, level=level)
    planner.reset(robot.neutral)
    share = 0.9 * abs(weight(robot, robot.neutral)[3]) / robot.limits.tau_max[3]
    planner.report(ftqp.Degraded(3, torque=share))
    assert planner.stopped_because == "panda_joint4 cannot hold the arm here with the torque that it has left"
