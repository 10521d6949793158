"""What a planner does once it is told that a joint swings freely."""

import logging

import numpy as np
import pytest
from tests.going import closed_loop, targets_along

import ftqp

DT = 1e-3
S = ftqp.StepStatus


class Run:
    """Ticks of a planner on an arm with a free-swinging joint that is announced at once."""

    def __init__(self, joint, seconds, *, robot="panda", level="acceleration", q=None, task=None, **fault):
        self.robot = robot = ftqp.robots.load(robot)
        self.planner = ftqp.Planner(robot, DT, level=level, task=task)
        self.plant = ftqp.KinematicPlant(robot, DT, level)
        q = robot.neutral if q is None else np.asarray(q)
        self.planner.reset(q)
        self.plant.reset(q, np.zeros(robot.nv))
        self.target = ftqp.Target(pose=robot.pose(q))
        fault = ftqp.FreeSwinging(joint, **fault)
        self.planner.report(fault)
        self.plant.fail(fault)
        self.steps = [self.tick() for _ in range(round(seconds / DT))]

    def tick(self):
        step = self.planner.step(self.plant.q, self.plant.v, self.target).copy()
        self.plant.advance(step)
        return step

    @property
    def last(self):
        return self.steps[-1]


@pytest.fixture(scope="module")
def held():
    """A wrist joint whose arm can be led to a posture in which it hangs."""
    return Run(4, 3.0, damping=0.5)


@pytest.fixture(scope="module")
def fallen():
    """A shoulder joint that falls whatever the others do."""
    return Run(1, 2.0, damping=0.5, q=[0.3, 0.6, 0.2, -1.2, 0.3, 1.6, 0.4])


@pytest.mark.long
def test_tip_is_held_at_its_position_and_the_attitude_given_up(held):
    assert held.last.rows == ("x", "y", "z")
    assert held.last.status is S.RELAXED
    assert held.last.position_error < 1e-3 and np.abs(held.plant.v).max() < 1e-2
    assert held.plant.impacts == ()
    assert max(step.position_error for step in held.steps) < 0.1


def test_free_joint_gets_no_torque_and_the_others_no_more_than_they_have(held, fallen):
    for run in (held, fallen):
        joint = int(np.flatnonzero(run.planner.session().K.faults.code[:7])[0])
        tau_max = run.robot.limits.tau_max
        assert all(step.tau[joint] == 0.0 for step in run.steps)
        assert all((np.abs(step.tau) <= tau_max * (1 + 1e-9)).all() for step in run.steps)


def test_task_given_up_ends_stopped_on_the_stop_whose_torque_is_told(fallen):
    stopped = [k for k, step in enumerate(fallen.steps) if step.status is S.STOPPED]
    assert stopped and stopped[0] * DT < 1.5
    assert all(step.status is S.STOPPED for step in fallen.steps[stopped[0] :])
    assert fallen.last.rows == ()
    assert len(fallen.plant.impacts) >= 1
    pushed = fallen.last.tau_stop
    assert np.count_nonzero(pushed) == 1 and abs(pushed[1]) > 1.0
    at_lower = fallen.plant.q[1] < 0.0
    assert (pushed[1] > 0.0) == at_lower


def test_impact_is_told_before_it_happens(fallen):
    hit = fallen.plant.impacts[0]
    before = fallen.steps[round(hit.time / DT) - 60]
    assert before.impact is not None and before.impact.side in ("lower", "upper")
    assert abs(before.impact.time - 0.06) < 0.02
    assert abs(before.impact.speed - hit.speed) < 0.5
    assert before.impact.energy > 0.0
    assert fallen.last.impact is None


def test_operator_is_told_of_every_change_once(caplog):
    with caplog.at_level(logging.WARNING, "ftqp"):
        Run(4, 0.5, damping=0.5)
    assert caplog.messages == [
        "panda_joint5 swings freely: the remaining joints brake while it is decided what can be kept",
        "panda_joint5 swings freely: end effector held at its position, attitude given up",
    ]


def test_others_hold_still_where_an_impact_would_harm_nobody():
    run = Run(4, 1.0, damping=0.5, task=ftqp.Task(degrade=("pose",)))  # the pose cannot be kept
    others = np.delete(run.plant.q - run.robot.neutral, 4)
    assert np.abs(others).max() < 1e-3 and abs(run.plant.q[4] - run.robot.neutral[4]) > 0.01
    assert run.last.status is S.STOPPED
    assert [step.status for step in run.steps].index(S.STOPPED) * DT < 0.1


def test_two_free_joints_leave_the_others_only_to_brake():
    run = Run(4, 0.3, damping=0.5)
    run.planner.report(ftqp.FreeSwinging(1))
    run.plant.fail(ftqp.FreeSwinging(1))
    for _ in range(500):
        step = run.tick()
    assert step.status is S.STOPPED and np.abs(np.delete(run.plant.v, [1, 4])).max() < 1e-3


