"""One scenario run and judged as an episode of a campaign is: what a test of a mended defect asks."""

import tomllib
from pathlib import Path
from typing import Any, Literal

from ftqp.app.campaign.episode_study import RAISED, Campaign, EpisodeWork
from ftqp.app.schema.campaign_file import CampaignFile
from ftqp.app.schema.reading import read
from ftqp.core.errors import ScenarioError


def broken_laws(
    text: str,
    judged: Literal["exactly", "in physics", "beside a rival"] = "exactly",
    calm: float | None = None,
) -> dict[str, str]:
    """The laws that a scenario breaks, each with a sentence that says when, where and by how much.

    Args:
        text: The scenario as a TOML file has it; files are relative to the working directory.
        judged: As in the table ``[campaign]``.
        calm: As in the table ``[campaign]`` [s].
    """
    campaign = {"episodes": 1, "judged": judged, "calm": calm}
    content = {"campaign": campaign, "scenario": tomllib.loads(text), "vary": {}}
    tables = read(CampaignFile, content, "the scenario cannot be judged:")
    work = EpisodeWork(campaign=Campaign(name="scenario", tables=tables, text=text, folder=Path()))
    return broken_by(work, tables.scenario)


def broken_by(work: EpisodeWork, content: dict[str, Any]) -> dict[str, str]:
    """The same for the tables of an episode; an exception counts as a law of its own name."""
    row = work.row_of(0, content)
    if row["outcome"] == RAISED:
        return {row["sentences"].partition(":")[0]: row["sentences"]}
    if row["outcome"] == "refused":
        raise ScenarioError(row["sentences"])
    return {line.partition(" ")[0]: line for line in row["sentences"].splitlines()}
