"""States where box and torque limits exclude each other: no scheme may fall back, none may be stopped."""

import numpy as np
import pytest

import ftqp

PANDA = ftqp.robots.load("panda")
SCHEMES = ("mvn", "mtn", "dlsm", "iiwt", "mke", "rmp")


def statuses_from_wild_states(planner, episodes, ticks):
    """The statuses of ticks from random moving states with one weakened motor and perhaps a second fault."""
    limits, n = PANDA.limits, PANDA.nv
    rng, found = np.random.default_rng(1), []
    for _ in range(episodes):
        q = rng.uniform(limits.q_min, limits.q_max)
        v = rng.uniform(-0.7, 0.7, n) * limits.v_max
        room = np.where(v > 0.0, limits.q_max - q, q - limits.q_min)
        v = np.sign(v) * np.minimum(np.abs(v), 0.9 * np.sqrt(0.1 * limits.a_max * room))
        weak, second = (int(j) for j in rng.choice(n, 2, replace=False))
        for joint in planner.faults:
            planner.withdraw(joint)
        planner.report(ftqp.Degraded(weak, torque=rng.uniform(0.1, 0.8)))
        if rng.random() < 0.3:
            planner.report(ftqp.Locked(second))
        elif rng.random() < 0.3 and weak != 0:
            planner.report(ftqp.FreeSwinging(0, damping=0.5))  # it swings and leaves the task alone
        planner.reset(q, v)
        near = np.clip(q + rng.uniform(-0.2, 0.2, n), limits.q_min, limits.q_max)
        target = ftqp.Target(pose=PANDA.pose(near))
        for _ in range(ticks):
            step = planner.step(q, v, target)
            found.append((step.status.name, step.torque_excess))
            q, v = step.q.copy(), step.v.copy()
    return found


@pytest.mark.parametrize("level", ["acceleration", pytest.param("velocity", marks=pytest.mark.slow)])
@pytest.mark.parametrize("mode", ["hard", "slack", "scaled", "lexicographic"])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_no_scheme_falls_back_where_a_motor_is_too_weak(scheme, mode, level):
    planner = ftqp.Planner(PANDA, 2e-3, level=level, scheme=scheme, emergency=None, task=ftqp.Task(mode=mode))
    found = statuses_from_wild_states(planner, 60, 8)
    assert {name for name, _ in found} <= {"OK", "RELAXED", "SCALED", "LAGGING"}
    assert any(excess > 0.1 for _, excess in found)  # the case is met at all


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
@pytest.mark.parametrize("backend", ["dtrnn", "daqp", "proxqp", "osqp"])
def test_no_backend_ends_without_the_task_where_a_motor_is_too_weak(backend, level):
    """A backend may fail, but what takes its place still follows the task, and never latches a stop."""
    planner = ftqp.Planner(PANDA, 2e-3, level=level, scheme="mtn", backend=backend, emergency=None)
    found = statuses_from_wild_states(planner, 6, 8)
    assert {name for name, _ in found} <= {"OK", "RELAXED", "LAGGING", "FALLBACK"}
    assert planner.session().K.watch.fallbacks == 0
