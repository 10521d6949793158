"""An arm on its way to a goal, step by step, for the tests of ``ftqp.GoTo``."""

import numpy as np

import ftqp

PANDA = ftqp.robots.load("panda")
DT = 4e-3


def started(robot, *args, at=None, **settings):
    """A planner whose arm rests at its neutral posture, or at another."""
    planner = ftqp.Planner(robot, *args, **settings)
    planner.reset(robot.neutral if at is None else at)
    return planner


def planner_at(q, level="acceleration", robot=PANDA, v=None, **settings):
    planner = ftqp.Planner(robot, DT, level=level, **settings)
    planner.reset(q, v)
    return planner


def go(goto, q, v=None, longest=12.0, each=lambda k: None, given=lambda k, q, v: (q, v)):
    """Steps copied until the arm is done; every one keeps the limits of speed and acceleration."""
    robot = goto.planner.robot
    v = np.zeros(robot.nv) if v is None else v.copy()
    steps = []
    for k in range(round(longest / DT)):
        each(k)
        step = goto.step(*given(k, q, v)).copy()
        healthy = [joint not in goto.planner.faults for joint in robot.joints]
        assert (np.abs(step.v) <= robot.limits.v_max * (1.0 + 1e-9)).all()
        assert (np.abs(step.v - v)[healthy] <= DT * robot.limits.a_max[healthy] * (1.0 + 1e-6)).all()
        q, v = step.q.copy(), step.v.copy()
        steps.append(step)
        if goto.done:
            break
    return steps


def within_limits(steps, robot=PANDA):
    q = np.array([step.q for step in steps])
    return (q >= robot.limits.q_min - 1e-9).all() and (q <= robot.limits.q_max + 1e-9).all()


def follow(leader, q, longest=20.0, each=lambda k: None, blocked=1.0):
    """Joints at every tick and the statuses in their order, until done or blocked for so long [s]."""
    robot, dt = leader.planner.robot, leader.planner.dt
    q, v, rows, seen, waits = q.copy(), np.zeros(robot.nv), [], [], 0
    for k in range(round(longest / dt)):
        each(k)
        step = leader.step(q, v)
        healthy = [joint not in leader.planner.faults for joint in robot.joints]
        assert (np.abs(step.v) <= robot.limits.v_max * (1.0 + 1e-9)).all()
        assert (np.abs(step.v - v)[healthy] <= dt * robot.limits.a_max[healthy] * (1.0 + 1e-6)).all()
        q, v = step.q.copy(), step.v.copy()
        rows.append(q)
        if not seen or seen[-1] is not leader.status:
            seen.append(leader.status)
        waits = waits + 1 if leader.status is ftqp.PathStatus.BLOCKED else 0
        if leader.status is ftqp.PathStatus.DONE or waits > blocked / dt:
            break
    return np.array(rows), seen
