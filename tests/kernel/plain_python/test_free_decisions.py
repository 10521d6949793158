"""What is decided about a joint that swings freely, step by step."""

from math import inf

import numpy as np
import pytest
from records import believe, chain_record

import ftqp
from ftqp.kernel.entry.session import rooms
from ftqp.kernel.free import decision, free_command
from ftqp.kernel.layout.enums import (
    ARREST,
    DECIDE,
    FOLLOW,
    FREE,
    HOLD,
    LOCKED,
    NO_GAIN,
    NO_POSTURE,
    NOT_REFUSED,
    NOTHING_KEPT,
    STILL,
    STOPPED_BY_FREE_JOINT,
)
from ftqp.kernel.layout.free_memory import free_dtype

N, DT = 3, 0.01
rng = np.random.default_rng(0)
A = rng.normal(size=(N, N))
M = A @ A.T + N * np.eye(N)


def hanging(**codes):
    """A vertical arm of three joints whose second one swings freely, and the memory of the search."""
    robot = ftqp.robots.load("planar", count=3, vertical=True)
    K, F = chain_record(robot), rooms(np.zeros(1, free_dtype(8)))
    for name in ("q_min", "q_max", "v_max", "a_max"):
        getattr(K.limits, name)[:N] = getattr(robot.limits, name)
    K.limits.a_brake[:N] = K.limits.a_max[:N]
    K.state.dt = F.dt = DT
    believe(K, codes or {1: FREE})
    K.state.q[:N] = F.q[:N] = robot.neutral
    F.joint = K.free.joint = 1
    F.period, K.free.mode, K.free.allowed = 4, ARREST, 0b1110
    return K, F


def answers(monkeypatch, **said):
    """Parts of the search that answer what the test says, and what they were asked."""
    asked = []
    for name, value in said.items():

        def part(*given, name=name, value=value):
            asked.append(name)
            return value(*given) if callable(value) else value

        monkeypatch.setattr(decision, name, part)
    return asked


@pytest.mark.parametrize(
    ("damping", "given_up", "speed", "safe", "swing", "rests"),
    [
        (1.0, 0.1, 0.06, True, 0.0, False),  # it does not hang, and there is time
        (1.0, 0.1, 0.04, True, 0.01, True),  # it hangs
        (1.0, 0.1, 0.04, True, 0.03, False),  # it would swing on
        (1.0, 0.1, 0.04, False, 0.01, False),  # others may not brake
        (1.0, 1.3, 0.50, True, 5.0, True),  # its time is over, and friction will do the rest
        (1.0, 1.3, 0.50, False, 5.0, False),
        (0.0, 1.3, 0.06, True, 0.0, False),  # without friction it has more time
        (0.0, 4.6, 0.50, True, 0.19, True),
        (0.0, 4.6, 0.50, True, 0.21, False),
    ],
)
def test_the_others_rest_where_the_free_joint_hangs_or_its_time_is_over(
    monkeypatch, damping, given_up, speed, safe, swing, rests
):
    K, F = hanging()
    K.faults.friction[1], F.given_up, F.v[1] = damping, given_up, speed
    F.lowest, F.highest = 0.0, swing
    answers(monkeypatch, braking_is_safe=safe)
    assert bool(decision._may_rest(K, F)) == rests
    if not rests or speed <= 0.05:
        return
    assert F.base_v[1] == speed, "what was looked at is where the arm is"


def test_an_arm_that_is_led_rests_goes_on_or_is_given_up(monkeypatch):
    K, F = hanging()
    K.free.mode, F.since, F.rows, K.watch.latched = HOLD, 0.06, 2, 1
    answers(monkeypatch, braking_is_safe=True, begin_rollout=None, roll_on=NOT_REFUSED)
    decision._watch(K, F)
    assert K.free.mode == STILL and F.left == 0.0 and F.countdown == 0 and F.period >= 5
    K.free.mode, K.watch.latched, F.since, F.roll_step = HOLD, 0, 0.0, 0
    for k in range(5):
        assert F.rolling == (0 if k < 5 else 1)
        decision._watch(K, F)
    assert F.rolling == 1, "every 50 ms it is looked at again"
    F.roll_step = decision.ROLLOUT_STEPS
    decision._watch(K, F)
    assert F.rolling == 0 and K.free.mode == HOLD
    F.rolling = 1
    answers(monkeypatch, roll_on=NO_GAIN)
    decision._watch(K, F)
    assert K.free.mode == ARREST and F.refused[2] == NO_GAIN
    assert K.watch.latched == 1 and K.watch.reason == STOPPED_BY_FREE_JOINT


