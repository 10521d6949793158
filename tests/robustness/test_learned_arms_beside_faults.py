"""Episodes of ``ftqp campaign wrong-model``, ``detection`` and ``strangers`` that once went wrong."""

import json

import pytest

from ftqp.app.campaign.episode_study import EpisodeWork, load_campaign


def episodes(*numbers):
    """The first of them with the other tests, the rest with the slow ones."""
    first, *rest = numbers
    return pytest.mark.parametrize(
        "number", [first, *(pytest.param(k, marks=pytest.mark.slow) for k in rest)]
    )


def row_of(study, number, *overrides):
    """An episode, judged."""
    campaign = load_campaign(study, overrides)
    return EpisodeWork(campaign=campaign).row_of(number, campaign.drawn(number)[0])


def broken(number, *overrides, study="wrong-model"):
    """What an episode breaks, in sentences."""
    row = row_of(study, number, *overrides)
    return "" if row["outcome"] == "sound" else row["sentences"]


@episodes(24, 48, 917, 932, 1341, 1919)
def test_arm_that_learns_its_rotors_keeps_its_speed_limits(number):
    """Beside a joint that swings freely a wrist whose rotor was learned came back at 2.2 times its limit.

    A healthy arm in an even motion took a load's place, and with it its rotors, for anything; one that hardly
    moved took the place for 20 cm beside a light wrist, which made up its inertia.
    """
    assert not broken(number)


def test_joints_that_an_impact_has_thrown_are_brought_back_without_their_brakes():
    """A free joint that struck its stop threw others, whose brakes then threw the next."""
    assert not broken(1583, "scenario.planner.detector=false")


@pytest.mark.parametrize("number", [1766, 1243])
def test_arm_that_holds_its_tip_beside_a_free_joint_with_friction_comes_to_rest(number):
    """One whose dry friction nobody knew was led to and fro about its balance for ever."""
    assert not broken(number)


@pytest.mark.slow
def test_wrist_does_not_swing_for_a_load_that_is_not_beside_it():
    assert not broken(1374)


@episodes(416, 714)
def test_lock_leaves_what_was_learned_before_it(number):
    """An arm that was told of a lock within its first second forgot all that it had learned, and ran away."""
    assert not broken(number)


@episodes(22, 129, 231, 269)
def test_healthy_arm_whose_samples_come_late_keeps_every_law(number):
    """4 ms late, which nobody had said: it swung at rest and left its speed limits."""
    assert not broken(number)


@episodes(111, 90, 677, 1020, 1677)
def test_position_servo_pulls_no_joint_back_faster_than_its_limit(number):
    """Its command stood where the joint had been before a blow threw it, by up to 0.23 rad."""
    assert not broken(number, study="detection")


@episodes(1322, 1052)
def test_position_arm_says_that_a_joint_is_outside_its_error_band(number):
    """It said OK until the evidence of a joint without motor had come up to what decides."""
    assert not broken(number, study="detection")


@pytest.mark.slow
@pytest.mark.parametrize(("number", "alarms"), [(684, 0), (248, 1)])
def test_weak_wrist_behind_a_velocity_servo_that_creeps_to_rest_is_hardly_said_to_be_locked(number, alarms):
    """Its friction was believed to be far below zero, so that nothing could hold it: six alarms, now one."""
    row = row_of("detection", number)
    assert row["outcome"] == "sound" and not row["wrong_joint"] and row["false_alarms"] <= alarms


@episodes(435, 952, 946)
def test_healthy_wrist_that_is_pushed_is_not_said_to_have_no_motor(number):
    """It came back slowly, or at an even speed, or fell faster than by its weight."""
    led = json.loads(row_of("strangers", number)["beside"])
    assert led["healthy"] and led["ftqp"]["finished"] and not led["ftqp"]["accused"]


@pytest.mark.slow
def test_healthy_wrist_that_a_push_holds_is_not_said_to_be_locked():
    """It stood 0.2 rad from its command for a while, and its servo sent 1.1 rad/s."""
    led = json.loads(row_of("strangers", 492)["beside"])
    assert led["healthy"] and led["ftqp"]["finished"] and not led["ftqp"]["accused"]
