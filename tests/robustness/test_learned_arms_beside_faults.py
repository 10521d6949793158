"""Torque arms that learn what they are went beyond their speed limits, or swung beside a joint without motor.

Beside a joint that swings freely a wrist came back to its command at up to 2.2 times its limit once its rotor
was learned, and a healthy arm in an even motion took a load's place, and with it its rotors, for anything; an
arm that hardly moved yet took the place for 20 cm beside a light wrist, which made up its inertia. A free
joint that struck its stop threw others, whose brakes then threw the next; and one whose dry friction nobody
knew was led to and fro about its balance for ever.
Found by ``ftqp campaign wrong-model``, whose episodes these are.
"""

import pytest

from ftqp.app.campaign.episode_study import EpisodeWork, load_campaign


def broken(number):
    """What an episode breaks, in sentences."""
    campaign = load_campaign("wrong-model")
    row = EpisodeWork(campaign=campaign).row_of(number, campaign.drawn(number)[0])
    return "" if row["outcome"] == "sound" else row["sentences"]


@pytest.mark.parametrize("number", [24, 48, 917, 932, 1341, 1919])
def test_arm_that_learns_its_rotors_keeps_its_speed_limits(number):
    assert not broken(number)


def test_joints_that_an_impact_has_thrown_are_brought_back_without_their_brakes():
    assert not broken(1583)


@pytest.mark.parametrize("number", [1243, 1766])
def test_arm_that_holds_its_tip_beside_a_free_joint_with_friction_comes_to_rest(number):
    assert not broken(number)


def test_wrist_does_not_swing_for_a_load_that_is_not_beside_it():
    assert not broken(1374)
