"""Random closed-loop episodes: whatever is drawn, nothing raises and every limit is kept.

``FTQP_EPISODES`` sets how many (200 by default, 2,000 by ``make campaign``).
"""

import os

import pytest
from tests.laws.episode import run

EPISODES = int(os.environ.get("FTQP_EPISODES", "200"))
GROUP = 20


@pytest.mark.parametrize("group", range((EPISODES + GROUP - 1) // GROUP))
def test_every_law_holds_in_random_episodes(group: int) -> None:
    for seed in range(group * GROUP, min((group + 1) * GROUP, EPISODES)):
        episode = run(seed)
        assert not episode.broken, f"seed {seed}: {episode.description}: {episode.broken}"
        assert episode.ticks == sum(episode.statuses.values())
