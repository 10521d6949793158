"""``ftqp campaign``: many episodes drawn from one scenario, resumable, each judged from outside."""

from typing import Annotated, Any, Final

import typer

from ftqp.app.commands.options import Dask, Jobs, Json, Overrides, StudyOut
from ftqp.app.output.console import ExitCode
from ftqp.core.errors import InputError

NUMBERS: Final = 1_000_000_000
"""Numbers of episodes are below this."""


def campaign(
    study: Annotated[
        str, typer.Argument(metavar="STUDY", help="A campaign file, or the name of a bundled one: safety.")
    ],
    overrides: Overrides = None,
    episodes: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help="How many episodes there are in all; more of them go on with those in --out.",
        ),
    ] = None,
    out: StudyOut = None,
    jobs: Jobs = None,
    dask: Dask = None,
    table: Annotated[
        bool, typer.Option("--table", help="Print how often each law was broken, value by value.")
    ] = False,
    replay: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help="Run this episode alone, with log and figures, and judge it.",
        ),
    ] = None,
    as_json: Json = False,
) -> ExitCode:
    """Run a campaign of random episodes, or go on with that in --out; every one is judged from outside."""
    from ftqp.app.campaign.episode_study import load_campaign
    from ftqp.app.campaign.kept_campaign import command_of
    from ftqp.app.commands.campaign_episodes import replay_episode, run_episodes

    more = () if episodes is None else (f"campaign.episodes={episodes}",)
    made = load_campaign(study, (*(overrides or ()), *more))
    if replay is not None:
        return replay_episode(made, _numbered(made, replay), out, as_json=as_json)
    command = command_of(study, overrides or ())
    return run_episodes(made, command, out, jobs=jobs, dask=dask, table=table, as_json=as_json)


def _numbered(made: Any, number: int) -> int:
    """The number of an episode, which the seed defines however many episodes were asked for."""
    if not 0 <= number < NUMBERS:
        raise InputError(f"episode {number} is none of {made.name}, expected 0 to {NUMBERS - 1}")
    return number
