"""A campaign: a scenario, what of it is drawn anew for every episode, and how many episodes there are."""

from typing import Any, ClassVar, Literal

from pydantic import Field

from ftqp.app.schema.strict import Table, unit


class EpisodesTable(Table):
    """How many episodes, of which numbers, judged how."""

    episodes: int = Field(1000, ge=1, le=10_000_000, description="how many there are, 1 to 10,000,000")
    seed: int = Field(0, ge=0, description="of all draws: another one gives other episodes, >= 0")
    judged: Literal["exactly", "in physics"] = Field(
        "exactly",
        description="'exactly' to rounding, for arms that do what they are told; 'in physics' with 2 % on "
        "limits and 0.1 s to notice what happened",
    )
    calm: float | None = Field(
        None,
        gt=0,
        le=1e6,
        description="how long an arm may take to come to rest where its target rests, > 0; 1 s exactly, 2 s "
        "in physics if absent",
        json_schema_extra=unit("s"),
    )


class CampaignFile(Table):
    """A whole campaign."""

    whole: ClassVar[str] = "a campaign"

    description: str = Field("", description="what a reader should know")
    campaign: EpisodesTable = Field(EpisodesTable(), description="how many episodes, of which numbers")
    scenario: dict[str, Any] = Field(description="the tables of a scenario, as in a scenario's file")
    vary: dict[str, Any] = Field(
        description="keys of the scenario such as 'planner.dt', each with a list of values or a distribution"
    )
