"""A campaign: a scenario, what of it is drawn anew for every episode, and how many episodes there are."""

from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from ftqp.app.schema.reading import Table
from ftqp.app.schema.scenario_file import Scenario
from ftqp.core.setting import REQUIRED, keys_of, setting


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodesTable(Table):
    """How many episodes, of which numbers, judged how."""

    episodes: int = setting(1000, "how many there are, 1 to 10,000,000", least=1.0, most=1e7)
    seed: int = setting(0, "of all draws: another one gives other episodes, >= 0", least=0.0)
    judged: Literal["exactly", "in physics", "beside a rival"] = setting(
        "exactly",
        "'exactly' to rounding, for arms that follow exactly; 'in physics' with 2 % on "
        "limits and 0.1 s to notice what happened; 'beside a rival' by what a user sees of the arm, also "
        "where it is led by damped least squares",
    )
    calm: float | None = setting(
        None,
        "how long an arm may take to come to rest where its target rests, > 0; 1 s exactly, 2 s "
        "in physics if absent",
        unit="s",
        above=0.0,
        most=1e6,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignFile(Table):
    """A whole campaign."""

    whole: ClassVar[str] = "a campaign"
    inside: ClassVar[tuple[str, tuple[str, ...]]] = ("scenario", tuple(keys_of(Scenario)))

    description: str = setting("", "what a reader should know")
    campaign: EpisodesTable = setting(EpisodesTable(), "how many episodes, of which numbers")
    scenario: dict[str, Any] = setting(REQUIRED, "the tables of a scenario, as in a scenario's file")
    bundles: dict[str, Any] = setting(
        {}, "by group and name, values of keys that are drawn together, with a weight"
    )
    vary: dict[str, Any] = setting(
        REQUIRED, "keys of the scenario such as 'planner.dt', each with a list of values or a distribution"
    )
