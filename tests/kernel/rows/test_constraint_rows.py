"""Rows of C on demand: the same commands as with the rows of every tick, whether or not a limit binds."""

import numpy as np
import pytest

import ftqp

DT, TICKS = 2e-3, 500
Q = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])
WEAK = np.array([4.0, 37.0, 9.0, 24.0, 3.0, 3.0, 2.0])
"""Motors [N m] that hold a Panda at Q, and reach their limits when its tip is drawn to and fro."""


def driven(planner, *, every_tick, events=None, ticks=TICKS):
    """Closed loop with the tip drawn to and fro: commands, statuses, and which ticks had rows."""
    robot, q, v = planner.robot, Q.copy(), np.zeros(7)
    planner.reset(q, v)
    K = planner._session.K
    pose = robot.pose(q)
    aim = ftqp.Target(pose=pose)
    commands, statuses, rows = [], [], []
    for k in range(ticks):
        if events and k in events:
            planner.report(events[k])
        if every_tick:
            K.limits.on_demand = 0
            K.limits.guard = 0.0
        away = np.array([0.0, 0.15, 0.15]) * np.sin(np.array([0.0, 5.0, 3.0]) * k * DT)
        aim.pose[:3, 3] = pose[:3, 3] + away * min(max((430 - k) / 100, 0.0), 1.0)
        step = planner.step(q, v, aim)
        commands.append(np.concatenate([step.q, step.v, step.a, step.tau, step.tau_brake]))
        statuses.append(step.status)
        rows.append(int(K.qp.nc) > 0)
        assert step.torque_excess == 0.0
        q, v = step.q.copy(), step.v.copy()
    return np.array(commands), statuses, np.array(rows)


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
@pytest.mark.parametrize(
    ("settings", "events"),
    [
        ({"task": ftqp.Task(rows="position")}, None),
        ({"task": ftqp.Task(rows="position")}, {60: ftqp.Locked(2), 200: ftqp.Degraded(4, torque=0.7)}),
        ({"task": ftqp.Task(rows="position", mode="scaled")}, None),
        ({"task": ftqp.Task(rows="position", calm=False), "scheme": "rmp"}, None),
    ],
)
def test_commands_are_those_with_rows_in_every_tick(level, settings, events):
    robot = ftqp.robots.load("panda").with_limits(tau_max=WEAK)

    def planner():
        return ftqp.Planner(robot, DT, level=level, emergency=None, posture=Q, **settings)

    own, said, rows = driven(planner(), every_tick=False, events=events)
    other, expected, always = driven(planner(), every_tick=True, events=events)
    assert always.all()
    binding = np.abs(other[:, 21:28]) > 0.999 * WEAK * np.where(
        np.arange(7) == 4, 0.7 if events else 1.0, 1.0
    )
    assert binding.any(axis=1).sum() > 10, "a torque limit binds now and then"
    assert 0.1 < rows.mean() < 0.9, "rows come and go"
    assert said == expected
    assert np.abs(own[:, :7] - other[:, :7]).max() < 1e-9
    assert np.abs(own[:, 21:] - other[:, 21:]).max() < 1e-4


@pytest.mark.parametrize("settings", [{"scheme": "mke"}, {"task": ftqp.Task(mode="lexicographic")}])
def test_what_needs_the_rows_has_them_in_every_tick(settings):
    planner = ftqp.Planner(ftqp.robots.load("panda"), DT, emergency=None, **settings)
    _, _, rows = driven(planner, every_tick=False, ticks=20)
    assert rows.all()


def test_external_solver_is_given_the_rows_in_every_tick():
    robot = ftqp.robots.load("panda").with_limits(tau_max=WEAK)
    task = ftqp.Task(rows="position")
    own, _, rows = driven(ftqp.Planner(robot, DT, emergency=None, task=task), every_tick=False, ticks=150)
    other, _, always = driven(
        ftqp.Planner(robot, DT, emergency=None, task=task, backend="daqp"), every_tick=False, ticks=150
    )
    assert always.all() and not rows.all()
    assert np.abs(own[:, :7] - other[:, :7]).max() < 1e-6
