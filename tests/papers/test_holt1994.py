"""Holt and Desrochers 1994: the figures of docs/evidence/holt1994.md, computed by ftqp's own planner.

They were found first by an independent program. The block inverse has a file of its own.
"""

import numpy as np
import pytest
from tests.papers.holt1994 import (
    BENT,
    DEG,
    FAST,
    SINGULAR_ELBOW,
    START,
    START7,
    arm7,
    overshoot,
    planner,
    pulled_away,
    puma,
    run,
    step_motion,
    sway,
)

import ftqp
from ftqp import BaseStatus, InertialTask, MovingBase, Observer
from ftqp.control.moving_base.base_gain import decay
from ftqp.sim.plants.plant import Arm

BLOCK_INVERSE = "approximate_pseudoinverse"
NOMINAL = MovingBase(attitude="nominal")
IDEAL = 0.02
"""Sampling period of the ideal loop [s]."""


def ideal(base=None, gain=1.0, scheme=None, slack=None):
    return InertialTask(planner(puma(**FAST), IDEAL, scheme=scheme, slack=slack), base, gain=gain)


def distances(result):
    """Error at the samples after the step [cm]."""
    return 100.0 * np.linalg.norm(result.e[1:, :3], axis=1)


@pytest.mark.parametrize("scheme", [None, BLOCK_INVERSE])
@pytest.mark.parametrize(
    ("angle", "expected"),
    [(10, [15.841, 0.963, 0.170, 0.030]), (30, [47.042, 7.32, 3.47, 1.94, 1.04, 0.52])],
)
def test_nominal_attitude_gives_the_error_sequence_of_a_step(angle, expected, scheme):
    result = run(ideal(NOMINAL, scheme=scheme), step_motion(angle * DEG, IDEAL, 9), START)
    rounding = [0.5 * 10.0 ** -(3 if angle == 10 or k == 0 else 2) for k in range(len(expected))]
    assert np.all(
        np.abs(distances(result)[: len(expected)] - expected) <= np.add(1e-3 * np.array(expected), rounding)
    )
    assert np.linalg.norm(result.e[1, 3:]) == pytest.approx(angle * DEG, rel=1e-9)


def test_estimated_attitude_converges_quadratically():
    result = run(ideal(), step_motion(30 * DEG, IDEAL, 9), START)
    expected = [47.0, 16.1, 1.99, 0.036, 2e-5]
    assert distances(result)[:5] == pytest.approx(expected, rel=0.02, abs=1e-5)


def test_estimated_attitude_is_stable_at_60_degrees_where_the_nominal_one_is_not():
    motion = step_motion(60 * DEG, IDEAL, 40)
    settled = run(ideal(scheme=BLOCK_INVERSE), motion, START)
    lost = run(ideal(NOMINAL, scheme=BLOCK_INVERSE), motion, START)
    assert distances(settled)[6] < 1.0 and distances(settled)[-1] < 1e-8
    assert np.linalg.norm(lost.e[-10:, 3:], axis=1).min() > 0.1
    limited = run(InertialTask(planner(puma(), IDEAL)), step_motion(60 * DEG, IDEAL, 200), START)
    assert distances(limited)[-1] < 1e-8


def measured_decay(angle, gain, base=NOMINAL):
    """Decay of a small error a sample while the base stands turned by ``angle`` [deg]."""
    motion = step_motion(angle * DEG, IDEAL, 40)
    motion.pose[0] = motion.pose[1]
    goal = motion.pose[0] @ Arm(puma()).tip(START)
    goal[:3, 3] += [1e-4, 2e-4, -1e-4]
    size = np.linalg.norm(run(ideal(base, gain, slack=1e-9), motion, START, target=goal).e[:, :3], axis=1)
    last = int(np.flatnonzero(size > 1e-9)[-1])
    return (size[last] / size[1]) ** (1.0 / (last - 1))


@pytest.mark.parametrize("angle", [10, 30, 45, 60])
def test_decay_is_that_of_the_corrected_theory(angle):
    alpha = angle * DEG
    for gain in (1.0, ftqp.best_gain(alpha)):
        assert measured_decay(angle, gain) == pytest.approx(abs(1.0 - gain * np.exp(1j * alpha)), rel=0.01)
        assert decay(gain, alpha) == pytest.approx(abs(1.0 - gain * np.exp(1j * alpha)))
    assert decay(ftqp.best_gain(alpha), alpha) == pytest.approx(np.sin(alpha))
    assert decay(1.0, alpha) == pytest.approx(2.0 * np.sin(0.5 * alpha))


@pytest.mark.parametrize("angle", [10, 30, 45, 60])
def test_gain_limit_is_where_the_loop_begins_to_diverge(angle):
    limit = ftqp.gain_limit(angle * DEG)
    assert measured_decay(angle, 0.998 * limit) < 1.0 < measured_decay(angle, 1.003 * limit)


