"""Straight lines of a healthy arm, and the share of them that is inside given values of the joints."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from studies import unit_arm

import ftqp
from ftqp.analysis.goals import goal_study
from ftqp.kernel.entry.law_study import LawStudy

GOAL = (1.2, 0.9)
START = np.array([0.4, 0.9, 1.3])
WHOLE = ((-np.pi, np.pi),)


def study_of(goal):
    return LawStudy(goal_study(unit_arm(), np.array(goal), "position").free, np.eye(3), 1.0)


def led(q, goal, parts):
    """Least-norm rates along the straight line to the goal, by numpy and scipy; nodes."""
    tip = np.exp(1j * np.cumsum(q)).sum()
    way = np.array([goal[0] - tip.real, goal[1] - tip.imag])

    def rates(s, q):
        p = np.cumsum(np.exp(1j * np.cumsum(q))[::-1])[::-1]
        return np.linalg.pinv(np.array([-p.imag, p.real])) @ way

    times = np.linspace(0.0, 1.0, parts + 1)
    return solve_ivp(rates, (0.0, 1.0), q, t_eval=times, rtol=1e-11, atol=1e-11).y.T


def test_nodes_are_those_of_least_norm_rates_and_on_the_line():
    _, failed, nodes, within = study_of(GOAL).lines(START[None], 20, [[WHOLE] * 3], keep=True)
    assert not failed[0] and within.all() and np.abs(nodes[0] - led(START, GOAL, 20)).max() < 1e-6
    tips = np.exp(1j * np.cumsum(nodes[0], axis=1)).sum(axis=1)
    assert np.abs(tips - np.linspace(tips[0], complex(*GOAL), 21)).max() < 1e-9


def test_lines_of_an_arm_in_space_keep_the_rotation_of_the_goal():
    panda = ftqp.robots.load("panda")
    goal = panda.pose(panda.neutral)
    study = goal_study(panda, goal, "pose")
    begin = goal.copy()
    begin[:3, 3] += [0.1, -0.15, 0.05]
    q, left, _ = study.limited.solutions(panda.neutral[None], goals=begin[None])
    assert left[0] < 1e-9
    law = LawStudy(study.free, np.eye(7), 6.0 * panda.length / 7)
    _, failed, nodes, _ = law.lines(q, 10, [[WHOLE] * 7], keep=True)
    assert not failed[0]
    for k, node in enumerate(nodes[0]):
        expected = begin.copy()
        expected[:3, 3] += k / 10.0 * (goal - begin)[:3, 3]
        assert np.abs(panda.pose(node) - expected).max() < 1e-8


def test_a_line_is_the_same_in_every_company():
    rng = np.random.default_rng(2)
    starts, law = rng.uniform(-np.pi, np.pi, (11, 3)), study_of(GOAL)
    boxes = [[((-1.0, 1.5),), WHOLE, ((-2.0, -0.5), (0.5, 2.0))]]
    inside, _, nodes, _ = law.lines(starts, 7, boxes, keep=True)
    for k in (0, 5, 10):
        one = law.copy().lines(starts[k : k + 1], 7, boxes, keep=True)
        assert np.array_equal(one[0][0], inside[k]) and np.array_equal(one[2][0], nodes[k])


@pytest.mark.parametrize("by_joints", [False, True])
def test_a_line_is_inside_for_the_share_of_its_length_and_any_of_two_boxes_will_do(by_joints):
    way = led(START, GOAL, 60)
    ends, moves = way[[0, 20, 40, 60]], np.diff(way, axis=0)
    joint = int(np.flatnonzero((moves > 0.0).all(axis=0) | (moves < 0.0).all(axis=0))[0])

    def box(first, last):
        low, high = sorted((ends[first][joint], ends[last][joint]))
        return [((low, high),) if i == joint else WHOLE for i in range(3)]

    lengths = np.linalg.norm(moves, axis=1) if by_joints else np.ones(60)
    shares = lengths.reshape(3, 20).sum(axis=1) / lengths.sum()
    for boxes, share in (([box(0, 1)], shares[0]), ([box(0, 1), box(2, 3)], shares[0] + shares[2])):
        inside, failed, nodes, _ = study_of(GOAL).lines(START[None], 60, boxes, by_joints=by_joints)
        assert not failed[0] and len(nodes) == 0
        expected = [share if i in (joint, 3) else 1.0 for i in range(4)]
        assert inside[0] == pytest.approx(expected, abs=0.02)


def test_crossings_between_nodes_are_linear():
    way = led(START, GOAL, 4)[:, 0]
    low, high = np.sort(way)[[1, 3]] + np.array([0.3, -0.2]) * np.abs(np.diff(way)).min()
    margins = np.minimum(way - low, high - way)
    shares = []
    for before, now in pairwise(margins):
        crossing = before / (before - now)
        shares.append(
            crossing if before >= 0.0 > now else 1.0 - crossing if now >= 0.0 > before else before > 0
        )
    inside = study_of(GOAL).lines(START[None], 4, [[((low, high),), WHOLE, WHOLE]])[0][0]
    assert 0.0 < np.mean(shares) < 1.0 and inside[0] == pytest.approx(np.mean(shares), abs=1e-5)


def test_values_count_modulo_a_turn_where_they_are_said_to():
    way = led(START, GOAL, 10)
    low, high = way.min(axis=0) - 0.1, way.max(axis=0) + 0.1
    shifted = [[((a + 2.0 * np.pi, b + 2.0 * np.pi),) for a, b in zip(low, high, strict=True)]]
    law = study_of(GOAL)
    assert law.lines(START[None], 10, shifted)[0][0] == pytest.approx([1.0, 1.0, 1.0, 1.0])
    inside = law.lines(START[None], 10, shifted, circular=[True, False, True])[0][0]
    assert inside == pytest.approx([1.0, 0.0, 1.0, 0.0])
    empty = law.lines(START[None], 10, [[(), WHOLE, WHOLE]])[0][0]
    assert empty == pytest.approx([0.0, 1.0, 1.0, 0.0]), "no value is inside"


def test_a_line_through_a_singularity_is_said_to_have_failed():
    bent = np.arccos(0.75)
    _, failed, _, _ = study_of((3.5, 0.0)).lines(np.array([[bent, -bent, -bent], START]), 5, [[WHOLE] * 3])
    assert failed.all()
    assert not study_of(GOAL).lines(np.array([[bent, -bent, -bent], START]), 5, [[WHOLE] * 3])[1].any()
