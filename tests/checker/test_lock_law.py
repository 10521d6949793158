"""From when a locked joint has to stand, and how an arm that was held as a whole is let go."""

from dataclasses import replace

import numpy as np
import pytest
from tests.checker.panda_runs import ARM, ROBOT, places_of, trace_of

from ftqp.checker.motion_laws import failed, held
from ftqp.checker.trace import PHYSICS, Failure

DT, TICKS, J = 1e-3, 2000, 3
T = DT * np.arange(TICKS + 1)
LOCK = Failure(joint=J, kind="locked", since=0.5, reported_at=0.5, deceleration=2.0)


def broken(speeds, lock=LOCK, sent=None):
    """By how much a joint with these speeds breaks the law in physics, from which tick on."""
    v = np.zeros((TICKS + 1, ROBOT.nv))
    v[:, J] = speeds
    q = places_of(v, DT)
    commands = np.zeros((TICKS, ROBOT.nv))
    if sent is not None:
        commands[:, J] = sent
    run = trace_of(q, v, DT, sent_v=commands, failures=[lock])
    over = failed(ARM, run, PHYSICS)[:, J]
    return float(over.max()), int(np.argmax(over > 0.0)) * DT


def test_joint_that_brakes_as_it_is_said_to_breaks_nothing():
    assert broken(np.clip(0.4 - 2.0 * np.clip(T - 0.5, 0.0, None), 0.0, None))[0] <= 0.0


def test_joint_that_never_comes_to_rest_is_found_once_it_has_had_the_time():
    size, at = broken(np.where(T < 0.5, 0.4, 0.05))
    assert size == pytest.approx(0.05 * (2.0 - at) + 0.05 * 0.01 - 5e-4, abs=2e-3)
    assert 0.5 + 0.05 / 2.0 < at < 0.7


def test_drift_counts_from_where_the_joint_came_to_rest():
    slow = np.where(T > 0.6, 1e-3, 0.0)
    size, at = broken(slow)
    assert size == pytest.approx(1.4e-3 - 5e-4, abs=1e-5) and at == pytest.approx(1.1, abs=0.01)


@pytest.mark.parametrize(
    ("change", "found"), [({}, True), ({"closes": 0.7}, False), ({"slips": True}, False)]
)
def test_joint_may_move_until_what_holds_it_has_closed_and_as_it_likes_if_that_slips(change, found):
    coasts = np.where(T < 1.2, 0.5, 0.0)
    assert (broken(coasts, replace(LOCK, **change))[0] > 0.0) == found


def test_ways_that_a_joint_is_sent_count_together():
    there_and_back = np.where(T[:-1] > 1.0, 2e-3 * np.where(np.arange(TICKS) // 100 % 2, 1.0, -1.0), 0.0)
    assert broken(0.0 * T, sent=there_and_back)[0] == pytest.approx(2e-3 - 5e-4, abs=1e-5)
    assert broken(0.0 * T, sent=0.2 * there_and_back)[0] <= 0.0


HOLD = (0.5, 1.0)


def held_badly(share=0.5, status="OK", blamed=False, failures=(), holds=(HOLD,)):
    """The largest breach, with a joint that goes at that share of its limit from 50 ms after the hold on."""
    v, believed = np.zeros((TICKS + 1, ROBOT.nv)), np.zeros((TICKS, ROBOT.nv), dtype=bool)
    v[T > 1.05, J] = share * ROBOT.limits.v_max[J]
    believed[T[:-1] > 0.7, J] = blamed
    q = np.tile(ROBOT.neutral, (TICKS + 1, 1))
    run = trace_of(
        q,
        v,
        DT,
        status=["OK"] * 1500 + [status] * (TICKS - 1500),
        failures=list(failures),
        holds=list(holds),
        blamed=believed,
    )
    return float(held(ARM, run, PHYSICS).max())


def test_arm_that_goes_on_after_a_hold_breaks_nothing():
    assert held_badly() <= 0.0
    assert held_badly(share=1.09) <= 0.0


def test_leap_after_a_hold_is_a_breach_by_its_share():
    assert held_badly(share=2.2) == pytest.approx(1.0)
    assert held_badly(share=2.2, holds=()) == 0.0


def test_blaming_a_joint_or_stopping_for_good_is_a_breach():
    assert held_badly(blamed=True) == held_badly(status="STOPPED") == 1.0


def test_joint_that_has_really_failed_may_be_blamed_and_the_arm_be_stopped_for_it():
    lock = Failure(joint=J, kind="locked", since=0.6, reported_at=0.7)
    assert held_badly(blamed=True, status="STOPPED", failures=[lock]) <= 0.0