def step_response(angle, base, *, gain=1.0, scheme=None, bounded=True):
    """Overshoot [cm, cm, cm, deg] and settling times [s] of X, Y, Z and the rotation about its first axis."""
    dt = 0.1
    robot = puma() if bounded else puma(**FAST)
    follower = InertialTask(planner(robot, dt, scheme=scheme), base, gain=gain)
    e = run(follower, step_motion(angle * DEG, dt, 80, rate=80 * DEG), START, servo=puma()).e
    first = e[np.flatnonzero(np.linalg.norm(e[:, 3:], axis=1) > 1e-6)[0], 3:]
    curves = [100.0 * e[:, k] for k in range(3)] + [e[:, 3:] @ first / np.linalg.norm(first) / DEG]
    return np.array([overshoot(curve, dt) for curve in curves]).T


def test_bounded_qp_has_the_overshoot_of_the_docs_on_the_30_degree_step():
    over, settled = step_response(30, MovingBase())
    assert over == pytest.approx([0.48, 4.32, 0.16, 3.0], abs=0.06)
    assert settled == pytest.approx([1.1, 1.2, 1.6, 1.3], abs=0.051)


def test_anti_windup_takes_two_thirds_of_the_overshoot_away():
    over, settled = step_response(30, MovingBase(anti_windup=True))
    assert over[1] == pytest.approx(1.32, abs=0.05)
    assert over == pytest.approx([0.63, 1.32, 0.24, 1.2], abs=0.06)
    assert settled == pytest.approx([1.2, 1.0, 1.8, 1.6], abs=0.15)


def test_overshoot_of_the_published_law_grows_more_than_in_proportion():
    small, _ = step_response(10, NOMINAL, scheme=BLOCK_INVERSE, bounded=False)
    large, _ = step_response(30, NOMINAL, scheme=BLOCK_INVERSE, bounded=False)
    assert large[1] > 4.0 * small[1] and large[3] > 4.0 * small[3]
    bounded, _ = step_response(30, MovingBase())
    assert large[1] > 3.0 * bounded[1] and large[3] > 3.0 * bounded[3]


def stretched(*, robot=None, bounds=None, branch=None, scheme=None):
    """(run, elbow angle from its singular one [deg], error at the hold [cm])."""
    plan = planner(puma() if robot is None else robot, IDEAL, bounds=bounds, branch=branch, scheme=scheme)
    result = run(InertialTask(plan, NOMINAL), pulled_away(), BENT)
    elbow = (result.q[:, 2] - SINGULAR_ELBOW) / DEG
    return result, elbow, 100.0 * np.linalg.norm(result.e[195, :3])


def sign_changes(elbow):
    return int(np.count_nonzero(np.diff(np.sign(elbow))))


BRANCH = {"j3": (SINGULAR_ELBOW + 5 * DEG, np.inf)}


@pytest.mark.parametrize(
    ("robot", "bounds"), [(None, None), (None, "viability"), ({"a_max": 500 * DEG}, "viability")]
)
def test_branch_limit_keeps_the_elbow_on_its_side(robot, bounds):
    result, elbow, hold = stretched(
        robot=None if robot is None else puma(**robot), bounds=bounds, branch=BRANCH
    )
    assert sign_changes(elbow) == 0 and elbow.min() >= 5.0 - 1e-9
    assert hold == pytest.approx(5.68, abs=0.01) and hold <= 5.8
    assert np.linalg.norm(result.e[-1, :3]) < 1e-5
    assert np.abs(result.v).max() <= 90 * DEG * (1.0 + 1e-12)
    assert BaseStatus.UNREACHABLE in result.status[110:200] and result.status[-1] is BaseStatus.TRACKING


def test_rate_limits_alone_do_not_stop_the_chatter():
    _, elbow, hold = stretched()
    assert sign_changes(elbow) > 100 and hold == pytest.approx(5.62, abs=0.01)


def test_block_inverse_never_crosses_the_singularity_but_gives_way_more():
    result, elbow, hold = stretched(robot=puma(**FAST), scheme=BLOCK_INVERSE)
    assert sign_changes(elbow) == 0 and elbow.min() == pytest.approx(28.1, abs=0.1)
    assert hold == pytest.approx(9.6, abs=0.05)
    assert np.abs(np.diff(result.q, axis=0)).max() / DEG == pytest.approx(5.0, abs=0.05)
    assert np.linalg.norm(result.e[-1, :3]) < 1e-5


DT7, SETTLED = 0.01, 50


@pytest.fixture(scope="module")
def swaying():
    return sway(DT7)


