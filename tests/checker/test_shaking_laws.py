"""Swings and chatter: what dies away is let pass, what goes on is found, whenever it is."""

import numpy as np
import pytest
from tests.checker.panda_runs import ARM, ROBOT, trace_of

from ftqp.checker.motion_laws import JOLTS, NEAR_TICKS, chatter, rest
from ftqp.checker.trace import KINEMATIC, PHYSICS, Failure

DT, TICKS, J = 2e-3, 4000, 3
T = DT * np.arange(TICKS + 1)


def run(places=None, speeds=None, failures=()):
    """A joint at these places, or with these speeds, while the target rests from the first tick on."""
    q, v = np.tile(ROBOT.neutral, (TICKS + 1, 1)), np.zeros((TICKS + 1, ROBOT.nv))
    if places is not None:
        q[:, J] += places
    if speeds is not None:
        v[:, J] = speeds
    return trace_of(q, v, DT, failures=failures)


def jolting(count, every=1):
    """Speeds with ``count`` turns of a full acceleration, ``every`` ticks apart, in the middle of the run."""
    a = np.zeros(TICKS)
    signs = np.where(np.arange(count + 1) % 2, 1.0, -1.0)
    a[1000 : 1000 + every * (count + 1) : every] = 0.6 * ARM.a_max[J] * signs
    return np.concatenate([[0.0], DT * np.cumsum(a)])


@pytest.mark.parametrize("every", range(1, NEAR_TICKS + 2))
@pytest.mark.parametrize("count", [JOLTS, JOLTS + 5])
def test_jolts_count_from_eleven_in_a_row_on_and_only_if_they_are_near(count, every):
    over = chatter(ARM, run(speeds=jolting(count, every)), KINEMATIC)
    found = count - JOLTS if every <= NEAR_TICKS else 0
    assert over[:, J].max() == found and (over[:, [0, 1, 2, 4, 5, 6]] == 0.0).all()


def test_joint_that_does_not_obey_is_not_judged_for_its_jolts():
    free = Failure(joint=J, kind="free", since=0.0, reported_at=np.inf)
    assert not chatter(ARM, run(speeds=jolting(50), failures=[free]), PHYSICS).any()


@pytest.mark.parametrize(("begins", "ends"), [(3.0, 8.0), (3.0, 4.0), (5.2, 6.1), (7.4, 8.0)])
@pytest.mark.parametrize("strict", [KINEMATIC, PHYSICS], ids=["kinematic", "physics"])
def test_swing_is_found_whenever_it_is(begins, ends, strict):
    swing = 0.02 * np.sin(4.0 * np.pi * T) * ((begins < T) & (ends >= T))
    assert rest(ARM, run(swing), strict)[:, J].max() > 0.05


def test_swing_that_ends_before_the_arm_has_to_rest_is_let_pass():
    swing = 0.02 * np.sin(4.0 * np.pi * T) * (T < 1.5)
    assert not rest(ARM, run(swing), PHYSICS).any()
    assert rest(ARM, run(swing), KINEMATIC).any()


def test_slow_swing_is_found_over_the_whole_rest_and_a_way_somewhere_is_none():
    assert rest(ARM, run(0.35 * np.sin(0.4 * np.pi * T)), PHYSICS)[:, J].max() > 0.1
    assert not rest(ARM, run(0.1 * T), PHYSICS).any()
    assert not rest(ARM, run(0.1 * np.exp(-T)), PHYSICS).any()
