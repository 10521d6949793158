"""Options that several commands of the command line have."""

from pathlib import Path
from typing import Annotated

import typer

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout and nothing else.")]
NoFigures = Annotated[
    bool,
    typer.Option("--no-figures", help="Draw nothing: a short run, or the facts of an arm, take less time."),
]
Source = Annotated[
    str, typer.Argument(metavar="SCENARIO", help="A scenario file, or the name of a bundled one.")
]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="A.B=VALUE", help="Replace a value of the scenario (A.B= takes it out); repeatable."
    ),
]
Backend = Annotated[
    str | None, typer.Option(metavar="NAME", help="QP backend or profile file, in place of the scenario's.")
]
Scheme = Annotated[str | None, typer.Option(metavar="NAME", help="Scheme, in place of the scenario's.")]
Out = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Folder to make; runs/<scenario>-<time> if left out.")
]
StudyOut = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="DIR",
        help="Folder to make, or one with results of this very study to go on with; a new one, "
        "runs/<study>-<time>, if left out.",
    ),
]

PlanFile = Annotated[
    Path | None, typer.Option("--plan", metavar="FILE", help="A trajectory, made by ftqp plan -o FILE.")
]
Jobs = Annotated[
    int | None,
    typer.Option(metavar="N", help="Processes; all cores if left out and the work is long."),
]
Dask = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Compute on the workers of this Dask scheduler.")
]
Resume = Annotated[bool, typer.Option("--resume", help="Go on from what an interrupted run has kept.")]
Mtbf = Annotated[
    str | None,
    typer.Option(metavar="HOURS", help="Mean time between failures of a joint, or joint=hours,..."),
]
