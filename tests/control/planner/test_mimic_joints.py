"""Joints that follow others in a planner: they move with their leaders, and fail with them."""

import numpy as np
import pytest
from tests.telescope import telescope

import ftqp

LED = {"lift2": ("lift", 0.5, 0.02), "elbow": ("shoulder", -0.7, 0.3)}


@pytest.fixture(scope="module")
def robot():
    return ftqp.Robot.from_urdf(telescope(), "tool")


def start(robot):
    """A posture in which no joint is near a limit, followers where their leaders put them."""
    q = np.array([0.3, 0.2, 0.0, 0.5, 0.0, 0.2, 0.9, 0.3])
    return robot.chain.ratio * q[robot.chain.lead] + robot.chain.offset


def off_image(robot, q):
    """How far followers are from where their leaders put them."""
    return np.abs(robot.chain.ratio * q[robot.chain.lead] + robot.chain.offset - q).max()


@pytest.mark.parametrize("mode", ["slack", "hard", "scaled", "lexicographic"])
@pytest.mark.parametrize("level", ["acceleration", "velocity"])
def test_the_tip_follows_a_path_and_every_follower_its_leader(robot, level, mode):
    planner = ftqp.Planner(robot, level=level, task=ftqp.Task("position", mode=mode))
    q = start(robot)
    planner.reset(q)
    path = ftqp.paths.Circle(robot.pose(q), radius=0.05, duration=3.0)
    sampled = path.sample([0.001 * k for k in range(1500)])
    targets = ftqp.Targets(sampled.pose, sampled.twist, sampled.acceleration)
    moved = np.zeros(robot.nv)
    for k in range(1500):
        step = planner.step(q, None, targets.at(k))
        assert step.status is ftqp.StepStatus.OK
        assert off_image(robot, step.q) <= 1e-15 and (np.abs(step.v) <= robot.limits.v_max).all()
        moved += np.abs(step.q - q)
        q = step.q.copy()
    assert step.position_error < 1e-4 and moved[[2, 4]].min() > 1e-3
    assert not step.tau[[2, 4]].any() and np.abs(step.tau[3]) > 1.0


@pytest.mark.parametrize("backend", ["active_set", "dtrnn", "quadprog"])
def test_the_least_rates_of_the_motors_are_those_of_the_folded_jacobian(robot, backend):
    planner = ftqp.Planner(robot, level="velocity", task=ftqp.Task("position", mode="hard"), backend=backend)
    q, twist = start(robot), 1e-3 * np.array([2.0, -3.0, 1.0, 0.0, 0.0, 0.0])
    planner.reset(q)
    J = robot.jacobian(q)[:3]
    for name, (leader, ratio, _) in LED.items():  # by hand, from the columns of joints without mimic
        plain = ftqp.Robot.from_pinocchio(robot.model, "tool", acceleration=robot.limits.a_max)
        column = plain.jacobian(q)[:3]
        l, m = robot.joint(leader), robot.joint(name)
        assert J[:, l] == pytest.approx(column[:, l] + ratio * column[:, m], abs=1e-14)
    step = planner.step(q, None, ftqp.Target(pose=robot.pose(q), twist=twist))
    expected = np.linalg.pinv(J) @ twist[:3]
    for name, (leader, ratio, _) in LED.items():
        expected[robot.joint(name)] = ratio * expected[robot.joint(leader)]
    assert step.v == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize("mode", ["ramp", "instant"])
@pytest.mark.parametrize("level", ["acceleration", "velocity"])
def test_a_locked_follower_locks_its_leader_and_the_arm_goes_on(robot, level, mode):
    planner = ftqp.Planner(robot, level=level, task=ftqp.Task("position"))
    q = start(robot)
    planner.reset(q)
    path = ftqp.paths.Line(robot.pose(q), displacement=(0.0, 0.08, 0.0), duration=1.0)
    sampled = path.sample([0.001 * k for k in range(1500)])
    targets = ftqp.Targets(sampled.pose, sampled.twist, sampled.acceleration)
    for k in range(1500):
        if k == 400:
            planner.report(ftqp.Locked("elbow", mode=mode))
            assert list(planner.faults) == ["shoulder"]
        step = planner.step(q, None, targets.at(k))
        assert off_image(robot, step.q) <= 1e-15
        if k > 800:
            assert step.v[3] == step.v[4] == 0.0 and step.q[3] == q[3] and step.q[4] == q[4]
        q = step.q.copy()
    assert step.status is ftqp.StepStatus.OK and step.position_error < 1e-4
    planner.withdraw("elbow")
    assert not planner.faults


