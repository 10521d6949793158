"""A healthy torque arm in an even motion took a load's place, and with it its rotors, for anything.

It shook itself beyond its speed limits. Found by ``ftqp campaign wrong-model``, whose episode this is.
"""

from ftqp.app.campaign.episode_study import EpisodeWork, load_campaign


def test_arm_in_an_even_motion_keeps_its_speed_limits():
    campaign = load_campaign("wrong-model")
    row = EpisodeWork(campaign=campaign).row_of(932, campaign.drawn(932)[0])
    assert row["outcome"] == "sound", row["sentences"]
