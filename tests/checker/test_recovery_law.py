"""The search that judges failed arms: what it calls feasible, what it leaves open, and who is blamed."""

from dataclasses import replace

import numpy as np
import pytest
from tests.checker.panda_runs import ARM, ROBOT, trace_of

from ftqp.checker.checked_run import verdict
from ftqp.checker.recovery_law import rest_after
from ftqp.checker.trace import KINEMATIC, Failure
from ftqp.control.paths import Circle, Line

DT, TICKS = 0.01, 400
T = DT * np.arange(TICKS)
PLACE, POSE = ("x", "y", "z"), ("x", "y", "z", "rx", "ry", "rz")
LOCK = Failure(joint=4, kind="locked", since=0.5, reported_at=0.5)
SMALL = Circle(ROBOT.pose(ROBOT.neutral), 0.03, duration=3.0)
FAR = Line(ROBOT.pose(ROBOT.neutral), (1.5, 0.0, 0.0), duration=3.0)


def stood(path=SMALL, **changes):
    """An arm that stands while its target goes."""
    target = path.sample(np.minimum(T, path.duration)).pose
    q = np.tile(ROBOT.neutral, (TICKS + 1, 1))
    trace = trace_of(q, np.zeros_like(q), DT, target=target, tolerance=(1e-3, 1e-2), failures=(LOCK,))
    return replace(trace, **changes)


def judged(trace):
    rest = rest_after(ARM, trace, KINEMATIC)
    return rest, "recovery" in verdict(ARM, replace(trace, rest=rest)).laws


def test_arm_that_stays_away_for_ever_breaks_the_law_though_it_says_relaxed():
    half = Circle(ROBOT.pose(ROBOT.neutral), 0.03, duration=2 * T[-1])
    rest, broken = judged(stood(half))
    assert rest.feasible and rest.joint == 4 and broken
    assert rest.missed == pytest.approx(59.0, abs=0.5)  # a diameter of 60 mm, over the tolerance of 1 mm


def test_arm_that_is_at_the_end_has_finished():
    rest, broken = judged(stood())
    assert rest.feasible and rest.missed == 0.0 and not broken
    assert rest.since == pytest.approx(0.5 / 3.0, abs=0.01)


def test_what_is_out_of_reach_is_not_asked_for():
    rest, broken = judged(stood(FAR))
    assert not rest.feasible and rest.missed > 100.0 and not broken


def test_stopped_arm_says_so_and_is_not_blamed():
    half = Circle(ROBOT.pose(ROBOT.neutral), 0.03, duration=2 * T[-1])
    rest, broken = judged(stood(half, status=["STOPPED"] * TICKS))
    assert rest.stopped and rest.missed > 10.0 and not broken


@pytest.mark.parametrize(
    "failures",
    [
        (),
        (replace(LOCK, reported_at=np.inf),),
        (replace(LOCK, kind="free"),),
        (replace(LOCK, since=3.5, reported_at=3.5),),
        (LOCK, replace(LOCK, joint=2, reported_at=np.inf)),
    ],
)
def test_nothing_is_said_where_nobody_knows_or_too_little_is_left(failures):
    assert rest_after(ARM, stood(failures=failures), KINEMATIC) is None


def test_tip_comes_back_from_where_the_failure_left_it_as_fast_as_it_is():
    """Six joints and six rows: the only motion there is has to begin with the velocity that the arm has."""
    trace = stood(rows=POSE)
    k = 51
    v = trace.v.copy()
    v[k] = 0.05 * np.array([1.0, -1.0, 1.0, -1.0, 0.0, 1.0, -1.0])
    q = trace.q.copy()
    q[k] += np.array([0.02, -0.02, 0.01, 0.02, 0.0, 0.01, -0.02])
    assert rest_after(ARM, replace(trace, q=q, v=v), KINEMATIC).feasible
    v[k] *= 100.0
    assert not rest_after(ARM, replace(trace, q=q, v=v), KINEMATIC).feasible


def test_path_that_waits_has_to_be_gone_to_its_end():
    times = np.linspace(0.0, SMALL.duration, 301)
    waits = stood(
        path_dt=float(times[1]), progress=np.minimum(T, 0.5), target=np.tile(SMALL.start, (TICKS, 1, 1))
    )
    waits = replace(waits, path=SMALL.sample(times).pose)
    rest, broken = judged(waits)
    assert rest.feasible and broken and rest.missed == pytest.approx(2.5 / 3.0, abs=0.01)
    rest, broken = judged(replace(waits, progress=np.minimum(T, SMALL.duration)))
    assert rest.missed == 0.0 and not broken


def test_weakened_joints_have_what_is_left_of_their_limits():
    weak = Failure(joint=3, kind="degraded", since=0.5, reported_at=0.5, shares={"v_max": 0.001})
    assert not rest_after(ARM, stood(rows=POSE, failures=(weak,)), KINEMATIC).feasible
    weak = replace(weak, shares={"v_max": 0.8})
    assert rest_after(ARM, stood(rows=POSE, failures=(weak,)), KINEMATIC).feasible


def test_an_arm_that_is_on_its_way_is_given_the_time_that_the_search_took():
    """The search goes four times as slowly, for longer than the run; who stands is still blamed."""
    times = np.linspace(0.0, SMALL.duration, 301)
    slow = stood(path_dt=float(times[1]), progress=0.5 * T, target=np.tile(SMALL.start, (TICKS, 1, 1)))
    slow = replace(slow, path=SMALL.sample(times).pose)
    rest, broken = judged(slow)
    assert slow.progress[-1] < 2.0 < SMALL.duration
    assert rest.feasible and rest.missed == 0.0 and not broken
    rest, broken = judged(replace(slow, progress=np.minimum(0.5 * T, 1.9)))
    assert rest.feasible and broken and rest.missed == pytest.approx(1.1 / 3.0, abs=0.01)
