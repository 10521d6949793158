"""The command line of what is looked at in a browser: ``ftqp view``."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated

import typer

from ftqp.app.commands.options import Backend, Json, Overrides, PlanFile, Scheme
from ftqp.app.output.console import ExitCode


def view(
    source: Annotated[
        str,
        typer.Argument(
            metavar="[SCENARIO|RUN|COVERAGE]",
            help="A scenario, or the folder of a run or of a coverage report.",
        ),
    ] = "panda-circle",
    backend: Backend = None,
    scheme: Scheme = None,
    overrides: Overrides = None,
    plan: PlanFile = None,
    host: Annotated[
        str, typer.Option(metavar="ADDRESS", help="Where to listen; others than this machine see the page.")
    ] = "127.0.0.1",
    port: Annotated[
        int, typer.Option(metavar="N", help="The port; if it is in use, the next free one.")
    ] = 8080,
    speed: Annotated[float, typer.Option(metavar="X", help="Simulated seconds in a second.")] = 1.0,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Open no browser.")] = False,
    record: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A new .html file for a recording, written at the end."),
    ] = None,
    no_twin: Annotated[
        bool, typer.Option("--no-twin", help="Leave out the arm whose planner is never told.")
    ] = False,
    meshes: Annotated[
        str, typer.Option(metavar="KIND", help="Meshes of a URDF that are drawn: collision, visual or none.")
    ] = "collision",
    as_json: Json = False,
) -> ExitCode:
    """Open a page where an arm moves and a click breaks a joint; replay a run, or a failure of a report."""
    from ftqp.app.commands import viewing
    from ftqp.sim.session.session_arms import Choice

    choice = Choice(
        scenario=source,
        overrides=tuple(overrides or ()),
        plan=None if plan is None else str(plan),
        scheme=scheme,
        backend=backend,
    )
    return viewing.view(
        choice, host=host, port=port, speed=speed, browser=not no_browser, record=record, twin=not no_twin,
        meshes=meshes, as_json=as_json,
    )  # fmt: skip


PAGES: Mapping[Callable[..., ExitCode], str] = {view: "Example: ftqp view panda-circle --port 8080"}
"""Each with its example."""
