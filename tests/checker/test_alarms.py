"""What a detector said against what failed: found, missed, false, of the wrong joint."""

import pytest

from ftqp.checker.alarms import Alarm, detection
from ftqp.checker.trace import Failure

NEVER = float("inf")


def alarm(joint, at, *kinds):
    return Alarm(joint=joint, at=at, kinds=frozenset(kinds or ("locked",)))


def lock(joint=2, since=1.0, reported_at=NEVER, kind="locked"):
    return Failure(joint=joint, kind=kind, since=since, reported_at=reported_at)


def test_failure_that_is_named_is_found_after_its_delay():
    seen = detection([alarm(2, 1.25, "locked", "degraded")], [lock()], 4.0)
    assert (seen.unannounced, seen.found, seen.right_kind) == (1, 1, 1)
    assert seen.delay == 0.25 and seen.found_as == "degraded or locked"
    assert seen.healthy_time == 1.0 and seen.false_alarms == seen.wrong_joint == 0


def test_failure_showed_if_it_made_a_difference_or_was_found():
    quiet, other = lock(), lock(joint=3)
    assert detection([], [quiet], 4.0).showed == 0
    assert detection([], [quiet, other], 4.0, [other]).showed == 1
    assert detection([alarm(2, 1.25)], [quiet], 4.0).showed == 1
    assert detection([], [lock(reported_at=2.0)], 4.0, [lock(reported_at=2.0)]).showed == 0


def test_right_joint_with_another_kind_is_found_with_the_wrong_kind():
    seen = detection([alarm(2, 1.1, "degraded")], [lock()], 4.0)
    assert (seen.found, seen.right_kind) == (1, 0)
    assert detection([alarm(2, 1.1, "free_swinging")], [lock(kind="free")], 4.0).right_kind == 1


def test_alarm_while_nothing_has_failed_is_false_even_of_the_joint_that_fails_later():
    seen = detection([alarm(2, 0.5), alarm(2, 1.5)], [lock()], 4.0)
    assert (seen.false_alarms, seen.found, seen.wrong_joint) == (1, 1, 0)
    assert detection([alarm(0, 3.0)], [], 4.0).false_alarms == 1
    assert detection([], [], 4.0).healthy_time == 4.0


def test_alarm_of_a_joint_that_works_after_a_failure_names_the_wrong_joint():
    seen = detection([alarm(3, 1.2)], [lock()], 4.0)
    assert (seen.found, seen.wrong_joint, seen.false_alarms) == (0, 1, 0)


@pytest.mark.parametrize("alarms", [[], [alarm(2, 2.5)]])
def test_failure_that_was_announced_first_is_nothing_to_find(alarms):
    seen = detection(alarms, [lock(reported_at=2.0)], 4.0)
    assert (seen.unannounced, seen.found, seen.wrong_joint) == (0, 0, 0)


def test_failure_that_is_found_before_it_is_announced_counts():
    assert detection([alarm(2, 1.5)], [lock(reported_at=2.0)], 4.0).found == 1
