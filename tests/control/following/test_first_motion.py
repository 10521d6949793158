"""The motion by which an arm is connected keeps its limits, is smooth, and moves one joint at a time."""

from dataclasses import replace

import numpy as np
import pytest

import ftqp
from ftqp.control.following.first_motion import REACH, SHARE, first_motion, steepest, wave

PANDA = ftqp.robots.load("panda")
WORKS = np.ones(7, dtype=bool)


def sampled(motion, dt=0.002):
    return tuple(
        np.array(part) for part in zip(*map(motion.at, np.arange(0.0, motion.duration, dt)), strict=True)
    )


def test_derivatives_are_those_of_the_wave_and_below_their_bounds():
    x = np.linspace(0.0, 1.0, 2001)
    for k in (1, 3, 8):
        s, v, a = np.array([wave(float(one), k, 2.0) for one in x]).T
        np.testing.assert_allclose(np.gradient(s, x[1] * 2.0)[2:-2], v[2:-2], atol=1e-3 * np.abs(v).max())
        np.testing.assert_allclose(np.gradient(v, x[1] * 2.0)[2:-2], a[2:-2], atol=1e-3 * np.abs(a).max())
        fast, strong = steepest(np.array(float(k)), 2.0)
        assert np.abs(v).max() <= fast and np.abs(a).max() <= strong
        assert abs(v[1]) < 1e-4 and abs(a[1]) < 0.1 * strong  # it begins smoothly


def test_joints_move_one_after_the_other_and_then_together_and_come_back():
    motion = first_motion(PANDA, PANDA.neutral, WORKS)
    assert motion.duration == pytest.approx(10.0, abs=0.5)
    q, v, a = sampled(motion)
    np.testing.assert_allclose(q[[0, -1]], [PANDA.neutral] * 2)
    moving = np.abs(v) > 1e-9
    alone = moving.sum(axis=1) == 1
    assert set(np.argmax(moving[alone], axis=1)) == set(range(7))
    assert (moving.sum(axis=1) == 7).any()
    limits = PANDA.limits
    assert (np.abs(v) <= SHARE * limits.v_max).all() and (np.abs(a) <= SHARE * limits.a_max).all()
    assert np.abs(q - PANDA.neutral).max() <= REACH[False]


def test_a_joint_at_the_end_of_its_range_moves_away_from_it():
    q = PANDA.neutral.copy()
    q[3] = PANDA.limits.q_max[3]
    places, _, _ = sampled(first_motion(PANDA, q, WORKS, 10.0))
    assert (places[:, 3] <= PANDA.limits.q_max[3] + 1e-12).all() and places[:, 3].min() < q[3] - 0.005


def test_a_joint_that_has_failed_stands_and_one_that_mimics_goes_along():
    works = WORKS.copy()
    works[2] = False
    motion = first_motion(PANDA, PANDA.neutral, works, 10.0)
    assert 2 not in motion.order
    q, _, _ = sampled(motion)
    assert np.ptp(q[:, 2]) == 0.0
    lead, ratio = motion.lead.copy(), motion.ratio.copy()
    lead[1], ratio[1] = 0, -0.5
    q, v, _ = sampled(replace(motion, lead=lead, ratio=ratio))
    np.testing.assert_allclose(v[:, 1], -0.5 * v[:, 0])


def test_too_short_a_time_and_an_arm_without_joints_that_move_are_refused():
    with pytest.raises(ftqp.InputError, match=r"seconds is 3, expected at least \d"):
        first_motion(PANDA, PANDA.neutral, WORKS, 3.0)
    with pytest.raises(ftqp.InputError, match="no joint of panda can move"):
        first_motion(PANDA, PANDA.neutral, ~WORKS, 10.0)