def test_a_degraded_follower_lowers_the_limits_of_its_leader(robot):
    planner = ftqp.Planner(robot, task=ftqp.Task("position"))
    planner.reset(start(robot))
    planner.report(ftqp.Degraded("elbow", velocity=0.25, q_max=0.5))
    (fault,) = planner.faults.values()
    assert fault.joint == "shoulder" and fault.velocity == 0.25
    assert (fault.q_min, fault.q_max) == (pytest.approx((0.5 - 0.3) / -0.7), None)


@pytest.mark.parametrize(
    "says", [lambda q, k: np.nan, lambda q, k: q + 0.05, lambda q, k: q + 0.2 * min(k / 50, 1.0)]
)
def test_the_encoder_of_a_follower_is_looked_at_as_any(robot, says):
    planner = ftqp.Planner(robot, task=ftqp.Task("position"))
    q = start(robot)
    planner.reset(q)
    target = ftqp.Target(position=robot.pose(q)[:3, 3])
    for _ in range(100):
        assert planner.step(q, None, target).status is ftqp.StepStatus.OK
    seen = set()
    for k in range(400):
        wrong = q.copy()
        wrong[4] = says(q[4], k)
        step = planner.step(wrong, None, target)
        seen.add(step.status)
        q = step.q.copy()
    assert not seen <= {ftqp.StepStatus.OK}
    assert step.status is not ftqp.StepStatus.OK


def test_further_tasks_and_kept_points_count_what_a_follower_moves(robot):
    q = start(robot)
    high = robot.pose(q, "roll")[2, 3]
    planner = ftqp.Planner(
        robot,
        tasks=[
            ftqp.Task("position"),
            ftqp.PositionTask("roll", rows="z", target=(0, 0, high - 0.1), name="low", weight=10.0),
        ],
        constraints=[ftqp.Keep("roll", above=[0, 0, high - 0.03])],
    )
    planner.reset(q)
    target = ftqp.Target(pose=robot.pose(q))
    for _ in range(5500):
        step = planner.step(q, None, target)
        q = step.q.copy()
        assert robot.pose(q, "roll")[2, 3] >= high - 0.03 - 1e-6
    assert robot.pose(q, "roll")[2, 3] == pytest.approx(high - 0.03, abs=1e-3)
    assert step.position_error < 1e-3


def test_a_task_of_a_follower_is_one_of_its_leader_and_a_motion_of_the_joints_takes_both(robot):
    planner = ftqp.Planner(
        robot,
        tasks=[ftqp.Task("position"), ftqp.JointTask({"elbow": 0.1}, weight=10.0)],
    )
    assert planner.tasks["JointTask"].target[3] == pytest.approx((0.1 - 0.3) / -0.7)
    goal = start(robot)
    goal[0], goal[3] = 0.6, 0.2
    goal = robot.chain.ratio * goal[robot.chain.lead] + robot.chain.offset
    mover = ftqp.GoTo(ftqp.Planner(robot), q=goal)
    q = start(robot)
    mover.reset(q)
    for _ in range(3000):
        step = mover.step(q, None)
        q = step.q.copy()
        assert off_image(robot, q) <= 1e-15
    assert q == pytest.approx(goal, abs=1e-6)


def test_a_batch_steps_as_the_planner_does(robot):
    planner = ftqp.Planner(robot, task=ftqp.Task("position"))
    q = start(robot)
    planner.reset(q)
    path = ftqp.paths.Line(robot.pose(q), displacement=(0.0, 0.05, 0.0), duration=0.3)
    sampled = path.sample([0.001 * k for k in range(300)])
    targets = ftqp.Targets(sampled.pose, sampled.twist, sampled.acceleration)
    found = ftqp.batch.rollout(planner, q[None], np.zeros((1, 8)), targets)
    for k in range(300):
        q = planner.step(q, None, targets.at(k)).q.copy()
    assert found.q[0] == pytest.approx(q, abs=1e-12)


def test_a_joint_with_followers_that_swings_freely_is_refused(robot):
    planner = ftqp.Planner(robot)
    with pytest.raises(ftqp.InputError, match="free-swinging joint needs a motor at every joint"):
        planner.report(ftqp.FreeSwinging("shoulder"))
