"""When an arm is to hold, how late its target may be played, and what a row of a block says of a tick."""

from math import inf

import numpy as np
import pytest
from records import believe, chain_record, empty_record

import ftqp
from ftqp.kernel.arm.dynamics import dynamics
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.calm import rest
from ftqp.kernel.feedback import late_targets, tip_correction
from ftqp.kernel.layout.enums import (
    ACCELERATION,
    FAILED,
    FALLBACK,
    HARD,
    INFEASIBLE,
    OK,
    RELAXED,
    SLACK,
    SOLVED,
    STOPPED_BY_LAG,
    TARGET_ACCELERATION,
    TARGET_HAS_ROTATION,
    TARGET_TWIST,
    VELOCITY,
)
from ftqp.kernel.ticks import block_of_ticks

N, DT = 3, 0.01


def standing(*, stood=0.0, v=0.0, near=True, rho=1.0):
    """An arm whose target has stood for a while."""
    K = empty_record()
    K.chain.n, K.state.dt, K.state.ticks = N, DT, 5
    believe(K)
    K.limits.v_max[:N] = [1.0, inf, 1.0]
    K.state.v[:N] = [0.0, v, 0.0]
    K.calm.stood, K.calm.rho = stood, rho
    K.feedback.tolerance, K.feedback.rotation_tolerance = 1e-3, 1e-2
    K.task.position_error = 0.4e-3 if near else 0.6e-3
    return K


@pytest.mark.parametrize(
    ("stood", "v", "rho", "square", "near", "holds"),
    [
        (0.45, 0.1, 0.01, 1e-4, False, True),  # hardly anything is worth removing, and all are slow
        (0.45, 0.3, 0.01, 1e-4, False, False),  # one is fast
        (1.45, 0.3, 0.01, 1e-4, False, True),  # for too long
        (0.35, 0.1, 0.01, 1e-4, False, False),  # not long enough
        (0.45, 0.1, 0.03, 1e-4, False, False),  # something is
        (0.45, 0.1, 0.01, 0.9e-6, False, False),  # within a millimetre
        (1.45, 0.3, 1.0, 0.9e-6, True, True),  # near the target, and one is fast for too long
        (1.45, 0.1, 1.0, 0.9e-6, True, False),
        (1.45, 0.3, 1.0, 0.9e-6, False, False),
    ],
)
def test_an_arm_holds_once_it_has_been_clear_for_a_while_that_nothing_is_gained(
    stood, v, rho, square, near, holds
):
    K = standing(stood=stood, v=v, near=near, rho=rho)
    for _ in range(9):
        rest.decide(K, square)
        assert K.calm.holding == 0
    K.calm.rho = 1.0 if near else 0.03 if holds else rho  # a moment of doubt begins it anew
    if holds and not near:
        rest.decide(K, square)
        assert K.calm.sure == 0.0
        K.calm.rho = rho
        for _ in range(9):
            rest.decide(K, square)
            assert K.calm.holding == 0
    for _ in range(2):
        rest.decide(K, square)
    assert K.calm.holding == int(holds)
    if holds:
        assert K.calm.held == pytest.approx(np.sqrt(square))


def test_an_arm_that_holds_goes_on_when_it_was_pushed():
    K = standing(stood=2.0)
    K.calm.holding, K.calm.held, K.calm.sure = 1, 0.02, 0.3
    rest.decide(K, (1.5 * 0.02 + 0.0099) ** 2)
    assert K.calm.holding == 1 and K.calm.stood == 2.0
    rest.decide(K, (1.5 * 0.02 + 0.0101) ** 2)
    assert K.calm.holding == 0 and K.calm.stood == 0.0 == K.calm.sure


@pytest.mark.parametrize("turns", [False, True])
def test_a_target_stands_that_neither_moves_nor_is_said_to(turns):
    K = standing()
    K.task.length, K.task.uses_rotation = 0.5, int(turns)
    pose = np.eye(4)[:3].ravel()
    K.task.target[:12] = pose
    rest.watch_target(K)
    assert K.calm.stood == 0.0, "it is new"
    for k in range(1, 4):
        rest.watch_target(K)
        assert K.calm.stood == pytest.approx(k * DT)
    K.task.target[3] += 4.9e-4
    rest.watch_target(K)
    assert K.calm.stood == pytest.approx(4 * DT)
    c, s = np.cos(1.1e-3), np.sin(1.1e-3)  # times the length 5.5e-4
    K.task.target[:12] = [c, -s, 0.0, 0.0, s, c, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]
    rest.watch_target(K)
    assert (K.calm.stood == 0.0) == turns
    K.calm.stood, K.calm.holding = 1.0, 1
    K.task.target[TARGET_TWIST + 4] = 5e-3
    rest.watch_target(K)
    assert (K.calm.stood == 0.0) == turns == (K.calm.holding == 0)
    K.calm.stood, K.calm.holding = 1.0, 1
    K.task.target[TARGET_TWIST] = 2.1e-3
    rest.watch_target(K)
    assert K.calm.stood == 0.0 and K.calm.holding == 0


def test_other_beliefs_begin_the_standing_anew():
    K = standing()
    for _ in range(4):
        rest.watch_target(K)
    K.calm.holding = 1
    believe(K, {1: 1})
    rest.watch_target(K)
    assert K.calm.stood == 0.0 and K.calm.holding == 0
    rest.watch_target(K)
    assert K.calm.stood == pytest.approx(DT)
    K.faults.order[0], K.faults.order[1] = K.faults.order[1], K.faults.order[0]
    rest.watch_target(K)
    assert K.calm.stood == 0.0, "and so do others of the same number"


