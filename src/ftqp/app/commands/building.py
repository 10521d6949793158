"""``ftqp build``: the planner of a scenario, or of a robot, as a library in C, or as a page for browsers."""

import tempfile
from pathlib import Path
from typing import Any

from ftqp.app.output.console import ExitCode, answer, progress, say
from ftqp.core.errors import InputError, unknown

REMEMBERED = 20.0
"""The library of a robot keeps the way of the joints for so long, so that it has a way back [s]."""


def build(
    source: str,
    tip: str | None = None,
    folder: Path | None = None,
    target: str | None = None,
    cpu: str | None = None,
    embed: bool = False,
    parts: list[str] | None = None,
    small: bool = False,
    page: Path | None = None,
    overrides: list[str] | None = None,
    as_json: bool = False,
) -> ExitCode:
    """Build the planner as a library in C with headers and examples, or as a page for browsers.

    Options:
        source SCENARIO|ROBOT|FILE: A scenario, a robot of the catalog, a URDF or an MJCF.
        tip --tip FRAME: The controlled frame of a file; the only end if left out.
        folder -o --output FOLDER: The folder to make; --page does without.
        target --target NAME: host, x86-64-v3, aarch64 or wasm32; host, with --page wasm32.
        cpu --cpu NAME: A processor by LLVM's name, such as cortex-a76; else its class.
        embed --embed: Write the arm's file into arm.h, too, for boards without files.
        parts --with PART: A further part: path. Each library has a detector.
        small --small: A tenth of the memory: room for 8, 16 or 32 joints; compiles for minutes.
        page --page FILE: Write a page that runs the planner in a browser, no server.
    """
    from ftqp.app.deployment.built_folder import PARTS, TARGETS, BuildRequest, build_folder

    for part in parts or ():
        if part not in PARTS:
            raise unknown("part", part, "ftqp build", PARTS)
    target = target or ("host" if page is None else "wasm32")
    if target not in TARGETS:
        raise unknown("target", target, "ftqp build", TARGETS)
    if folder is None and page is None:
        raise InputError("nothing to make: give a folder with -o, or a file with --page")
    if page is not None and target != "wasm32":
        raise InputError(f"--page is for browsers, got --target {target}; leave it out, or give wasm32")
    name, planner, q, path = _planner_of(source, tip, overrides or ())
    if "path" in (parts or ()) and path is None:
        raise InputError(f"{name} is a robot and has no path; build a scenario, or leave --with path out")
    if "path" in (parts or ()) and planner.task.mode != "scaled":
        raise InputError(
            f"a path waits only in mode 'scaled', not {planner.task.mode!r}; give "
            "--set planner.task.mode=scaled, or leave --with path out"
        )
    say(f"compiling the planner of {name} for {target}; the first time takes minutes, later ones seconds")
    with progress(f"{name} for {target}", 1.0) as advance, tempfile.TemporaryDirectory() as aside:
        wanted = BuildRequest(
            planner=planner, name=name, target=target, cpu=cpu, embed=embed,
            folder=Path(aside) / "library" if folder is None else folder, small=small,
            path=path if "path" in (parts or ()) else None,
        )  # fmt: skip
        try:
            if page is None:
                bill = build_folder(wanted, advance)
            else:
                from ftqp.app.deployment.built_folder import write_page

                bill = write_page(wanted, q, path, page, advance)
        except OSError as error:
            raise InputError(
                f"{page or folder} cannot be made: {error.strerror or error}; give a place that is writable "
                f"with {'-o' if page is None else '--page'}"
            ) from error
    made = {"folder": folder and str(folder), "page": page and str(page)}
    answer({**made, **bill}, as_json, [_said(folder or page, bill)])
    for sentence in bill["left_out"]:
        say(f"left out: {sentence}")
    return ExitCode.DONE


def _planner_of(source: str, tip: str | None, overrides: Any) -> tuple[str, Any, Any, Any]:
    """Name, planner, start and path of a scenario; of a robot the plain planner, and no path."""
    from ftqp.app.commands.inspection import arm_of
    from ftqp.control.planner.planner import Planner
    from ftqp.model import catalog

    robot, setup = arm_of(source, tip, overrides)
    if setup is None:
        known = source.partition("(")[0] in catalog.names()
        return source if known else robot.name, Planner(robot, remember=REMEMBERED), robot.neutral, None
    if setup.world is not None:
        raise InputError(f"{source} has a base that moves, which a library in C does not; leave [base] out")
    return setup.name, setup.planner, setup.q, setup.path


def _said(made: Path | None, bill: dict[str, Any]) -> str:
    library = max((file for file in bill["files"] if file.startswith("lib/")), key=len)
    sizes = {name: bill["files"][name]["bytes"] / 1e3 for name in (library, "arm.ftqp")}
    listed = ", ".join(f"{name} {size:.0f} kB" for name, size in sizes.items())
    return f"{made}: {bill['robot']} ({bill['joints']} joints) for {bill['triple']}, {bill['cpu']}: {listed}"
