"""What a planner does once it is told that a joint swings freely."""

import logging

import numpy as np
import pytest

import ftqp
from ftqp.core.errors import InputError

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
        "panda_joint5 swings freely: the others brake while it is decided what can be kept",
        "panda_joint5 swings freely: tip held at its position, attitude given up",
    ]


def test_others_hold_still_where_an_impact_would_harm_nobody():
    run = Run(4, 1.0, damping=0.5, task=ftqp.Task(degrade=("pose",)))  # the pose cannot be kept
    others = np.delete(run.plant.q - run.robot.neutral, 4)
    assert np.abs(others).max() < 1e-3 and abs(run.plant.q[4] - run.robot.neutral[4]) > 0.01
    assert run.last.status is S.STOPPED
    assert [step.status for step in run.steps].index(S.STOPPED) * DT < 0.1


@pytest.mark.long
def test_repaired_joint_lets_the_task_go_on():
    run = Run(4, 1.0, damping=0.5)
    run.planner.withdraw(4)
    run.plant._faults.clear()
    for _ in range(2500):
        step = run.tick()
    assert step.status is S.OK and step.rows == run.planner.task_rows and step.notice is None


def test_two_free_joints_leave_the_others_only_to_brake():
    run = Run(4, 0.3, damping=0.5)
    run.planner.report(ftqp.FreeSwinging(1))
    run.plant.fail(ftqp.FreeSwinging(1))
    for _ in range(500):
        step = run.tick()
    assert step.status is S.STOPPED and np.abs(np.delete(run.plant.v, [1, 4])).max() < 1e-3


def test_rows_that_may_be_kept_can_be_limited():
    task = ftqp.Task(degrade=("pose",))
    assert task.kept_sets == ("pose",) and ftqp.Task(rows="position").kept_sets == ("position",)
    run = Run(4, 0.1, damping=0.5, task=task)
    assert run.last.rows == () and run.last.status in (S.STOPPING, S.STOPPED)
    with pytest.raises(InputError, match=r"degrade has 'poze' .*did you mean"):
        ftqp.Task(degrade=("poze",))


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


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
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


SLOW_TO_REST = {
    "iiwa14": (
        2,
        [-0.245539, 0.89978, -0.196185, 0.815222, 0.983579, -0.276704, 1.003379],
        [-0.466727, -0.057677, -0.587945, -0.547646, -0.02477, -0.632589, 0.931499],
    ),
    "xarm7": (
        1,
        [-4.769791, 0.826142, 3.151057, 0.635889, -5.02541, -1.033731, -0.418886],
        [0.015143, -0.19547, 0.252033, 0.250484, 0.265026, -0.141169, -0.120615],
    ),
}
"""Runs of ``studies/study_free_swinging.py --seed 3``: the joint, where the arm is and how fast; the target
brakes within ``BRAKING``."""
BRAKING = 0.4


@pytest.mark.parametrize("name", list(SLOW_TO_REST))
def test_healthy_joints_rest_within_a_second_and_a_half_of_giving_the_task_up(name):
    joint, q, v = SLOW_TO_REST[name]
    robot = ftqp.robots.load(name)
    plant, planner = ftqp.KinematicPlant(robot, DT), ftqp.Planner(robot, DT)
    fault = ftqp.FreeSwinging(joint, damping=0.5)
    plant.reset(q, v)
    planner.reset(q, v)
    plant.fail(fault)
    planner.report(fault)
    healthy, begin = np.arange(robot.nv) != joint, robot.pose(q)
    away = (robot.pose(np.array(q) + 1e-6 * np.array(v)) - robot.pose(np.array(q) - 1e-6 * np.array(v)))[
        :3, 3
    ] / 2e-6
    said, fast = [], []
    for k in range(2500):
        t, pose, twist, slower = min(k * DT, BRAKING), begin.copy(), np.zeros(6), np.zeros(6)
        pose[:3, 3] += away * (t - 0.5 * t * t / BRAKING)
        twist[:3] = away * (1.0 - t / BRAKING)
        slower[:3] = -away / BRAKING if k * DT < BRAKING else 0.0
        step = planner.step(plant.q, plant.v, ftqp.Target(pose=pose, twist=twist, acceleration=slower))
        said.append(step.status.name)
        fast.append(np.max(np.abs(plant.v / robot.limits.v_max)[healthy]))
        plant.advance(step)
    stopped = said.index("STOPPED")
    assert stopped - said.index("STOPPING") < 1500
    assert max(fast[stopped:]) < 0.05 and set(said[stopped:]) == {"STOPPED"}
