"""A torque arm that was told of a lock within its first second forgot all that it had learned, and ran away.

Found by ``ftqp campaign wrong-model``, whose episodes these are.
"""

import pytest

from ftqp.app.campaign.episode_study import EpisodeWork, load_campaign


@pytest.mark.parametrize("number", [416, 714])
def test_lock_leaves_what_was_learned_before_it(number):
    campaign = load_campaign("wrong-model")
    row = EpisodeWork(campaign=campaign).row_of(number, campaign.drawn(number)[0])
    assert row["outcome"] == "sound", row["sentences"]
