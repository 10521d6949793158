"""Many arms at once do what each does alone, however many threads share them out."""

import numpy as np
import pytest

import ftqp
from ftqp.core.errors import InputError
from ftqp.kernel.entry.rollouts import rollout
from ftqp.kernel.entry.threads import thread_count
from ftqp.kernel.layout.enums import JointCode

DT, TICKS = 2e-3, 60


@pytest.fixture(scope="module")
def robot():
    return ftqp.robots.load("panda")


def planner_of(robot):
    planner = ftqp.Planner(robot, DT, emergency=None)
    planner.reset(robot.neutral)
    return planner


@pytest.fixture(scope="module")
def study(robot):
    """A session, three starts, and targets that leave the first one."""
    poses = np.repeat(robot.pose(robot.neutral)[None], TICKS, axis=0)
    poses[:, 2, 3] += 2e-4 * np.arange(TICKS)
    q = robot.neutral + np.linspace(-0.02, 0.02, 3)[:, None]
    return planner_of(robot).session(), q, np.zeros((3, 7)), ftqp.Targets(poses)


def test_every_arm_moves_as_a_planner_moves_it(robot, study):
    session, q, v, targets = study
    events = np.array([[-1, 0, 0], [2, 20, JointCode.BRAKING], [-1, 0, 0]])
    found = rollout(session, q, v, targets.packed, events, [1.0, 3.0, 1.0])
    for arm in range(3):
        planner, at, speed, worst = planner_of(robot), q[arm], v[arm], 0.0
        planner.reset(at)
        # the session's posture is that of its own reset, which the scheme mvn does not look at
        for k in range(TICKS):
            if arm == 1 and k == 20:
                planner.report(ftqp.Locked(2, deceleration=3.0))
            step = planner.step(at, speed, targets.at(k))
            at, speed, worst = step.q.copy(), step.v.copy(), max(worst, step.position_error)
        np.testing.assert_allclose(found.q[arm], at, rtol=0.0, atol=1e-13)
        np.testing.assert_allclose(found.v[arm], speed, rtol=0.0, atol=1e-11)
        assert found.worst[arm, 0] == pytest.approx(worst, abs=1e-12)
    assert (found.counts.sum(axis=1) == TICKS).all() and found.v[1, 2] == 0.0


def test_number_of_threads_and_the_arms_beside_change_nothing(study):
    session, q, v, targets = study
    one, two = (rollout(session, q, v, targets.packed, threads=count) for count in (1, 2))
    alone = rollout(session, q[1:2], v[1:2], targets.packed)
    np.testing.assert_array_equal(one.q, two.q)
    np.testing.assert_array_equal(one.q[1], alone.q[0])


def test_session_and_arrays_are_only_read(study):
    session, q, v, targets = study
    before = q.copy(), session.K.state.q_command.copy()
    rollout(session, q, v, targets.packed)
    np.testing.assert_array_equal(q, before[0])
    np.testing.assert_array_equal(session.K.state.q_command, before[1])


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"v": np.zeros((2, 7))}, r"v has shape \(2, 7\), expected \(B, n\) = \(3, 7\)"),
        ({"targets": np.zeros((4, 28))}, r"targets has shape \(4, 28\), expected \(T, 29\)"),
        ({"events": [[0, 0, 1]] * 3}, "events without rates; give the deceleration"),
        ({"events": [[7, 0, 1]] * 3, "rates": [1.0] * 3}, "an event names joint 7, expected 0 to 6, or -1"),
        ({"events": [[0, 0, 9]] * 3, "rates": [1.0] * 3}, "an event has code 9, expected one of JointCode"),
        ({"events": np.zeros((3, 3)), "rates": [1.0] * 3}, r"expected \(B, 3\) = \(3, 3\) whole numbers"),
        ({"rates": [1.0, 0.0, 1.0]}, "the least rate is 0, expected more than 0"),
        ({"threads": 0}, "threads is 0, expected a whole number from 1"),
    ],
)
def test_wrong_input_is_refused_with_one_sentence(study, given, sentence):
    session, q, v, targets = study
    with pytest.raises(InputError, match=sentence):
        rollout(session, **({"q": q, "v": v, "targets": targets.packed} | given))


@pytest.mark.parametrize(("given", "count"), [("3", 3), ("1", 1)])
def test_threads_are_limited_by_the_environment(monkeypatch, given, count):
    monkeypatch.setenv("NUMBA_NUM_THREADS", given)
    assert thread_count() == count


@pytest.mark.parametrize("given", ["", "0", "-2", "many"])
def test_senseless_limit_of_threads_is_none(monkeypatch, given):
    monkeypatch.setenv("NUMBA_NUM_THREADS", given)
    assert thread_count() >= 1