def moving_target(K, t):
    """x = t + t^2 along x: given at time t."""
    K.task.target[:] = 0.0
    K.task.target[:12] = np.eye(4)[:3].ravel()
    K.task.target[3] = t + t * t
    K.task.target[TARGET_TWIST] = 1.0 + 2.0 * t
    K.task.target[TARGET_ACCELERATION] = 2.0
    K.task.target[TARGET_HAS_ROTATION] = 1.0


def played(rate, ticks, *, catches_up_from=None, stop_samples=3):
    """A record whose target is played at a rate, tick by tick."""
    K = empty_record()
    K.chain.n, K.state.dt, K.watch.stop_samples = N, DT, stop_samples
    K.feedback.stride, K.feedback.rate = 1, 1.0
    late = []
    for k in range(ticks):
        K.state.ticks = k + 1
        moving_target(K, DT * k)
        if k >= 5:
            K.feedback.rate = 1.0 if catches_up_from is not None and k >= catches_up_from else rate
        late_targets.play_back(K)
        late.append(float(K.feedback.late))
    return K, np.array(late)


def test_a_target_that_is_not_late_is_played_as_it_is_given():
    K, late = played(1.0, 20)
    assert not late.any() and K.task.target[TARGET_TWIST] == pytest.approx(1.0 + 2.0 * 0.19)


def test_a_target_that_is_played_slower_is_that_of_so_long_ago():
    """x(t - late), its twist r x', its acceleration r^2 x'' + r' x'."""
    K, late = played(0.4, 30)
    assert late[-1] == pytest.approx(25 * DT * 0.6, rel=0.2) and (np.diff(late[5:]) > 0.0).all()
    then = DT * 29 - late[-1]
    assert K.task.target[3] == pytest.approx(then + then * then, abs=1e-4)
    r = 0.4 + K.feedback.up
    assert K.task.target[TARGET_TWIST] == pytest.approx(r * (1.0 + 2.0 * then), abs=0.02)


def test_lost_time_is_made_up_for():
    K, late = played(0.4, 400, catches_up_from=30)
    assert late[29] > 0.1 and late[-1] == 0.0 and (np.diff(late[60:]) <= 1e-12).all()
    assert K.feedback.up == 0.0


@pytest.mark.parametrize("stop_samples", [0, 3])
def test_a_target_later_than_a_second_stops_the_arm_where_it_may(stop_samples):
    K, late = played(0.0, 140, stop_samples=stop_samples)
    assert late[-1] == pytest.approx(late_targets.LATEST)
    assert K.watch.latched == (stop_samples > 0)
    assert K.watch.reason == (STOPPED_BY_LAG if stop_samples else 0)


def test_a_displacement_is_bounded_by_its_norm_and_rests_where_it_is():
    c, rate = np.arange(6.0), np.ones(6)
    tip_correction._bounded(c, rate, 0, 5.0)
    assert c[:3].tolist() == [0.0, 1.0, 2.0] and rate[:3].tolist() == [1.0] * 3
    tip_correction._bounded(c, rate, 3, 5.0)
    assert np.linalg.norm(c[3:]) == pytest.approx(5.0) and c[3:] == pytest.approx(
        np.array([3, 4, 5]) * 5.0 / 50**0.5
    )
    assert not rate[3:].any()


@pytest.mark.parametrize(
    ("claim", "status", "mode", "missed", "outcome"),
    [
        (SOLVED, OK, SLACK, 0, SOLVED),
        (SOLVED, FALLBACK, SLACK, 0, FAILED),
        (INFEASIBLE, FALLBACK, SLACK, 0, FAILED),
        (INFEASIBLE, RELAXED, HARD, 1, INFEASIBLE),
        (SOLVED, RELAXED, HARD, 1, FAILED),
        (SOLVED, RELAXED, HARD, 0, SOLVED),
        (SOLVED, RELAXED, SLACK, 1, SOLVED),
        (-1, OK, SLACK, 0, -1),
    ],
)
def test_a_row_says_what_became_of_the_solvers_claim(claim, status, mode, missed, outcome):
    K = empty_record()
    K.cascade.claim, K.cascade.status, K.cascade.missed, K.task.mode = claim, status, missed, mode
    assert block_of_ticks.qp_outcome(K) == outcome


@pytest.mark.parametrize("level", [ACCELERATION, VELOCITY])
@pytest.mark.parametrize("known", [False, True])
def test_torques_of_a_tick_are_those_of_its_command_or_none(level, known):
    robot = ftqp.robots.load("planar", count=N, vertical=True)
    K, rng = chain_record(robot), np.random.default_rng(1)
    K.state.level, K.state.dt = level, DT
    K.limits.a_brake[:N] = 5.0
    K.state.q[:N], K.state.v[:N], K.state.a_command[:N] = rng.normal(size=(3, N))
    forward_kinematics(K)
    expected = robot.mass_matrix(K.state.q[:N]) @ K.state.a_command[:N] + robot.bias(
        K.state.q[:N], K.state.v[:N]
    )
    motion(K)
    if known:
        dynamics(K)
        K.kinematics.has_dynamics, K.state.tau[:N] = 1, 7.0
    block_of_ticks.complete_torques(K, 1)
    assert K.state.tau[:N] == pytest.approx(np.full(N, 7.0) if known else expected)
    block_of_ticks.complete_torques(K, 0)
    assert np.isnan(K.state.tau[:N]).all() and np.isnan(K.state.tau_brake[:N]).all()
