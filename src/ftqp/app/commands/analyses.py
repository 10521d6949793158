"""The commands that look ahead: ``ftqp converge, workspace, calibrate, coverage, plan``."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from ftqp.app.commands.options import (
    Dask,
    Jobs,
    Json,
    Mtbf,
    Out,
    Overrides,
    PlanFile,
    Resume,
    Source,
    StudyOut,
)
from ftqp.app.output.console import ExitCode, Table, answer, say
from ftqp.app.scenario import document
from ftqp.core.errors import InputError


def tell_bundled(kind: str, key: str, as_json: bool) -> ExitCode:
    """The bundled files of a kind with their stories."""
    found = document.bundled(kind)
    answer({key: found}, as_json, [Table(f"Bundled {key}", ("name", "story"), list(found.items()))])
    return ExitCode.DONE


def converge(
    scenario: Source, overrides: Overrides = None, out: Out = None, as_json: Json = False
) -> ExitCode:
    """Explain where an arm ends up that does not know of its locked joint, and why."""
    from ftqp.app.commands import convergence
    from ftqp.app.run.runs import free_folder
    from ftqp.app.scenario.setup import load

    folder = free_folder(out, f"converge-{Path(scenario).stem}")
    return convergence.converge(load(scenario, overrides or ()), folder, as_json=as_json)


def workspace(
    study: Annotated[
        str | None, typer.Argument(metavar="[STUDY]", help="A study's file, or the name of a bundled one.")
    ] = None,
    overrides: Overrides = None,
    out: StudyOut = None,
    jobs: Jobs = None,
    dask: Dask = None,
    as_json: Json = False,
) -> ExitCode:
    """Map which starts are safe if a joint locks and nobody notices; without a study, list the bundled."""
    if study is None:
        return tell_bundled("study", "studies", as_json)
    from ftqp.app.commands.mapping import map_workspace

    return map_workspace(study, overrides or (), out, jobs=jobs, dask=dask, as_json=as_json)


def calibrate(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN...", help="Folders of runs of the healthy arm.")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="The calibration to make.")],
    alarms: Annotated[
        float | None, typer.Option(metavar="RATE", help="Has no effect any more; it will go.", hidden=True)
    ] = None,
    extrapolate: Annotated[
        bool, typer.Option("--extrapolate", help="Has no effect any more; it will go.", hidden=True)
    ] = False,
    as_json: Json = False,
) -> ExitCode:
    """Learn noise and friction from runs of the healthy arm, with which a torque drive begins."""
    from ftqp.app.run.runs import SCENARIO
    from ftqp.app.scenario.setup import load
    from ftqp.app.schema.reading import Options
    from ftqp.control.planner.response.detector import Detector
    from ftqp.sim.log.log_file import load_log

    if out.exists():
        raise InputError(f"{out} exists, and nothing is overwritten; name another one by --out")
    scenario = runs[0] / SCENARIO
    if not scenario.is_file():
        raise InputError(f"{runs[0]} has no {SCENARIO}; expected the folder of a run, `ftqp run` makes one")
    logs = [load_log(run) for run in runs]
    setup = load(str(scenario))
    planner, table = setup.planner, setup.tables.planner.detector
    settings = table.made(calibration=None) if isinstance(table, Options) else Detector()
    blank = settings.for_arm(planner.robot, planner.dt, drive=planner.drive, noise=planner.noise)
    found = blank.calibrate(logs).calibration
    if alarms is not None or extrapolate:
        say("note: --alarms and --extrapolate have no effect any more: no threshold is made from runs")
    assert found is not None
    found.save(out)
    friction = dict(zip(found.joints, found.coulomb.tolist(), strict=True))
    facts = {
        "file": str(out), "hours": found.hours, "noise": found.sigma, "friction": friction,
    }  # fmt: skip
    shown = [str(found), f"The encoders' noise is {found.sigma:.2g} rad."]
    if found.coulomb.any():
        shown.append(f"Coulomb friction [N m]: {', '.join(f'{j} {f:.2g}' for j, f in friction.items())}.")
    elif not as_json:
        say("note: no friction was found; runs without torques do not show any")
    shown.append(f"{out}: use it by calibration = {str(out)!r} in [planner.detector]")
    answer(facts, as_json, shown)
    return ExitCode.DONE


def coverage(
    scenario: Source,
    plan: PlanFile = None,
    stride: Annotated[int, typer.Option(metavar="N", help="Look at every so-many-th sample.")] = 4,
    lock: Annotated[
        str, typer.Option(metavar="HOW", help="instant, or ramp: the joint brakes first.")
    ] = "instant",
    fault: Annotated[
        str,
        typer.Option(
            metavar="KIND", help="locked, degraded: half its speed is left, or free_swinging: no torque is."
        ),
    ] = "locked",
    post: Annotated[
        str | None,
        typer.Option(
            metavar="HOW", help="How the others go on: exact, qp, or planner: it is run, which takes long."
        ),
    ] = None,
    rows: Annotated[
        str | None,
        typer.Option(
            metavar="ROWS", help="Kept after a failure: position_axis or position; all if left out."
        ),
    ] = None,
    pairs: Annotated[bool, typer.Option("--pairs", help="Two joints fail together.")] = False,
    task: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Of several tasks, the one whose frame is looked at; the end effector if left out.",
        ),
    ] = None,
    bound: Annotated[
        int | None,
        typer.Option(metavar="N", help="Look at so many samples how many joints any posture can do without."),
    ] = None,
    mtbf: Mtbf = None,
    overrides: Overrides = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder to make; runs/coverage-<scenario>-<time> if left out."),
    ] = None,
    jobs: Jobs = None,
    dask: Dask = None,
    resume: Resume = False,
    as_json: Json = False,
) -> ExitCode:
    """Say which failures a motion survives, each joint at each instant; writes a page and pictures."""
    from ftqp.app.commands.covering import cover

    settings = {"stride": stride, "lock": lock, "fault": fault, "rows": rows, "upper_bound": bound}
    settings |= {"joints": "pairs"} if pairs else {}
    return cover(
        scenario, overrides or (), plan, out, settings=settings | {"post": post}, mtbf=mtbf, jobs=jobs,
        dask=dask, resume=resume, as_json=as_json, name=task,
    )  # fmt: skip


def plan(
    scenario: Source,
    file: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="A new .npz file.")],
    method: Annotated[
        str,
        typer.Option(metavar="NAME", help="dp, spline, gradient or constant: how joints to spare are used."),
    ] = "dp",
    start: Annotated[
        str, typer.Option(metavar="WHERE", help="free: the best start posture; given: the scenario's.")
    ] = "free",
    optimise: Annotated[
        str | None,
        typer.Option(metavar="A,B", help="What may move apart from the start: yaw of the tool, base."),
    ] = None,
    waypoints: Annotated[int | None, typer.Option(metavar="N", help="Of dp: parts of the path.")] = None,
    spacing: Annotated[
        float | None, typer.Option(metavar="RAD", help="Of dp: arc length between postures.")
    ] = None,
    nodes: Annotated[
        int | None,
        typer.Option(metavar="N", help="Of dp with two or more joints to spare: postures of a waypoint."),
    ] = None,
    share: Annotated[
        float | None, typer.Option(metavar="S", help="Of dp: share of the joints' speed that is used, to 1.")
    ] = None,
    stride: Annotated[int | None, typer.Option(metavar="N", help="Verify every so-many-th sample.")] = None,
    seed: Annotated[int, typer.Option(metavar="K", help="Of random starts.")] = 0,
    mtbf: Mtbf = None,
    overrides: Overrides = None,
    report: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder to make for page and pictures.")
    ] = None,
    as_json: Json = False,
) -> ExitCode:
    """Find a motion along the path that survives more failures; `ftqp run --plan FILE` runs it."""
    from ftqp.app.commands.planning import make_plan
    from ftqp.app.run.runs import free_folder

    folder = None if report is None else free_folder(report, "plan")
    given = {"waypoints": waypoints, "spacing": spacing, "nodes": nodes, "share": share, "stride": stride}
    knobs = {name: value for name, value in given.items() if value is not None}
    return make_plan(
        scenario, overrides or (), file, folder, method=method, start=start, optimise=optimise, seed=seed,
        knobs=knobs, mtbf=mtbf, as_json=as_json,
    )  # fmt: skip


ANALYSES: dict[Callable[..., ExitCode], str] = {
    calibrate: "Example: ftqp calibrate runs/healthy-1 runs/healthy-2 --out healthy.json",
    converge: "Example: ftqp converge planar3-unidentified --set faults.0.at=2.0",
    workspace: "Example: ftqp workspace planar3-map --out runs/map --jobs 2",
    coverage: "Example: ftqp coverage panda-y-line --plan plan.npz --out runs/coverage",
    plan: "Example: ftqp plan panda-y-line -o plan.npz --report runs/plan",
}
"""Each command with an example of it."""
