"""Runs of any arm after failures: against a general integrator, in every seat, with any weights."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from studies import unit_arm

import ftqp
from ftqp.analysis.goals import goal_study
from ftqp.kernel.entry.law_study import LawStudy
from ftqp.kernel.layout.enums import Ending

LINK = np.array([1.1, 0.8, 1.1])
GOAL = np.array([1.2, 0.9])
W = np.array([[2.0, 0.3, 0.0], [0.3, 1.0, -0.2], [0.0, -0.2, 0.7]])
GOALS = {"inside": (1.2, 0.9), "out of reach": (4.0, 1.0), "near the base": (0.5, 0.1)}


def law(q, link, goal, M, locked, gain=1.0, v_max=np.inf):
    """v = I_S G kappa e, as in the theory, by numpy."""
    p = np.cumsum((link * np.exp(1j * np.cumsum(q)))[::-1])[::-1]
    J = np.array([-p.imag, p.real])
    e = goal - np.array([p[0].real, p[0].imag])
    size = np.linalg.norm(e)
    v = M @ J.T @ np.linalg.solve(J @ M @ J.T, min(gain, v_max / max(size, 1e-300)) * e)
    v[list(locked)] = 0.0
    return v


def end_of(q, T, *args):
    return solve_ivp(lambda t, q: law(q, *args), (0.0, T), q, rtol=1e-10, atol=1e-10, method="LSODA").y[:, -1]


def study_of(lengths, goal, M=None, rows="position"):
    arm = ftqp.robots.load("planar", lengths=lengths, continuous=True)
    return LawStudy(goal_study(arm, np.array(goal), rows).free, np.eye(len(lengths)) if M is None else M, 1.0)


@pytest.fixture(scope="module")
def study():
    return study_of(LINK, GOAL, np.linalg.inv(W))


@pytest.fixture(scope="module")
def panda():
    robot = ftqp.robots.load("panda")
    return robot, robot.pose(robot.neutral + 0.3 * np.array([1, -1, 0.5, 0.3, 0.2, 0.5, 1]))


def test_ends_are_those_of_a_general_integrator_in_real_time(study):
    rng = np.random.default_rng(4)
    starts = rng.uniform(-np.pi, np.pi, (24, 3))
    locked = rng.integers(0, 3, 24)
    endings, ends, _ = study.runs(starts, 1 << locked)
    checked = 0
    for q, i, ending, end in zip(starts, locked, endings, ends, strict=True):
        if ending > Ending.ERRONEOUS:
            continue
        late = end_of(q, 400.0, LINK, GOAL, np.linalg.inv(W), (i,))
        tip, found = (np.exp(1j * np.cumsum(x)) @ LINK for x in (late, end))
        assert abs(tip - found) < 1e-3, (q, i)
        assert (abs(found - complex(*GOAL)) < 1e-6) == (ending == Ending.CORRECT)
        checked += 1
    assert checked > 18


@pytest.mark.parametrize("goal", GOALS)
def test_an_ending_means_what_it_says(goal):
    rng = np.random.default_rng(6)
    starts, locked = rng.uniform(-np.pi, np.pi, (200, 3)), rng.integers(0, 3, 200)
    endings, ends, facts = study_of((1.0, 1.0, 1.0), GOALS[goal]).runs(starts, 1 << locked)
    expected = {
        "inside": {Ending.CORRECT, Ending.ERRONEOUS},
        "out of reach": {Ending.ERRONEOUS, Ending.SINGULAR},
        "near the base": {Ending.CORRECT, Ending.ERRONEOUS, Ending.NONE},
    }[goal]
    assert set(endings) - {Ending.UNRESOLVED} == expected and (endings == Ending.UNRESOLVED).mean() < 0.01
    for ending, q, start, i, fact in zip(endings, ends, starts, locked, facts, strict=True):
        others = np.arange(3) != i
        assert q[i] == start[i]
        miss = abs(np.exp(1j * np.cumsum(q)).sum() - complex(*GOALS[goal]))
        assert (miss < 1e-6) == (ending == Ending.CORRECT)
        if ending == Ending.ERRONEOUS:

            def rates(x):
                return law(x, np.ones(3), np.array(GOALS[goal]), np.eye(3), ())

            assert np.abs(rates(q)[others]).max() < 1e-6, "it rests"
            step = 1e-6 * np.eye(3)
            slopes = np.array([rates(q + d) - rates(q - d) for d in step]).T / 2e-6
            assert np.linalg.eigvals(slopes[np.ix_(others, others)]).real.max() < 1e-5, "and is not left"
        elif ending == Ending.SINGULAR:
            p = np.cumsum(np.exp(1j * np.cumsum(q))[::-1])[::-1]
            assert np.linalg.svd(np.array([-p.imag, p.real]), compute_uv=False)[1] < 1e-4
        elif ending == Ending.NONE:
            assert fact[0] > 60.0


def test_a_run_is_the_same_in_every_seat_and_company(study):
    rng = np.random.default_rng(5)
    starts, locked = rng.uniform(-np.pi, np.pi, (41, 3)), 1 << rng.integers(0, 3, 41)
    endings, ends, facts = study.runs(starts, locked)
    for k in (0, 7, 20, 40):
        one = study.runs(starts[k : k + 1], locked[k : k + 1])
        assert one[0][0] == endings[k] and np.array_equal(one[1][0], ends[k])
        assert np.array_equal(one[2][0], facts[k])
    order = rng.permutation(41)
    again = study.copy().runs(starts[order], locked[order])
    assert np.array_equal(again[0], endings[order]) and np.array_equal(again[1], ends[order])


def test_time_of_success_is_that_of_the_law_with_gain_and_speed_limit(study):
    start, M = np.array([0.4, -0.9, 1.3]), np.linalg.inv(W)
    options = {"success": 0.01, "gain": 2.0, "v_max": 0.4}
    _, _, facts = study.runs(start[None], np.array([2]), horizon=50.0, **options)
    run = study.follow(start, 2, horizon=50.0, **options)

    def near(t, q):
        return abs(np.exp(1j * np.cumsum(q)) @ LINK - complex(*GOAL)) - 0.01

    near.terminal = True
    args = (LINK, GOAL, M, (1,), 2.0, 0.4)
    expected = solve_ivp(lambda t, q: law(q, *args), (0, 50), start, rtol=1e-9, atol=1e-10, events=near)
    time = expected.t_events[0][0]
    assert facts[0, 1] == pytest.approx(time, rel=2e-3) and run.arrived == pytest.approx(time, rel=1e-5)
    assert run.ending == Ending.CORRECT
    early = study.follow(start, 2, horizon=0.99 * time, **options)
    assert early.ending == Ending.UNRESOLVED and early.t[-1] > 0.99 * time


def test_a_motion_that_is_followed_is_on_record_as_a_general_integrator_has_it(study):
    start, args = np.array([0.4, -0.9, 1.3]), (LINK, GOAL, np.linalg.inv(W), (1,))
    run, few = study.follow(start, 2), study.follow(start, 2, most=50)
    times = run.t[[100, len(run.t) // 2, -1]]
    way = solve_ivp(lambda t, q: law(q, *args), (0, run.t[-1]), start, rtol=1e-11, atol=1e-11, t_eval=times)
    assert np.abs(run.path[[100, len(run.t) // 2, -1]] - way.y.T).max() < 1e-6
    tips = np.exp(1j * np.cumsum(run.path, axis=1)) @ LINK
    assert run.errors == pytest.approx(np.abs(tips - complex(*GOAL)), abs=1e-12)
    assert run.way == pytest.approx(np.linalg.norm(np.diff(run.path, axis=0), axis=1).sum(), rel=1e-6)
    assert 25 <= len(few.t) <= 50 and np.isin(few.t, run.t).all() and np.array_equal(few.q, run.q)


def test_planar_and_spatial_kinematics_give_the_same_runs():
    """Three links in the plane, and the same arm turned out of it, which takes the way of any arm."""
    from dataclasses import replace

    flat = goal_study(unit_arm(3), GOAL, "position")
    chain = flat.robot.chain
    constants = {**chain.constants(), "rotation": chain.rotation.copy()}
    constants["rotation"][0] = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    limits = {"q_min": np.full(3, -np.inf), "q_max": np.full(3, np.inf), "wraps": np.ones(3, bool)}
    turned = type(flat.free)(constants, (1, 2), flat.robot.length, **limits)
    pose = np.eye(4)
    pose[1:3, 3] = GOAL
    turned.aim(pose)
    rng = np.random.default_rng(8)
    starts, locked = rng.uniform(-np.pi, np.pi, (60, 3)), 1 << rng.integers(0, 3, 60)
    M = np.linalg.inv(W)
    one = LawStudy(flat.free, M, 1.0).runs(starts, locked)
    other = LawStudy(replace(flat, free=turned).free, M, 1.0).runs(starts, locked)
    assert np.array_equal(one[0], other[0]) and len(set(one[0])) > 1
    assert np.abs(one[1] - other[1]).max() < 1e-6


END = (1.2, 0.9)
BEGIN = np.array([0.4, 0.9, 1.3])
WHOLE = ((-np.pi, np.pi),)


def line_study(goal):
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
    _, failed, nodes, within = line_study(END).lines(BEGIN[None], 20, [WHOLE] * 3, keep=True)
    assert not failed[0] and within.all() and np.abs(nodes[0] - led(BEGIN, END, 20)).max() < 1e-6
    tips = np.exp(1j * np.cumsum(nodes[0], axis=1)).sum(axis=1)
    assert np.abs(tips - np.linspace(tips[0], complex(*END), 21)).max() < 1e-9


def test_lines_of_an_arm_in_space_keep_the_rotation_of_the_goal():
    panda = ftqp.robots.load("panda")
    goal = panda.pose(panda.neutral)
    study = goal_study(panda, goal, "pose")
    begin = goal.copy()
    begin[:3, 3] += [0.1, -0.15, 0.05]
    q, left, _ = study.limited.solutions(panda.neutral[None], goals=begin[None])
    assert left[0] < 1e-9
    law = LawStudy(study.free, np.eye(7), 6.0 * panda.length / 7)
    _, failed, nodes, _ = law.lines(q, 10, [WHOLE] * 7, keep=True)
    assert not failed[0]
    for k, node in enumerate(nodes[0]):
        expected = begin.copy()
        expected[:3, 3] += k / 10.0 * (goal - begin)[:3, 3]
        assert np.abs(panda.pose(node) - expected).max() < 1e-8


def test_a_line_is_the_same_in_every_company():
    rng = np.random.default_rng(2)
    starts, law = rng.uniform(-np.pi, np.pi, (11, 3)), line_study(END)
    box = [((-1.0, 1.5),), WHOLE, ((-2.0, -0.5), (0.5, 2.0))]
    inside, _, nodes, _ = law.lines(starts, 7, box, keep=True)
    for k in (0, 5, 10):
        one = law.copy().lines(starts[k : k + 1], 7, box, keep=True)
        assert np.array_equal(one[0][0], inside[k]) and np.array_equal(one[2][0], nodes[k])


def test_a_line_is_inside_for_the_share_of_its_length():
    way = led(BEGIN, END, 60)
    ends, moves = way[[0, 20, 40, 60]], np.diff(way, axis=0)
    joint = int(np.flatnonzero((moves > 0.0).all(axis=0) | (moves < 0.0).all(axis=0))[0])

    def interval(first, last):
        low, high = sorted((ends[first][joint], ends[last][joint]))
        return low, high

    for intervals, share in (((interval(0, 1),), 1.0 / 3.0), ((interval(0, 1), interval(2, 3)), 2.0 / 3.0)):
        box = [intervals if i == joint else WHOLE for i in range(3)]
        inside, failed, nodes, _ = line_study(END).lines(BEGIN[None], 60, box)
        assert not failed[0] and len(nodes) == 0
        expected = [share if i in (joint, 3) else 1.0 for i in range(4)]
        assert inside[0] == pytest.approx(expected, abs=0.02)


def test_values_count_modulo_a_turn_where_they_are_said_to():
    way = led(BEGIN, END, 10)
    low, high = way.min(axis=0) - 0.1, way.max(axis=0) + 0.1
    shifted = [((a + 2.0 * np.pi, b + 2.0 * np.pi),) for a, b in zip(low, high, strict=True)]
    law = line_study(END)
    assert law.lines(BEGIN[None], 10, shifted)[0][0] == pytest.approx([1.0, 1.0, 1.0, 1.0])
    inside = law.lines(BEGIN[None], 10, shifted, circular=[True, False, True])[0][0]
    assert inside == pytest.approx([1.0, 0.0, 1.0, 0.0])
    empty = law.lines(BEGIN[None], 10, [(), WHOLE, WHOLE])[0][0]
    assert empty == pytest.approx([0.0, 1.0, 1.0, 0.0]), "no value is inside"


def test_a_line_through_a_singularity_is_said_to_have_failed():
    bent = np.arccos(0.75)
    _, failed, _, _ = line_study((3.5, 0.0)).lines(np.array([[bent, -bent, -bent], BEGIN]), 5, [WHOLE] * 3)
    assert failed.all()
    assert not line_study(END).lines(np.array([[bent, -bent, -bent], BEGIN]), 5, [WHOLE] * 3)[1].any()
