"""The network in the loop: the active set's motion; a warm start in the record that dies with a fault."""

import numpy as np
import pytest

import ftqp

DT = 1e-3


def follow(planner, path, ticks, fault=None, at=None, q=None):
    """Closed loop over ``ticks``: configurations, statuses, iterations."""
    q = planner.robot.neutral.copy() if q is None else np.array(q)
    v = np.zeros(planner.robot.nv)
    planner.reset(q)
    samples = path.sample(np.arange(ticks) * planner.dt)
    target = ftqp.Target(pose=path.start)
    rows, status, iterations = [], [], []
    for k in range(ticks):
        if k == at:
            planner.report(fault)
        target.pose[:], target.twist[:] = samples.pose[k], samples.twist[k]
        target.acceleration[:] = samples.acceleration[k]
        step = planner.step(q, v, target)
        q, v = step.q.copy(), step.v.copy()
        rows.append(q)
        status.append(step.status)
        iterations.append(step.qp.iterations)
    return np.array(rows), status, np.array(iterations)


def test_a_lost_joint_on_a_circle_makes_the_motion_of_the_active_set(panda, home, level):
    path = ftqp.paths.Circle(home, 0.1, duration=2.0, axes=("x", "y"))
    fault = ftqp.Locked("panda_joint3")
    task = ftqp.Task(degrade=())  # only the active set can give up rows
    runs = [follow(ftqp.Planner(panda, DT, level=level, backend=name, task=task), path, 2000, fault, 1000)
            for name in ("active_set", "dtrnn")]  # fmt: skip
    assert runs[0][1] == runs[1][1]
    assert np.abs(runs[0][0] - runs[1][0]).max() <= 1e-6
    assert np.median(runs[1][2]) <= 1


@pytest.mark.parametrize("mode", ["slack", "hard", "scaled", "lexicographic"])
def test_a_task_out_of_reach_ends_in_the_same_status_in_every_mode(panda, home, mode):
    path = ftqp.paths.Circle(home, 0.1, duration=2.0, axes=("x", "y"))
    fault = ftqp.Locked("panda_joint4")
    settings = dict(emergency=None, task=ftqp.Task(mode=mode))
    runs = [
        follow(ftqp.Planner(panda, DT, backend=name, **settings), path, 1200, fault, 1000)
        for name in ("active_set", "dtrnn")
    ]
    assert ftqp.StepStatus.RELAXED in runs[0][1]
    assert runs[0][1] == runs[1][1]
    assert np.abs(runs[0][0] - runs[1][0]).max() <= 1e-5
