"""Schemes whose self-motion hardly dies out, and failures that nobody sees, keep an arm swinging.

Found by ``ftqp campaign wide`` at 18391de (episodes 119 and 590); its episodes have changed since.
"""

import numpy as np

import ftqp

DT = 0.002


def speeds(planner, q, pose, seconds, *, dead=None):
    """The largest share of its velocity limit that a joint has in each tick; ``dead`` does not move."""
    target = ftqp.Target(pose=pose)
    q, v = np.array(q), np.zeros(len(q))
    planner.reset(q)
    fastest = np.zeros(round(seconds / planner.dt))
    for k in range(len(fastest)):
        step = planner.step(q, v, target)
        moved, v = step.q.copy(), step.v.copy()
        if dead is not None:
            moved[dead], v[dead] = q[dead], 0.0
        q = moved
        fastest[k] = np.abs(v / planner.robot.limits.v_max).max()
    return fastest


def beside(robot, way):
    pose = robot.pose(robot.neutral).copy()
    pose[:3, 3] += way
    return pose


def test_torque_norm_lets_the_self_motion_of_an_arm_that_has_arrived_come_to_rest():
    robot = ftqp.robots.load("xarm7")
    task = ftqp.Task(rows="position")
    planner = ftqp.Planner(robot, DT, level="acceleration", scheme="dlsm", task=task)
    pose = beside(robot, (0.05, 0.25, 0.1))
    moving = speeds(planner, robot.neutral, pose, 6.0)
    assert moving[round(1.5 / DT) : round(2.0 / DT)].max() > 0.05, "this case is to have a self-motion"
    assert moving[round(5.0 / DT) :].max() < 1e-3


def test_an_unseen_lock_does_not_keep_an_arm_swinging_that_never_stops_of_its_own_accord():
    robot = ftqp.robots.load("xarm7")
    planner = ftqp.Planner(robot, 0.005, level="acceleration", emergency=None)
    moving = speeds(planner, robot.neutral, beside(robot, (0.05, -0.1, 0.05)), 12.0, dead=6)
    assert moving[round(10.0 / 0.005) :].max() < 0.01


def test_a_slow_arm_on_a_long_way_does_not_swing():
    robot = ftqp.robots.load("planar6")
    task = ftqp.Task(rows="position")
    planner = ftqp.Planner(robot, DT, level="velocity", task=task, emergency=None)
    moving = speeds(planner, robot.neutral, beside(robot, (-1.8, -1.9, 0.0)), 4.0)
    K = planner.session().K
    assert moving[round(3.0 / DT) :].max() > 0.5 and K.settling.stood > 3.5
    assert K.settling.gradient_suppressed == 0