def test_a_joint_without_gravity_is_not_sped_up_to_keep_the_tip():
    """A Panda that could hold its tip for 1.8 s, and would throw its first joint at its stop by that."""
    robot = ftqp.robots.load("panda")
    planner, plant = ftqp.Planner(robot, DT), ftqp.KinematicPlant(robot, DT)
    q = np.array([-0.941, -1.124, -1.338, -0.713, 1.719, 1.343, 1.549])
    v = np.array([-0.908, -0.059, 0.252, -1.080, 0.129, -0.033, -0.275])
    planner.reset(q, v)
    plant.reset(q, v)
    fault = ftqp.FreeSwinging(0, damping=0.5)
    planner.report(fault)
    plant.fail(fault)
    start, twist = robot.pose(q), robot.jacobian(q)[:3] @ v
    target, statuses = ftqp.Target(pose=start, twist=np.zeros(6), acceleration=np.zeros(6)), []
    for k in range(3500):
        left = max(0.0, 1.0 - k * DT / 0.4)  # the tip comes to rest in 0.4 s
        target.pose[:3, 3] = start[:3, 3] + twist * 0.2 * (1.0 - left**2)
        target.twist[:3], target.acceleration[:3] = twist * left, -twist / 0.4 * (left > 0.0)
        step = planner.step(plant.q, plant.v, target)
        statuses.append(step.status)
        plant.advance(step)
    assert all(hit.speed < 0.2 for hit in plant.impacts)
    assert statuses[-1] is S.STOPPED and statuses.index(S.STOPPED) * DT < 2.6
    healthy = np.abs(plant.v[1:]) / robot.limits.v_max[1:]
    assert healthy.max() < 0.01


def test_others_brake_as_hard_beside_a_free_joint_when_they_are_stopped(level):
    robot = ftqp.robots.load("panda")
    planner, plant = ftqp.Planner(robot, DT, level=level), ftqp.KinematicPlant(robot, DT, level)
    q, v = robot.neutral, np.array([0.2, 0.8, 0.6, 0.0, 0.0, 0.0, 0.0])
    planner.reset(q, v)
    plant.reset(q, v)
    planner.report(ftqp.FreeSwinging(0, damping=0.5))
    plant.fail(ftqp.FreeSwinging(0, damping=0.5))
    planner.stop()
    target = ftqp.Target(pose=robot.pose(q))
    for _ in range(round(0.4 / DT)):  # 0.8 rad/s at 7.5 rad/s2, which takes 0.05 s to come up
        plant.advance(planner.step(plant.q, plant.v, target))
    assert np.abs(plant.v[1:]).max() < 1e-3


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


HELD = "panda_joint5 has no motor: the remaining joints keep the task and make up for its measured motion"


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
    planner.report(ftqp.FreeSwinging(WRIST))
    for step in closed_loop(planner, ftqp.Target(pose=robot.pose(robot.neutral)), 100):
        assert "swings freely" in step.notice
    assert abs(step.q[WRIST] - robot.neutral[WRIST]) > 0.02


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
    targets, rng, said = targets_along(path, 1000, DT), np.random.default_rng(1), []
    for k in range(1000):
        if k == 700:
            plant.fail(ftqp.FreeSwinging(joint))
        if k == reported_at:
            planner.report(ftqp.FreeSwinging(joint))
        step = planner.step(plant.q + 1e-4 * rng.standard_normal(7), None, targets.at(k))
        plant.advance(step)
        for what in ("has no motor", "swings freely"):
            if what in (step.notice or "") and what not in dict(said):
                said.append((what, k))
    return said, planner.findings


@pytest.mark.parametrize(
    ("drive", "joint"),
    [("position", 3), ("velocity", 3), ("torque", 3)]
    + [pytest.param(*which, marks=pytest.mark.slow) for which in (("position", 5), ("torque", 4))],
)
def test_joint_that_a_detector_finds_goes_the_way_of_one_that_is_told(drive, joint):
    found, (finding, *_) = _said(drive, joint)
    assert finding.joint == f"panda_joint{joint + 1}"
    if finding.kinds == {"runaway"}:  # it falls so fast that its brake is asked for
        return
    assert finding.kinds == {"free_swinging"}
    at = found[0][1]
    told, _ = _said(drive, joint, reported_at=at)
    assert [what for what, _ in told] == [what for what, _ in found]
    assert all(abs(k - m) <= 1 for (_, k), (_, m) in zip(told, found, strict=True))
    if drive == "torque":
        assert [what for what, _ in found] == ["swings freely"]
    else:
        (_, measured), (_, swings) = found
        assert 45 <= swings - measured <= 60
