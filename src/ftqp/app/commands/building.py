"""``ftqp build``: the planner of a scenario, or of a robot, as a library in C."""

from pathlib import Path
from typing import Annotated, Any

import typer

from ftqp.app.commands.options import Json, Overrides
from ftqp.app.output.console import ExitCode, answer, progress, say, tell
from ftqp.core.errors import InputError, unknown


def build(
    source: Annotated[
        str, typer.Argument(metavar="SCENARIO|ROBOT", help="A scenario, or a robot of the catalog.")
    ],
    folder: Annotated[Path, typer.Option("-o", "--output", metavar="FOLDER", help="The folder to make.")],
    target: Annotated[str, typer.Option(metavar="NAME", help="host, x86-64-v3, aarch64 or wasm32.")] = "host",
    cpu: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="A processor by LLVM's name, such as cortex-a76; else its class."),
    ] = None,
    embed: Annotated[
        bool, typer.Option("--embed", help="Write the arm's file into arm.h, too, for boards without files.")
    ] = False,
    overrides: Overrides = None,
    as_json: Json = False,
) -> ExitCode:
    """Build the planner as a library in C, with headers, the arm's file and examples that run."""
    from ftqp.app.deployment.built_folder import TARGETS, Wanted, build_folder

    if target not in TARGETS:
        raise unknown("target", target, "ftqp build", TARGETS)
    name, planner = _planner_of(source, overrides or ())
    with progress(f"{name} for {target}", 1.0):
        wanted = Wanted(planner=planner, name=name, target=target, cpu=cpu, embed=embed, folder=folder)
        bill = build_folder(wanted)
    answer({"folder": str(folder), **bill}, as_json, lambda: tell(_said(folder, bill)))
    for sentence in bill["left_out"]:
        say(f"left out: {sentence}")
    return ExitCode.DONE


def _planner_of(source: str, overrides: Any) -> tuple[str, Any]:
    """The planner of a scenario, or the plain one of a robot, by name."""
    from ftqp.control.planner.planner import Planner
    from ftqp.model import catalog

    if source.partition("(")[0] in catalog.names():
        if overrides:
            raise InputError(f"{source} is a robot, no scenario, so that --set has nothing to change")
        return source, Planner(catalog.load(source))
    from ftqp.app.scenario.setup import load

    setup = load(source, overrides)
    if setup.world is not None:
        raise InputError(f"{source} has a base that moves, which a library in C does not; leave [base] out")
    return setup.name, setup.planner


def _said(folder: Path, bill: dict[str, Any]) -> str:
    library = max((file for file in bill["files"] if file.startswith("lib/")), key=len)
    sizes = {name: bill["files"][name]["bytes"] / 1e3 for name in (library, "arm.ftqp")}
    listed = ", ".join(f"{name} {size:.0f} kB" for name, size in sizes.items())
    return (
        f"{folder}: {bill['robot']} ({bill['joints']} joints) for {bill['triple']}, {bill['cpu']}: {listed}"
    )
