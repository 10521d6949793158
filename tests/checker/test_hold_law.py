"""A hold of the whole arm is judged: a leap after it, a joint that is blamed, an arm that it stopped."""

import numpy as np
import pytest
from tests.checker.panda_runs import ARM, ROBOT, trace_of

from ftqp.checker.lock_law import held
from ftqp.checker.trace import PHYSICS, Failure

DT, TICKS, J = 1e-3, 2000, 3
T = DT * np.arange(TICKS + 1)
HOLD = (0.5, 1.0)


def broken(share=0.5, status="OK", blamed=False, failures=(), holds=(HOLD,)):
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
    assert broken() <= 0.0
    assert broken(share=1.09) <= 0.0


def test_leap_after_a_hold_is_a_breach_by_its_share():
    assert broken(share=2.2) == pytest.approx(1.0)
    assert broken(share=2.2, holds=()) == 0.0


def test_blaming_a_joint_or_stopping_for_good_is_a_breach():
    assert broken(blamed=True) == broken(status="STOPPED") == 1.0


def test_joint_that_has_really_failed_may_be_blamed_and_the_arm_be_stopped_for_it():
    lock = Failure(joint=J, kind="locked", since=0.6, told=0.7)
    assert broken(blamed=True, status="STOPPED", failures=[lock]) <= 0.0