def held(motion, locked=(), *, priority="weighted", base=None, gain=1.0, **options):
    follower = InertialTask(planner(arm7(), DT7, priority=priority), base, gain=gain)
    return run(follower, motion, START7, locked=[joint - 1 for joint in locked], **options)


def within_limits(result):
    limits = arm7().limits
    assert np.all(np.abs(result.v) <= limits.v_max * (1.0 + 1e-12))
    assert np.all(result.q <= limits.q_max + 1e-12) and np.all(result.q >= limits.q_min - 1e-12)


def test_late_and_wrong_feed_forward_cost_what_an_independent_program_says(swaying):
    late = np.vstack([np.repeat(swaying.twist[:1], 2, axis=0), swaying.twist[:-2]])
    base = MovingBase(sensing="known")
    found = held(swaying, base=base, twist=late)
    assert 1e3 * found.rms(SETTLED)[0] == pytest.approx(0.035, rel=0.01)
    assert 1e3 * found.peak(SETTLED) == pytest.approx(0.055, rel=0.01)
    found = held(swaying, base=base, twist=0.9 * swaying.twist)
    assert 1e3 * found.rms(SETTLED)[0] == pytest.approx(0.131, rel=0.01)
    assert 1e3 * found.peak(SETTLED) == pytest.approx(0.208, rel=0.01)
    told = held(swaying, base=MovingBase(sensing="late", delay=0.02), twist=late, late=2)
    assert 1e3 * told.rms(SETTLED)[0] < 0.01


@pytest.mark.parametrize("locked", [(), (3,), (5,)])
def test_tolerable_lock_costs_nothing(swaying, locked):
    feedback = held(swaying, locked)
    assert 1e3 * feedback.rms(SETTLED)[0] == pytest.approx(1.306, rel=0.01)
    assert 1e3 * feedback.peak(SETTLED) == pytest.approx(2.088, rel=0.01)
    assert feedback.rms(SETTLED)[1] / DEG == pytest.approx(0.0834, rel=0.01)
    observed = held(swaying, locked, base=MovingBase(observer=Observer()))
    assert 1e3 * observed.rms(SETTLED)[0] == pytest.approx(0.0175, rel=0.01)
    assert 1e3 * observed.peak(SETTLED) == pytest.approx(0.0272, rel=0.01)
    known = held(swaying, locked, base=MovingBase(sensing="known"), twist=swaying.twist)
    assert 1e3 * known.peak(SETTLED) < 0.01
    for result in (feedback, observed, known):
        within_limits(result)
        assert set(result.status) == {BaseStatus.TRACKING}
        for joint in locked:
            assert np.all(result.q[:, joint - 1] == START7[joint - 1])


def test_locked_elbow_is_reported_as_rank_deficient(swaying):
    found = held(swaying, (4,))
    assert set(found.status) == {BaseStatus.RANK_DEFICIENT}
    assert 1e3 * found.rms(SETTLED)[0] == pytest.approx(49.0, rel=0.01)
    assert 1e3 * found.peak(SETTLED) == pytest.approx(110.0, rel=0.01)
    assert found.rms(SETTLED)[1] / DEG == pytest.approx(6.95, rel=0.01)
    assert np.all(found.q[:, 3] == START7[3])
    within_limits(found)


@pytest.mark.parametrize(
    ("locked", "first", "weighted"),
    [((3, 5), (0.017, 0.027, 2.64), (4.5, 8.1)), ((1, 3), (0.014, 0.024, 18.3), (45.0, 96.0))],
)
def test_position_first_holds_the_point_where_the_pose_cannot_be_held(swaying, locked, first, weighted):
    base = MovingBase(observer=Observer())
    point = held(swaying, locked, priority="position_first", base=base)
    pose = held(swaying, locked, base=base)
    assert 1e3 * point.peak(SETTLED) < 0.05
    assert 1e3 * point.rms(SETTLED)[0] == pytest.approx(first[0], abs=0.001)
    assert 1e3 * point.peak(SETTLED) == pytest.approx(first[1], abs=0.002)
    assert point.rms(SETTLED)[1] / DEG == pytest.approx(first[2], rel=0.01)
    assert 1e3 * pose.rms(SETTLED)[0] == pytest.approx(weighted[0], rel=0.05)
    assert 1e3 * pose.peak(SETTLED) == pytest.approx(weighted[1], rel=0.05)


@pytest.mark.parametrize("joint", [3, 5])
def test_lock_on_the_way_leaves_no_transient(swaying, joint):
    found = held(swaying, (joint,), at=800)
    assert 1e3 * found.peak(SETTLED) == pytest.approx(2.088, rel=0.01)
    assert np.all(found.q[800:, joint - 1] == found.q[800, joint - 1])
