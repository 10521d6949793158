"""Torque arms that were still learning their rotors went beyond their speed limits.

Beside a joint that swings freely a wrist came back to its command at up to 2.2 times its limit once its rotor
was learned, and a healthy arm in an even motion took a load's place, and with it its rotors, for anything.
Found by ``ftqp campaign wrong-model``, whose episodes these are.
"""

import pytest

from ftqp.app.campaign.episode_study import EpisodeWork, load_campaign


@pytest.mark.parametrize("number", [24, 917, 932])
def test_arm_that_learns_its_rotors_keeps_its_speed_limits(number):
    campaign = load_campaign("wrong-model")
    row = EpisodeWork(campaign=campaign).row_of(number, campaign.drawn(number)[0])
    assert row["outcome"] == "sound", row["sentences"]
