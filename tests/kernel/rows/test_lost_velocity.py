"""A brake that closes at once: the other joints give back what the tip loses as soon as they can."""

import numpy as np
import pytest

import ftqp

DT = 1e-3
PANDA = ftqp.robots.load("panda")


def strays(joint, at=700):
    """How far the tip strays after a joint has stopped at once, and how far at full acceleration [m]."""
    planner = ftqp.Planner(PANDA, DT, task=ftqp.Task(rows="position"), emergency=None)
    q, v = PANDA.neutral.copy(), np.zeros(7)
    planner.reset(q)
    path = ftqp.paths.Circle(PANDA.pose(q), radius=0.1, duration=2.0).sample(DT * np.arange(2000))
    targets, worst, bound, held = ftqp.Targets(path.pose, path.twist, path.acceleration), 0.0, 0.0, None
    for k in range(1600):
        if k == at:
            held = float(q[joint])
            J = PANDA.jacobian(q)[:3]
            lost, others = J[:, joint] * v[joint], [i for i in range(7) if i != joint]
            jump = np.linalg.pinv(J[:, others]) @ lost
            bound = (
                float(np.linalg.norm(lost)) * 0.5 * float(np.max(np.abs(jump) / PANDA.limits.a_max[others]))
            )
            planner.report(ftqp.Locked(joint))
        step = planner.step(q, None, targets.at(k))
        q, v = step.q.copy(), step.v.copy()
        if held is not None:
            q[joint] = held
            tip = PANDA.pose(q)[:3, 3]
            worst = max(worst, float(np.linalg.norm(tip - path.pose[k + 1][:3, 3])))
    return worst, bound


@pytest.mark.parametrize("joint", [0, 2, 3])
def test_the_tip_strays_no_more_than_twice_what_the_joints_need_at_full_acceleration(joint):
    worst, bound = strays(joint)
    assert 0.0 < worst < 2.0 * bound + 2e-5, (worst, bound)


def test_a_joint_that_stops_as_foreseen_owes_nothing():
    planner = ftqp.Planner(PANDA, DT)
    q = PANDA.neutral.copy()
    planner.reset(q)
    path = ftqp.paths.Circle(PANDA.pose(q), radius=0.1, duration=2.0).sample(DT * np.arange(2000))
    targets = ftqp.Targets(path.pose, path.twist, path.acceleration)
    for k in range(1000):
        if k == 500:
            planner.report(ftqp.Locked(2))
        q = planner.step(q, None, targets.at(k)).q.copy()
        assert planner._session.K.task.owes == 0


def test_it_ends_where_the_target_stands():
    planner = ftqp.Planner(PANDA, DT)
    q = PANDA.neutral.copy()
    planner.reset(q)
    T = PANDA.pose(q)
    for k in range(3000):
        target = T.copy()
        target[1, 3] += 0.1 * min(k * DT, 0.5)
        if k == 400:
            stopped = q[0]
            planner.report(ftqp.Locked(0))
        step = planner.step(q, None, ftqp.Target(pose=target))
        q = step.q.copy()
        if k >= 400:
            q[0] = stopped
    assert planner._session.K.task.owes == 0
    assert np.abs(step.v).max() < 1e-6 and step.position_error < 1e-5
