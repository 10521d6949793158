"""Random closed-loop episodes: whatever is drawn, nothing raises and every limit is kept.

Each is judged twice: by what the planner says of itself, and from outside by ``ftqp.checker``.

Forty go with the other tests, a hundred and sixty more with the slow ones; ``FTQP_EPISODES`` sets how many
there are in all.
"""

import os

import pytest
from tests.laws.episode import run

from ftqp.checker.checked_run import verdict
from ftqp.checker.model_file import ModelFile

EPISODES = int(os.environ.get("FTQP_EPISODES", "200"))
GROUP, QUICK = 20, 2
GROUPS = range((EPISODES + GROUP - 1) // GROUP)


@pytest.mark.long
@pytest.mark.parametrize(
    "group", [k if k < QUICK else pytest.param(k, marks=pytest.mark.slow) for k in GROUPS]
)
def test_every_law_holds_in_random_episodes(group: int) -> None:
    arms: dict[str, ModelFile] = {}
    for seed in range(group * GROUP, min((group + 1) * GROUP, EPISODES)):
        episode = run(seed, everything=group >= 5)
        assert not episode.broken, f"seed {seed}: {episode.description}: {episode.broken}"
        assert episode.ticks == sum(episode.statuses.values())
        robot = episode.robot
        if robot.name not in arms:
            arms[robot.name] = ModelFile.read(robot.to_urdf(), robot.tip, gravity=robot.chain.gravity)
        seen = verdict(arms[robot.name], episode.trace)
        breaches = [str(x) for x in seen.breaches]
        assert not breaches, f"seed {seed}: {breaches}"
