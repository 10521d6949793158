"""Random closed-loop episodes: whatever is drawn, nothing raises and every limit is kept.

Each is judged twice: by what the planner says of itself, and from outside by ``ftqp.referee``.

``FTQP_EPISODES`` sets how many (200 by default, 2,000 by ``make campaign``).
"""

import os

import pytest
from tests.laws.episode import run

from ftqp.referee.model_file import ModelFile
from ftqp.referee.verdict_from_outside import verdict

EPISODES = int(os.environ.get("FTQP_EPISODES", "200"))
GROUP = 20


@pytest.mark.parametrize("group", range((EPISODES + GROUP - 1) // GROUP))
def test_every_law_holds_in_random_episodes(group: int) -> None:
    arms: dict[str, ModelFile] = {}
    for seed in range(group * GROUP, min((group + 1) * GROUP, EPISODES)):
        episode = run(seed)
        assert not episode.broken, f"seed {seed}: {episode.description}: {episode.broken}"
        assert episode.ticks == sum(episode.statuses.values())
        robot = episode.robot
        if robot.name not in arms:
            arms[robot.name] = ModelFile.read(robot.to_urdf(), robot.tip, gravity=robot.chain.gravity)
        seen = verdict(arms[robot.name], episode.evidence)
        assert not seen.breaches, f"seed {seed}: {episode.description}: {[str(x) for x in seen.breaches]}"
