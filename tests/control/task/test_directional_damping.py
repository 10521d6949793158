"""Damping and a path that waits, where the greedy nearest motion swings."""

import numpy as np
import pytest

import ftqp
from ftqp.core.errors import InputError

IIWA = ftqp.robots.load("iiwa14")
START = np.array([0.0, 0.02, 0.0, -1.2, 0.0, 1.0, 0.0])
DT = 2e-3
LEVELS = ["acceleration", "velocity"]


def swing(level, damping=None, scaled=False, seconds=9.0, calm=False):
    """Share of ticks in which a joint accelerates at its limit, last speed, and the follower if there is one.

    An iiwa with its second joint locked near zero, on a line with its attitude kept, which it cannot follow.
    """
    task = ftqp.Task(mode="scaled" if scaled else "slack", damping=damping, calm=calm, degrade=())
    planner = ftqp.Planner(IIWA, DT, level=level, task=task, emergency=None)
    planner.report(ftqp.Locked(1, mode="instant"))
    path = ftqp.paths.Line(IIWA.pose(START), (0.0, 0.25, 0.1), duration=4.0)
    targets = path.sample(np.arange(round(seconds / DT)) * DT)
    packed = ftqp.Targets(targets.pose, targets.twist, targets.acceleration)
    follower = ftqp.PathFollower(planner, path) if scaled else None
    (planner if follower is None else follower).reset(START)
    q, v, saturated = START.copy(), np.zeros(7), 0
    for k in range(len(packed)):
        step = planner.step(q, v, packed.at(k)) if follower is None else follower.step(q, v)
        saturated += (np.abs(step.a) / IIWA.limits.a_max).max() > 0.99
        q, v = step.q.copy(), step.v.copy()
    return saturated / len(packed), np.abs(v).max(), step, follower


@pytest.mark.parametrize("level", LEVELS)
def test_greedy_motion_swings_and_damping_calms_it(level):
    greedy, _, undamped, _ = swing(level)
    damped, speed, step, _ = swing(level, ftqp.DirectionalDamping())
    assert greedy > 0.5
    assert damped < 0.01 and speed < 0.01
    assert step.position_error < undamped.position_error + 0.01


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("calm", [True, False])
def test_path_that_waits_does_not_leave_the_line_and_comes_to_rest(level, calm):
    saturated, speed, step, follower = swing(level, scaled=True, calm=calm)
    assert saturated < 0.05 and speed < 1e-3
    assert step.position_error < 2e-3
    assert follower.status is ftqp.PathStatus.BLOCKED and "iiwa_joint_2 (locked)" in follower.blocked


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [({"threshold": 0.0}, "threshold of the damping"), ({"factor": -1.0}, "factor of the damping")],
)
def test_wrong_setting_is_one_sentence(settings, sentence):
    with pytest.raises(InputError, match=sentence):
        ftqp.DirectionalDamping(**settings)


def test_damping_does_not_go_with_a_scaled_task():
    with pytest.raises(InputError, match="damping 'directional' does not go with mode 'scaled'"):
        ftqp.Task(mode="scaled", damping=ftqp.DirectionalDamping())
    with pytest.raises(InputError, match=r"expected an ftqp\.DirectionalDamping"):
        ftqp.Task(damping=0.1)
