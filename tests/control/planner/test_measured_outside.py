"""OK is a claim about the arm: a joint that is measured beyond its range is named, wherever it was sent."""

import numpy as np
import pytest

import ftqp

DT, JOINT, NOISE = 1e-3, 1, 1e-4


def seen_beyond(amount, sigma=0.0, *, seed=None):
    """The steps of an arm whose joint stands at its upper limit and is measured beyond it by ``amount``."""
    panda = ftqp.robots.load("panda")
    planner = ftqp.Planner(panda, DT, noise=ftqp.Noise(q=sigma))
    q = panda.neutral.copy()
    q[JOINT] = panda.limits.q_max[JOINT]
    planner.reset(q)
    target, random = ftqp.Target(pose=panda.pose(q)), np.random.default_rng(seed)
    place, steps = q, []
    for _ in range(100):
        measured = place.copy()
        measured[JOINT] += amount
        if seed is not None:
            measured += sigma * random.standard_normal(7)
        steps.append(planner.step(measured, np.zeros(7), target).copy())
        place = steps[-1].q
    return steps


@pytest.mark.parametrize("amount", [1e-5, 1e-4, 1e-3])
def test_a_joint_measured_beyond_its_range_is_named_and_nothing_is_ok(amount):
    for step in seen_beyond(amount):
        assert step.outside == ("panda_joint2",)
        assert step.status is not ftqp.StepStatus.OK
        if step.certificate is not None:
            (found,) = step.certificate.outside
            assert found.limit == "upper position" and found.amount > 0.5 * amount


def test_noise_that_the_planner_knows_puts_no_joint_outside():
    assert not any(step.outside for step in seen_beyond(0.0, NOISE, seed=1))
    assert all(step.outside for step in seen_beyond(12.0 * NOISE, NOISE, seed=1)[:20])
