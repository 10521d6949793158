"""What a planner starts its next step from, as others may read it."""

import numpy as np

import ftqp

PANDA = ftqp.robots.load("panda")
DT = 1e-4


def test_motion_of_the_tip_has_the_derivatives_of_its_pose():
    rng = np.random.default_rng(2)
    view = ftqp.Planner(PANDA).view()
    q, v, a = PANDA.neutral, rng.uniform(-1, 1, 7), rng.uniform(-5, 5, 7)

    def at(t):
        return view.tip_at(type(view.command)(q + t * v + 0.5 * t * t * a, v + t * a, a))

    before, now, after = at(-DT), at(0.0), at(DT)
    speed = (after.pose[:3, 3] - before.pose[:3, 3]) / (2.0 * DT)
    assert np.abs(now.twist[:3] - speed).max() < 1e-6
    change = (after.twist - before.twist) / (2.0 * DT)
    assert np.abs(now.acceleration - change).max() < 1e-5
    assert np.abs(now.pose - PANDA.pose(q)).max() < 1e-12


def test_view_follows_the_planner_and_its_belief():
    planner = ftqp.Planner(PANDA)
    view = planner.view()
    assert not view.is_reset
    planner.reset(PANDA.neutral)
    before = view.belief
    assert view.is_reset and view.ticks == 0 and view.belief == before
    step = planner.step(PANDA.neutral, np.zeros(7), ftqp.Target(pose=PANDA.pose(PANDA.neutral + 0.01)))
    assert view.ticks == 1
    for got, expected in zip(view.command, (step.q, step.v, step.a), strict=True):
        np.testing.assert_array_equal(got, expected)
    planner.report(ftqp.Degraded(2, velocity=0.5))
    assert view.belief != before and view.limits.v[2] == 0.5 * PANDA.limits.v_max[2]
    planner.report(ftqp.Locked(1, mode="instant"))
    assert view.working.tolist() == [True, False, True, True, True, True, True]
