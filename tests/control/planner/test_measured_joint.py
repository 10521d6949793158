"""A joint without motor and brake is measured first, and held to swing once it is seen to."""

import numpy as np
import pytest

import ftqp

DT = 1e-3
S = ftqp.StepStatus
WRIST = 4


class Arm:
    """A Panda whose other joints do what they are told, and one of which goes where ``way`` says.

    ``way(t)`` is how far the joint has gone since the report, ``noise`` that of the encoders [rad].
    """

    def __init__(
        self, way, *, joint=WRIST, noise=1e-6, level="acceleration", seconds=0.2, moving=True, **fault
    ):
        self.robot = robot = ftqp.robots.load("panda")
        self.planner = ftqp.Planner(robot, DT, level=level)
        rng = np.random.default_rng(3)
        q = robot.neutral.copy()
        self.planner.reset(q)
        path = ftqp.paths.Circle(robot.pose(q), 0.05, duration=4.0)
        sample = path.sample(DT * np.arange(4001))
        target = ftqp.Target(pose=robot.pose(q))
        self.steps, self.tips, q_sent = [], [], q
        begin = 300 if moving else 1
        for k in range(begin + round(seconds / DT)):
            q = q_sent.copy()
            if k == begin:
                at = q[joint]
                self.planner.report(ftqp.FreeSwinging(joint, **fault))
            if k >= begin:
                q[joint] = at + way((k - begin) * DT)
            if moving:
                target.at(sample.pose[k], sample.twist[k], sample.acceleration[k])
            self.error = np.linalg.norm(robot.pose(q)[:3, 3] - target.pose[:3, 3])
            step = self.planner.step(q + noise * rng.standard_normal(7), None, target)
            q_sent = step.q.copy()
            if k >= begin:
                self.steps.append(step.copy())
                self.tips.append(self.error)

    @property
    def notices(self):
        return list(dict.fromkeys(step.notice for step in self.steps))


HELD = "panda_joint5 has no motor: the others keep the task and make up for where it is seen to go"


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
def test_task_goes_on_beside_a_joint_that_friction_holds(level):
    arm = Arm(lambda t: 0.0, level=level, seconds=0.5)
    assert arm.notices == [HELD]
    assert {step.status for step in arm.steps} <= {S.OK, S.RELAXED} and arm.steps[-1].status is S.OK
    assert max(arm.tips) < 2e-3
    assert arm.planner.stopped_because is None and arm.steps[-1].rows == arm.planner.task_rows


def test_others_make_up_for_a_joint_that_coasts():
    arm = Arm(lambda t: 0.3 * t, seconds=0.8)
    assert arm.notices == [HELD]
    assert max(arm.tips) < 5e-3 and arm.tips[-1] < 1e-3


def test_others_make_up_for_it_within_their_accelerations():
    arm = Arm(lambda t: 0.02 * min(max(t - 0.1, 0.0) / 0.01, 1.0), seconds=0.5, noise=1e-5)
    a_max = arm.robot.limits.a_max * (1.0 + 1e-9)
    healthy = np.arange(7) != WRIST
    assert all((np.abs(step.reference.a) <= a_max)[healthy].all() for step in arm.steps)
    assert arm.notices == [HELD]


@pytest.mark.parametrize("joint", [1, 3, 4])
def test_joint_that_falls_is_held_to_swing_within_a_tenth_of_a_second(joint):
    robot = ftqp.robots.load("panda")
    q = robot.neutral
    pull = -robot.bias(q, np.zeros(7))[joint] / robot.mass_matrix(q)[joint, joint]
    assert abs(pull) > 2.0
    arm = Arm(lambda t: 0.5 * pull * t * t, joint=joint, moving=False, seconds=0.15, noise=1e-5)
    said = [step.notice for step in arm.steps]
    assert "has no motor" in said[5] and "swings freely" in said[110]
    first = next(k for k, one in enumerate(said) if k > 5 and "swings freely" in one)
    assert 45 <= first <= 60


def test_joint_of_which_friction_takes_most_of_the_pull_is_not_held_to_swing():
    robot = ftqp.robots.load("panda")
    pull = -robot.bias(robot.neutral, np.zeros(7))[WRIST] / robot.mass_matrix(robot.neutral)[WRIST, WRIST]
    arm = Arm(lambda t: 0.5 * 0.2 * pull * t * t, moving=False, seconds=0.3, noise=1e-5)
    assert arm.notices[-1] == HELD and arm.planner.stopped_because is None


def test_where_nobody_measures_the_joint_swings_from_the_first_tick():
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, DT)
    q, v = robot.neutral.copy(), np.zeros(7)
    planner.reset(q)
    planner.report(ftqp.FreeSwinging(WRIST))
    target = ftqp.Target(pose=robot.pose(q))
    for _ in range(100):
        step = planner.step(q, v, target)
        q, v = step.q.copy(), step.v.copy()
        assert "swings freely" in step.notice
    assert abs(q[WRIST] - robot.neutral[WRIST]) > 0.02