@pytest.mark.parametrize(
    ("damping", "safe", "swing", "left", "recheck", "mode", "calming"),
    [
        (1.0, True, 5.0, 0.0, 1.0, STILL, 0),
        (0.0, True, 0.01, 0.0, 1.0, STILL, 0),
        (0.0, True, 0.03, 0.0, 1.0, ARREST, 0),
        (1.0, False, 0.0, 0.0, 1.0, ARREST, 0),
        (1.0, False, 0.0, 0.0, 0.0, ARREST, 1),
        (0.0, True, 0.03, -0.31, 1.0, STILL, 0),
        (0.0, True, 0.03, -0.29, 1.0, ARREST, 0),
    ],
)
def test_a_search_ends_where_it_is_safe_to_hold_still(
    monkeypatch, damping, safe, swing, left, recheck, mode, calming
):
    K, F = hanging()
    K.faults.friction[1], F.left, F.recheck, F.quiet = damping, left, recheck, 0
    F.lowest, F.highest, F.countdown = 0.0, swing, 0
    asked = answers(monkeypatch, braking_is_safe=safe, search=None, begin_start=None)
    decision._arrest(K, F)
    assert K.free.mode == mode and F.calming == calming
    assert asked.count("search") == 1, "at its boundary a search that is over looks once"
    assert ("begin_start" in asked) == bool(calming) and (not calming or F.rows == NOTHING_KEPT)


def test_within_its_time_a_search_looks_as_often_as_a_tick_allows(monkeypatch):
    K, F = hanging()
    F.left, F.recheck, F.quiet, F.countdown = 1.0, 1.0, 0, 3
    asked = answers(monkeypatch, search=None)
    decision._arrest(K, F)
    assert asked == ["search"] * decision.ROLLOUTS and F.countdown == 2 and K.free.mode == ARREST
    F.calming = 1
    asked = answers(monkeypatch, search=None, _decide=None)
    decision._arrest(K, F)
    assert asked == ["_decide"], "while a posture is looked for nothing else is"


def test_items_of_a_decision_follow_one_another_and_refusals_lead_to_the_next(monkeypatch):
    K, F = hanging()
    K.free.mode, F.stage, F.starts, F.rows, F.calming = DECIDE, decision.SEEK, decision.STARTS - 1, 3, 0
    answers(monkeypatch, seek=True, take_nearest=True, begin_gain=False)
    monkeypatch.setattr(decision, "WORK", 1)
    decision._decide(K, F)
    assert F.stage == decision.GAIN and F.refused[3] == NO_POSTURE, "the last start ends the search"
    decision._decide(K, F)
    assert F.stage == decision.GAIN and F.refused[3] == NO_GAIN, "the next posture is tried"
    answers(monkeypatch, begin_gain=True, go_on_doubling=inf)
    decision._decide(K, F)
    assert F.stage == decision.DOUBLE
    decision._decide(K, F)
    assert F.stage == decision.GAIN and F.refused[3] == NO_GAIN, "an equation without solution"
    F.stage = decision.DOUBLE
    answers(monkeypatch, go_on_doubling=0.0, finish_gain=None, begin_rollout=None)
    decision._decide(K, F)
    assert F.stage == decision.ROLL
    answers(monkeypatch, roll_on=5, take_nearest=False, begin_start=None)
    decision._decide(K, F)
    assert F.refused[3] == 5 and F.rows == 2 and F.stage == decision.SEEK, "fewer rows"
    F.stage, F.roll_step = decision.ROLL, decision.ROLLOUT_STEPS
    answers(monkeypatch, roll_on=NOT_REFUSED)
    decision._decide(K, F)
    assert K.free.mode == HOLD and K.free.rows == 2


def test_with_no_rows_left_the_task_is_given_up_and_a_calming_search_is_put_off(monkeypatch):
    K, F = hanging()
    answers(monkeypatch, take_nearest=False)
    K.free.mode, F.rows, F.calming = DECIDE, 1, 0
    decision._try_next(K, F, NO_POSTURE)
    assert K.free.mode == ARREST and K.watch.latched == 1
    F.calming, F.recheck = 1, 0.0
    decision._try_next(K, F, NO_POSTURE)
    assert F.calming == 0 and F.recheck == pytest.approx(decision.RETRY)
    K.free.mode, K.free.allowed = DECIDE, 0b0010
    answers(monkeypatch, begin_start=None)
    F.calming = 0
    F.rows = 3
    decision._try_next(K, F, NO_POSTURE)
    assert F.rows == 1, "rows that are not allowed are left out"


@pytest.mark.parametrize(
    ("codes", "latched", "mode"),
    [
        ({1: FREE}, 0, DECIDE),
        ({1: FREE}, 1, ARREST),
        ({0: FREE, 1: FREE}, 0, STILL),
        ({0: LOCKED, 1: FREE, 2: LOCKED}, 0, STILL),
    ],
)
def test_how_it_begins(monkeypatch, codes, latched, mode):
    K, F = hanging(**{})
    believe(K, codes)
    K.watch.latched = latched
    answers(monkeypatch, begin_start=None)
    decision.begin(K, F)
    assert K.free.mode == mode and K.watch.latched == (0 if mode == DECIDE else 1)
    assert F.joint == min(j for j, code in codes.items() if code == FREE)


