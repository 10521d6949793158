"""What remains after a failure: each offer can be carried out, and the least lost comes first."""

import numpy as np
import pytest

import ftqp
from ftqp.analysis.planning.remaining import continuation, remaining
from ftqp.analysis.survival.continuing import track
from ftqp.analysis.survival.coverage import coverage
from ftqp.analysis.survival.task_path import task_path


@pytest.fixture(scope="module")
def line():
    """Three fast unit links along the line of the closed form, and their motion of least speed."""
    robot = ftqp.robots.load("planar", lengths=(1.0, 1.0, 1.0), continuous=True).with_limits(v_max=50.0)
    q0 = np.array([-1.524418, 1.260809, 0.741032])
    path = ftqp.paths.Line(robot.pose(q0), [-1.4, 2.0, 0.0], duration=10.0)
    task = task_path(robot, path, rows=["x", "y"], dt=0.1)
    return task, track(task, q0)


@pytest.fixture(scope="module")
def reach():
    """A Panda with the tool down, 0.4 m along y."""
    robot = ftqp.robots.load("panda")
    q0 = np.array([-0.04707399, -0.19360216, -0.35240546, -2.21607467, -0.07425928, 2.03299872, 0.42514679])
    task = task_path(robot, ftqp.paths.Line(robot.pose(q0), [0.0, 0.4, 0.0], duration=6.0), dt=0.06)
    return task, track(task, q0)


def within_reach(task, q, joint):
    """Whether two links reach each later goal with joint 1 or 3 locked, by the closed form (unit links)."""
    p = task.goals[:, :2, 3]
    if joint == 0:
        away = np.linalg.norm(p - np.array([np.cos(q[0]), np.sin(q[0])]), axis=1)
        return away < 2.0
    span = 2.0 * abs(np.cos(0.5 * q[2]))
    away = np.linalg.norm(p, axis=1)
    return (abs(1.0 - span) < away) & (away < 1.0 + span)


def test_a_survived_lock_leaves_the_whole_task_and_its_motion_keeps_it(line):
    task, q = line
    k = 5
    offers = remaining(task, q[k], task.t[k], [ftqp.Locked("j3")])
    assert within_reach(task, q[k], 2)[k:].all()
    assert [offer.kind for offer in offers] == ["task", "retreat", "stop"]
    best = offers[0]
    assert best.until == pytest.approx(10.0)
    assert len(best.q) == task.N + 1 - k
    assert np.array_equal(best.q[0], q[k])
    assert np.ptp(best.q[:, 2]) == 0.0
    for row, goal in zip(best.q[1:], task.goals[k + 1 :], strict=True):
        assert np.abs(task.robot.pose(row)[:2, 3] - goal[:2, 3]).max() < 1e-8


def test_a_lost_path_is_done_up_to_where_the_closed_form_ends_it(line):
    task, q = line
    k = 40
    inside = within_reach(task, q[k], 0)
    first = k + int(np.argmin(inside[k:]))
    assert not inside[first]
    offers = remaining(task, q[k], task.t[k], [ftqp.Locked("j1")])
    assert [offer.kind for offer in offers] == ["until", "retreat", "stop"]
    assert offers[0].until == pytest.approx(task.t[first - 1])
    assert len(offers[0].q) == first - k
    assert f"up to {task.t[first - 1]:.3g} s" in offers[0].sentence
    back = offers[1]
    assert back.until == 0.0 and np.ptp(back.q[:, 0]) == 0.0
    assert np.abs(task.robot.pose(back.q[-1])[:2, 3] - task.goals[0, :2, 3]).max() < 1e-8


def test_rows_are_given_up_before_the_path_is(reach):
    task, q = reach
    k = 20
    offers = remaining(task, q[k], task.t[k], [ftqp.Locked("panda_joint4")])
    kinds = [(offer.kind, offer.rows) for offer in offers]
    assert kinds[0] == ("rows", "position")
    assert kinds[-1] == ("stop", "")
    robot, best = task.robot, offers[0]
    assert np.ptp(best.q[:, 3]) == 0.0
    assert (best.q >= robot.limits.q_min - 1e-9).all() and (best.q <= robot.limits.q_max + 1e-9).all()
    for row, goal in zip(best.q[1:], task.goals[k + 1 :], strict=True):
        assert np.linalg.norm(robot.pose(row)[:3, 3] - goal[:3, 3]) < 2e-3


def test_of_a_failure_that_cannot_be_looked_ahead_on_only_a_stop_is_offered(reach):
    task, q = reach
    for faults in (
        [ftqp.FreeSwinging("panda_joint2")],
        [ftqp.Locked("panda_joint1"), ftqp.Degraded("panda_joint2", torque=0.5)],
        [ftqp.Locked(f"panda_joint{i}") for i in (1, 2, 3)],
    ):
        (offer,) = remaining(task, q[3], task.t[3], faults)
        assert offer.kind == "stop" and np.array_equal(offer.q, q[3][None])


def test_continuation_after_a_lock_is_the_verified_one_where_there_is_something_to_choose():
    robot = ftqp.robots.load("planar", count=4)
    path = ftqp.paths.Line(robot.pose(robot.neutral), [-0.3, 0.1, 0.0], duration=4.0)
    task = task_path(robot, path, rows="position", dt=0.1)
    q = track(task, robot.neutral)
    verified = coverage(robot, task, q, stride=1)
    assert verified.post == "qp" and verified.coverage == 1.0
    for k, joint in ((0, 2), (17, 0)):
        first, rows = continuation(task, q[k], task.t[k], [ftqp.Locked(joint)])
        assert first == k and np.array_equal(rows, verified.continue_after(joint, task.t[k]))
    assert continuation(task, q[5], task.t[5], [ftqp.Locked(0), ftqp.Locked(1)]) is None  # as many as rows
    assert continuation(task, q[5], task.t[5], [ftqp.Degraded(0, velocity=0.5)]) is None
    assert continuation(task, q[5], task.t[5], []) is None


def test_a_degraded_joint_is_looked_ahead_on_with_the_speed_that_is_left(line):
    task, q = line
    k, hurry = 5, np.abs(np.diff(q, axis=0)).max(axis=0) / task.dt
    enough, little = (float(share * hurry[1] / 50.0) for share in (1.5, 0.2))
    whole = remaining(task, q[k], task.t[k], [ftqp.Degraded("j2", velocity=enough)])
    assert whole[0].kind == "task" and len(whole[0].q) == task.N + 1 - k
    for offer in remaining(task, q[k], task.t[k], [ftqp.Degraded("j2", velocity=little)]):
        speed = np.abs(np.diff(offer.q[:, 1])).max(initial=0.0) / task.dt
        assert speed <= 50.0 * little * (1.0 + 1e-9)
    both = remaining(task, q[k], task.t[k], [ftqp.Locked("j3"), ftqp.Degraded("j2", velocity=little)])
    assert both[0].kind == "until" and both[0].until < task.t[-1]
    narrow = ftqp.Degraded("j2", q_min=q[k, 1] - 0.05, q_max=q[k, 1] + 0.05)
    for offer in remaining(task, q[k], 0.5, [narrow]):
        assert np.abs(offer.q[:, 1] - q[k, 1]).max() <= 0.05 + 1e-9, offer.kind
    outside = ftqp.Degraded("j2", q_max=q[k, 1] - 0.05)
    assert [offer.kind for offer in remaining(task, q[k], 0.5, [outside])] == ["stop"]
