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


def closed_loop(led, target, ticks, q=None, v=None, events=None, reset=True, **given):
    """The last command of a planner, or of what leads one, is the next state of its arm; yields each step.

    ``target`` may be a function of the tick, and is None where a path leads; events are called with the
    planner before the step of their tick.
    """
    planner = getattr(led, "planner", led)
    q = planner.robot.neutral if q is None else np.array(q, dtype=float)
    v = np.zeros(planner.robot.nv) if v is None else np.array(v, dtype=float)
    if reset:
        led.reset(q, v)
    for k in range(ticks):
        if events and k in events:
            events[k](planner)
        if target is not None:
            given["target"] = target(k) if callable(target) else target
        step = led.step(q, v, **given)
        yield step
        q, v = step.q.copy(), step.v.copy()


def targets_along(path, ticks, dt):
    """The targets of so many ticks on a path."""
    sample = path.sample(dt * np.arange(ticks))
    return ftqp.Targets(sample.pose, sample.twist, sample.acceleration)


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