def test_a_joint_without_gravity_is_followed_until_the_task_makes_its_impact_harder(monkeypatch):
    robot = ftqp.robots.load("planar", count=3)
    K, F = hanging()
    K.chain.gravity[:] = 0.0
    K.limits.q_max[1], F.q[1] = robot.limits.q_max[1], robot.neutral[1]
    K.kinematics.M[:N, :N], F.v[:N] = M, [0.1, 0.2, -0.3]
    answers(monkeypatch, begin_start=None, search=None)
    decision.begin(K, F)
    assert K.free.mode == FOLLOW and F.borne < 0.0
    drift = M[1] @ F.v[:N] / M[1, 1]
    impact = [0.0]

    def ahead(K, F, *rest):
        F.impact_speed = impact[0]
        return 0.0

    answers(monkeypatch, look_ahead=ahead)
    F.since = 0.0
    decision._go_on_following(K, F)
    assert K.free.drift == pytest.approx(drift) and F.borne == pytest.approx(abs(drift))
    room = K.limits.q_max[1] - F.q[1] if drift > 0.0 else F.q[1] - K.limits.q_min[1]
    assert K.free.drift_time == pytest.approx(room / abs(drift))
    K.faults.friction[1] = 10.0 * abs(M[1] @ F.v[:N]) / room
    for speed, mode in ((abs(drift) + 0.09, FOLLOW), (abs(drift) + 0.11, ARREST)):
        impact[0], F.since = speed, 0.0
        decision._go_on_following(K, F)
        assert K.free.mode == mode and K.free.drift_time == inf, "friction stops it before its stop"
    K.free.mode, impact[0], F.since = FOLLOW, 9.0, 0.02
    decision._go_on_following(K, F)
    assert K.free.mode == FOLLOW, "it is not looked at every tick"
    K.kinematics.M[1, 1], K.free.drift = 0.0, 0.5
    decision._drift(K, F)
    assert K.free.drift == 0.5, "without an inertia nothing is said"


def test_thinking_begins_anew_gives_up_what_is_latched_and_puts_the_state_back(monkeypatch):
    K, F = hanging()
    answers(monkeypatch, begin_start=None, search=None)
    K.state.ticks, K.free.mode, K.watch.latched = 7, STILL, 0
    K.state.v[1], K.free.contact[1] = 0.3, 1
    asked = answers(monkeypatch, _decide=lambda K, F: K.state.q.fill(9.0))
    before = K.state.q[:N].copy()
    decision.think(K, F)
    assert K.free.mode == DECIDE and asked == ["_decide"], "somebody said that the task goes on"
    assert np.array_equal(K.state.q[:N], before) and F.v[1] == 0.0 == K.state.v[1]
    K.watch.latched = 1
    asked = answers(monkeypatch, search=None)
    decision.think(K, F)
    assert K.free.mode == ARREST and "search" in asked
    K.free.mode, F.countdown = STILL, 3
    decision.think(K, F)
    assert F.countdown == 2, "what lies ahead is looked at while all hold still"
    K.state.q[0], F.q[0] = np.nan, 0.5
    decision.think(K, F)
    assert F.q[0] == 0.5 and F.countdown == 2, "a state that is no number is not thought about"
    K.state.q[0] = 0.5
    believe(K, {0: FREE})
    decision.think(K, F)
    assert F.countdown == 2, "nor what two free joints do"


def test_what_is_said_of_an_arm_with_a_free_joint():
    K, _ = hanging()
    K.watch.latched, K.free.mode = 1, ARREST
    assert free_command.outcome_beside_free(K) == free_command.STOPPING
    K.free.mode = STILL
    K.state.v[0] = 2e-3
    assert free_command.outcome_beside_free(K) == free_command.STOPPING
    K.state.v[0] = 0.5e-3
    assert free_command.outcome_beside_free(K) == free_command.STOPPED and K.watch.stopped == 1
    K.free.mode, K.state.v[1] = HOLD, 0.06
    assert free_command.outcome_beside_free(K) == free_command.STOPPING
    K.watch.latched, K.watch.stopped = 0, 0
    K.task.uses_rotation = 0
    for rows, far, code in ((1, 0.009, free_command.OK), (1, 0.011, free_command.RELAXED)):
        K.free.rows, K.task.position_error = rows, far
        assert free_command.outcome_beside_free(K) == code
    K.task.uses_rotation, K.task.position_error = 1, 0.0
    for rows, tool, code in ((1, 0, free_command.RELAXED), (2, 0, free_command.RELAXED),
                             (2, 1, free_command.OK), (3, 0, free_command.OK)):  # fmt: skip
        K.free.rows, K.task.tool_rows = rows, tool
        assert free_command.outcome_beside_free(K) == code
    K.feedback.lagging = 1
    assert free_command.outcome_beside_free(K) == free_command.RELAXED
