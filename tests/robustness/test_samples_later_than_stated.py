"""Torque arms whose samples came 4 ms late, which nobody had said, swung at rest and left their speed limits.

Found by ``ftqp campaign wrong-model``, whose episodes these are.
"""

import pytest

from ftqp.app.campaign.episode_study import EpisodeWork, load_campaign


@pytest.mark.parametrize("number", [22, 129, 231, 269])
def test_healthy_arm_whose_samples_come_late_keeps_every_law(number):
    campaign = load_campaign("wrong-model")
    row = EpisodeWork(campaign=campaign).row_of(number, campaign.drawn(number)[0])
    assert row["outcome"] == "sound", row["sentences"]