def test_arm_that_rests_loses_one_tick_to_a_swing_that_is_none():
    arm = Arm(lambda t: 0.0, moving=False, noise=0.0)
    assert "swings freely" in arm.steps[0].notice
    assert [step.notice for step in arm.steps[1:]] == [HELD] * (len(arm.steps) - 1)
    assert arm.steps[-1].status is S.OK and arm.planner.stopped_because is None


def test_two_joints_that_friction_holds_stop_nobody():
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, DT, task=ftqp.Task(rows="position"))
    q = robot.neutral.copy()
    planner.reset(q)
    target = ftqp.Target(position=robot.pose(q)[:3, 3])
    planner.step(q, None, target)
    for joint in (2, 4):
        planner.report(ftqp.FreeSwinging(joint))
    rng = np.random.default_rng(0)
    for k in range(400):
        target.position[:] = robot.pose(robot.neutral)[:3, 3] + [0.0, 0.01 * np.sin(0.01 * k) ** 2, 0.0]
        step = planner.step(q + 1e-6 * rng.standard_normal(7), None, target)
        q = np.where(np.isin(np.arange(7), (2, 4)), q, step.q)
    assert planner.stopped_because is None and step.position_error < 5e-3


def test_friction_that_is_told_later_does_not_begin_the_looking_anew():
    robot = ftqp.robots.load("panda")
    planner, plant = ftqp.Planner(robot, DT), ftqp.KinematicPlant(robot, DT)
    plant.reset(robot.neutral, np.zeros(7))
    planner.reset(robot.neutral)
    target = ftqp.Target(pose=robot.pose(robot.neutral))
    rng = np.random.default_rng(1)
    plant.fail(ftqp.FreeSwinging(WRIST))
    planner.report(ftqp.FreeSwinging(WRIST))
    for k in range(200):
        if k == 150:
            planner.report(ftqp.FreeSwinging(WRIST, damping=0.1))
        step = planner.step(plant.q + 1e-6 * rng.standard_normal(7), None, target)
        plant.advance(step)
        assert k < 100 or "swings freely" in step.notice


def test_path_goes_on_beside_a_joint_that_friction_holds():
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, DT, task=ftqp.Task(mode="scaled"))
    q = robot.neutral.copy()
    path = ftqp.paths.Circle(robot.pose(q), 0.05, duration=2.0)
    follower = ftqp.PathFollower(planner, path)
    follower.reset(q)
    rng, progress = np.random.default_rng(0), []
    for k in range(900):
        if k == 300:
            planner.report(ftqp.FreeSwinging(WRIST))
        step = follower.step(q + 1e-6 * rng.standard_normal(7), None)
        progress.append(follower.progress)
        q = np.where(np.arange(7) == WRIST, q if k >= 300 else step.q, step.q)
    assert np.diff(progress).min() > 0.0 and progress[-1] > progress[299] + 0.2
    assert planner.stopped_because is None


def _said(drive, joint, *, reported_at=None):
    """What a planner says when of a Panda whose joint has no motor from tick 700 on, and its findings.

    It has a detector, or is told at a tick and has none.
    """
    robot = ftqp.robots.load("panda")
    plant = ftqp.MujocoPlant(robot, DT, ftqp.JointServo(robot, drive))
    detector = ftqp.Detector() if reported_at is None else None
    planner = ftqp.Planner(robot, DT, drive=drive, noise=ftqp.Noise(q=1e-4), detector=detector)
    planner.reset(robot.neutral)
    plant.reset(robot.neutral, np.zeros(7))
    path = ftqp.paths.Circle(robot.pose(robot.neutral), 0.1, duration=4.0)
    way, target, rng = (
        path.sample(DT * np.arange(1000)),
        ftqp.Target(pose=path.start),
        np.random.default_rng(1),
    )
    said = []
    for k in range(1000):
        if k == 700:
            plant.fail(ftqp.FreeSwinging(joint))
        if k == reported_at:
            planner.report(ftqp.FreeSwinging(joint))
        target.at(way.pose[k], way.twist[k], way.acceleration[k])
        step = planner.step(plant.q + 1e-4 * rng.standard_normal(7), None, target)
        plant.advance(step)
        for what in ("has no motor", "swings freely"):
            if what in (step.notice or "") and what not in dict(said):
                said.append((what, k))
    return said, planner.findings


@pytest.mark.parametrize(
    ("drive", "joint"),
    [("position", 3), ("velocity", 4), ("torque", 3)]
    + [pytest.param(drive, 7 - k, marks=pytest.mark.slow) for drive, k in (("position", 3), ("torque", 3))],
)
def test_joint_that_a_detector_finds_goes_the_way_of_one_that_is_told(drive, joint):
    found, (finding,) = _said(drive, joint)
    assert finding.joint == f"panda_joint{joint + 1}" and finding.kinds == {"free_swinging"}
    at = found[0][1]
    told, _ = _said(drive, joint, reported_at=at)
    assert [what for what, _ in told] == [what for what, _ in found]
    assert all(abs(k - m) <= 1 for (_, k), (_, m) in zip(told, found, strict=True))
    if drive == "torque":
        assert [what for what, _ in found] == ["swings freely"]
    else:
        (_, measured), (_, swings) = found
        assert 45 <= swings - measured <= 60
