"""Rows of joints that have lost torque: their gradient, their law of braking, and when there are none."""

import numpy as np
import pinocchio as pin
import pytest
from tests.going import started

import ftqp
from ftqp.kernel.rows.holding_rows import holding_rate

PANDA = ftqp.robots.load("panda")
DT = 2e-3
Q = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])


def weight(robot, q):
    """The torques that hold the arm still, by pinocchio."""
    return pin.computeGeneralizedGravity(robot.model, robot.model.createData(), robot.configuration(q))


def weakened(level, joint, room):
    """A planner at rest whose joint has so many times the torque that holds the arm there."""
    planner = started(PANDA, DT, level=level, task=ftqp.Task(rows="position"), at=Q)
    share = room * abs(weight(PANDA, Q)[joint]) / PANDA.limits.tau_max[joint]
    planner.report(ftqp.Degraded(joint, torque=share))
    return planner


def rows(planner):
    """C, l, u of the first tick of an arm at rest that is to stay there, joint by joint."""
    planner.step(Q, np.zeros(7), ftqp.Target(pose=PANDA.pose(Q)))
    qp = planner.session().K.qp
    nc = int(qp.nc)
    return qp.C[:nc, :7].copy(), qp.l[:nc].copy(), qp.u[:nc].copy()


@pytest.mark.parametrize("joint", [1, 2, 3, 4, 5, 6])
def test_row_is_the_direction_in_which_gravity_loads_the_joint_more(level, joint):
    C, l, u = rows(weakened(level, joint, 1.3))
    assert C.shape == (14, 7)
    step = 1e-6 * np.eye(7)
    slope = [(weight(PANDA, Q + d)[joint] - weight(PANDA, Q - d)[joint]) / 2e-6 for d in step]
    np.testing.assert_allclose(C[7 + joint], slope / np.linalg.norm(slope), atol=1e-6)
    others = np.arange(7) != joint
    assert not C[7:][others].any() and np.isinf(l[7:][others]).all() and np.isinf(u[7:][others]).all()
    nearer, farther = (u, -l) if weight(PANDA, Q)[joint] > 0.0 else (-l, u)
    assert 0.0 < nearer[7 + joint] < farther[7 + joint] < np.inf


@pytest.mark.parametrize("fault", [None, ftqp.Degraded(1, velocity=0.5), ftqp.Locked(1)], ids=str)
def test_no_rows_where_no_joint_lost_torque(level, fault):
    planner = weakened(level, 3, 1.3)
    planner.withdraw(3)
    if fault is not None:
        planner.report(fault)
    assert len(rows(planner)[0]) in (0, 7)


def test_joint_that_needs_its_reserve_is_led_back_but_not_in_a_stop(level):
    planner = weakened(level, 3, 1.02)
    _, l, u = rows(planner)
    assert not l[10] <= 0.0 <= u[10]
    planner.stop()
    _, l, u = rows(planner)
    assert l[10] <= 1e-12 and u[10] >= -1e-12


@pytest.mark.parametrize("cost", [0.1, 0.5, 3.0])
@pytest.mark.parametrize("reserve", [0.0, 0.2, 1.0])
def test_what_approaches_as_fast_as_it_may_stops_before_the_limit_with_the_torque_left(reserve, cost):
    """Each tick takes no more of the braking than the share that the torque left pays for."""
    brake, dt = 8.0, 1e-3
    for d in (0.01, 0.3, 2.0):
        rate, least = holding_rate(d, reserve, brake, cost, dt), d
        for _ in range(20000):
            following = holding_rate(d - 0.5 * dt * rate, reserve, brake, cost, dt)
            share = min(1.0, (d + reserve) / cost)
            assert (rate - following) / dt <= 1.02 * brake * share + 1e-9
            d -= 0.5 * dt * (rate + following)
            rate, least = following, min(least, d)
        assert -1e-12 <= least < 0.02


def test_without_a_reserve_it_is_what_an_inverted_pendulum_can_be_caught_from():
    for d in (0.01, 0.1, 0.9):
        assert holding_rate(d, 0.0, 4.0, 1.0, 1e-6) == pytest.approx(2.0 * d, rel=1e-4)


def test_certificate_names_the_joint_that_could_not_hold_the_arm(level):
    """The tip is drawn past what the elbow, which has a tenth more torque than it needs, could hold."""
    planner = weakened(level, 3, 1.1)
    pose, q, v = PANDA.pose(Q), Q.copy(), np.zeros(7)
    goal = pose.copy()
    goal[:3, 3] += [0.4, 0.0, 0.0]
    named, least = set(), np.inf
    left = planner.session().K.limits.tau_max[3]
    for k in range(1500):
        share = min(1.0, k / 1000)
        step = planner.step(q, v, ftqp.Target(position=(1.0 - share) * pose[:3, 3] + share * goal[:3, 3]))
        named |= {(o.joint, o.limit) for o in step.certificate.obstacles} if step.certificate else set()
        q, v = step.q.copy(), step.v.copy()
        least = min(least, left - abs(weight(PANDA, q)[3]))
    assert {limit for joint, limit in named if joint == "panda_joint4"} & {
        "upper holding torque",
        "lower holding torque",
    }
    assert least > 0.0
