"""By what a joint may be beyond a limit: what it was given, which ends at full deceleration, once for all."""

import numpy as np
import pytest
from tests.checker.panda_runs import ARM, ROBOT, places_of, trace_of

from ftqp.checker.motion_laws import braking, position, speed
from ftqp.checker.trace import KINEMATIC, PHYSICS, Failure

DT, TICKS, J = 1e-3, 1500, 3
T = DT * np.arange(TICKS + 1)
TOP, FULL = float(ARM.v_max[J]), float(ARM.a_max[J])


def run(speeds, begin=None, failures=()):
    """A joint with these speeds, from a place on [rad/s, rad]."""
    v = np.zeros((TICKS + 1, ROBOT.nv))
    v[:, J] = speeds
    q = places_of(v, DT)
    if begin is not None:
        q[:, J] += begin - q[0, J]
    return trace_of(q, v, DT, failures=failures)


def worst(law, trace, strict):
    return float(law(ARM, trace, strict)[:, J].max())


def slowing(share=1.0, begin=2.0):
    """From ``begin`` times the speed limit to rest, with a share of the deceleration."""
    return np.maximum(begin * TOP - share * FULL * T, 0.0)


@pytest.mark.parametrize("strict", [KINEMATIC, PHYSICS], ids=["kinematic", "physics"])
def test_joint_that_begins_too_fast_has_to_brake_fully_and_may_not_be_fast_again(strict):
    assert worst(speed, run(slowing()), strict) <= 0.0
    assert worst(speed, run(slowing(0.5)), strict) > 0.1
    again = slowing(3.0) + 1.5 * TOP * np.exp(-((T - 0.25) ** 2) / 2e-3)
    assert worst(speed, run(again), strict) > 0.1


@pytest.mark.parametrize("strict", [KINEMATIC, PHYSICS], ids=["kinematic", "physics"])
def test_joint_that_begins_outside_may_not_go_farther_nor_out_again(strict):
    end = float(ARM.q_max[J])
    for speeds, found in ((-0.1, False), (0.1, True)):
        trace = run(speeds * np.ones_like(T), begin=end + 0.012)
        assert (worst(position, trace, strict) > 0.0) == found
    back_and_out = np.where(T < 0.5, -0.2, 0.2) * np.ones_like(T)
    assert worst(position, run(back_and_out, begin=end + 0.05), strict) > 0.0


def test_range_in_physics_is_judged_in_all():
    end = float(ARM.q_max[J])
    for out, found in ((0.019, False), (0.021, True)):
        trace = run(np.full_like(T, (out + 0.01) / T[-1]), begin=end - 0.01)
        assert (worst(position, trace, PHYSICS) > 0.0) == found


@pytest.mark.parametrize("strict", [KINEMATIC, PHYSICS], ids=["kinematic", "physics"])
def test_way_that_is_missing_when_a_limit_shrinks_may_go_on_missing_but_not_grow(strict):
    """A tenth of the deceleration is left at 0.1 s: the joint cannot stop in time, and has to brake fully."""
    weak = Failure(joint=J, kind="degraded", since=0.1, reported_at=0.1, shares={"a_max": 0.1})
    begin = float(ARM.q_max[J]) - 0.25
    for share, found in ((1.0, False), (0.5, True)):
        speeds = np.maximum(0.6 - 0.1 * share * FULL * np.clip(T - 0.1, 0.0, None), 0.0)
        assert (worst(braking, run(speeds, begin, [weak]), strict) > 0.0) == found
