"""One scenario run and judged as an episode of a campaign is: what a test of a mended defect asks."""

import tomllib
from pathlib import Path

from ftqp.app.campaign.episode_study import RAISED, Campaign, CampaignFile, EpisodeWork
from ftqp.app.schema.reading import read
from ftqp.core.errors import ScenarioError


def broken_laws(text, judged="exactly", calm=None):
    """The laws that a scenario, the text of a TOML file, breaks, each with a sentence that says how.

    Files are relative to the working directory; ``judged`` and ``calm`` are keys of the table ``[campaign]``.
    """
    campaign = {"episodes": 1, "judged": judged, "calm": calm}
    content = {"campaign": campaign, "scenario": tomllib.loads(text), "vary": {}}
    tables = read(CampaignFile, content, "the scenario cannot be judged:")
    work = EpisodeWork(campaign=Campaign(name="scenario", tables=tables, text=text, folder=Path()))
    row = work.row_of(0, tables.scenario)
    if row["outcome"] == RAISED:
        return {row["sentences"].partition(":")[0]: row["sentences"]}
    if row["outcome"] == "refused":
        raise ScenarioError(row["sentences"])
    return {line.partition(" ")[0]: line for line in row["sentences"].splitlines()}
