"""The commands that look ahead or compute long: their options, and what does the work, loaded late."""

from collections.abc import Callable
from pathlib import Path

from ftqp.app.output.console import ExitCode, Table, answer, say
from ftqp.app.scenario import document
from ftqp.core.errors import InputError
from ftqp.core.whole_file import free_path

NUMBERS = 1_000_000_000
"""Numbers of episodes are below this, however many were asked for."""


def tell_bundled(kind: str, key: str, as_json: bool) -> ExitCode:
    """The bundled files of a kind with their stories."""
    found = document.bundled(kind)
    answer({key: found}, as_json, [Table(f"Bundled {key}", ("name", "story"), list(found.items()))])
    return ExitCode.DONE


def converge(
    scenario: str, overrides: list[str] | None = None, out: Path | None = None, as_json: bool = False
) -> ExitCode:
    """Explain where an arm ends up that does not know of its locked joint, and why."""
    from ftqp.app.commands import convergence
    from ftqp.app.run.runs import free_folder
    from ftqp.app.scenario.setup import load

    folder = free_folder(out, f"converge-{Path(scenario).stem}")
    return convergence.converge(load(scenario, overrides or ()), folder, as_json=as_json)


def workspace(
    study: str | None = None,
    overrides: list[str] | None = None,
    out: Path | None = None,
    jobs: int | None = None,
    dask: str | None = None,
    as_json: bool = False,
) -> ExitCode:
    """Map which starts are safe if a joint locks and nobody notices; without a study, list the bundled.

    Options:
        study [STUDY]: A study's file, or the name of a bundled one.
        out --out DIR: Folder to make, or one with results of this very study to go on with; a new one,
            runs/<study>-<time>, if left out.
    """
    if study is None:
        return tell_bundled("study", "studies", as_json)
    from ftqp.app.commands.mapping import map_workspace

    return map_workspace(study, overrides or (), out, jobs=jobs, dask=dask, as_json=as_json)


def calibrate(runs: list[Path], out: Path, as_json: bool = False) -> ExitCode:
    """Learn noise and friction from runs of the healthy arm, with which a torque drive begins.

    Options:
        runs RUN...: Folders of runs of the healthy arm.
        out --out FILE: The calibration to make.
    """
    from ftqp.app.run.runs import SCENARIO
    from ftqp.app.scenario.setup import load
    from ftqp.app.schema.reading import Options
    from ftqp.control.planner.detector import Detector
    from ftqp.sim.log.log_file import load_log

    free_path(out, "calibration")
    scenario = runs[0] / SCENARIO
    if not scenario.is_file():
        raise InputError(f"{runs[0]} has no {SCENARIO}; expected the folder of a run, `ftqp run` makes one")
    logs = [load_log(run) for run in runs]
    setup = load(str(scenario))
    planner, table = setup.planner, setup.tables.planner.detector
    settings = table.made(calibration=None) if isinstance(table, Options) else Detector()
    blank = settings.for_arm(planner.robot, planner.dt, drive=planner.drive, noise=planner.noise)
    found = blank.calibrate(logs).calibration
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
    scenario: str,
    plan: Path | None = None,
    stride: int = 4,
    lock: str = "instant",
    fault: str = "locked",
    post: str | None = None,
    rows: str | None = None,
    pairs: bool = False,
    task: str | None = None,
    bound: int | None = None,
    mtbf: str | None = None,
    overrides: list[str] | None = None,
    out: Path | None = None,
    jobs: int | None = None,
    dask: str | None = None,
    resume: bool = False,
    as_json: bool = False,
) -> ExitCode:
    """Say which failures a motion survives, each joint at each instant; writes a page and pictures.

    Options:
        stride --stride N: Look at every so-many-th sample.
        lock --lock HOW: instant, or ramp: the joint brakes first.
        fault --fault KIND: locked, degraded: half its speed is left, or free_swinging: no torque is.
        post --post HOW: How the others go on: exact, qp, or planner: it is run, which takes long.
        rows --rows ROWS: Kept after a failure: position_axis or position; all if left out.
        pairs --pairs: Two joints fail together.
        task --task NAME: Of several tasks, the one whose frame is looked at; the end effector if left out.
        bound --bound N: Look at so many samples how many joints any posture can do without.
        out --out DIR: Folder to make; runs/coverage-<scenario>-<time> if left out.
    """
    from ftqp.app.commands.covering import cover

    settings = {"stride": stride, "lock": lock, "fault": fault, "rows": rows, "upper_bound": bound}
    settings |= {"joints": "pairs"} if pairs else {}
    return cover(
        scenario, overrides or (), plan, out, settings=settings | {"post": post}, mtbf=mtbf, jobs=jobs,
        dask=dask, resume=resume, as_json=as_json, name=task,
    )  # fmt: skip


def plan(
    scenario: str,
    file: Path,
    method: str = "dp",
    start: str = "free",
    optimise: str | None = None,
    waypoints: int | None = None,
    spacing: float | None = None,
    nodes: int | None = None,
    share: float | None = None,
    stride: int | None = None,
    seed: int = 0,
    mtbf: str | None = None,
    overrides: list[str] | None = None,
    report: Path | None = None,
    as_json: bool = False,
) -> ExitCode:
    """Find a motion along the path that survives more failures; `ftqp run --plan FILE` runs it.

    Options:
        file -o --output FILE: A new .npz file.
        method --method NAME: dp, spline, gradient or constant: how joints to spare are used.
        start --start WHERE: free: the best start posture; given: the scenario's.
        optimise --optimise A,B: What may move apart from the start: yaw of the tool, base.
        waypoints --waypoints N: Of dp: parts of the path.
        spacing --spacing RAD: Of dp: arc length between postures.
        nodes --nodes N: Of dp with two or more joints to spare: postures of a waypoint.
        share --share S: Of dp: share of the joints' speed that is used, to 1.
        stride --stride N: Verify every so-many-th sample.
        seed --seed K: Of random starts.
        report --report DIR: Folder to make for page and pictures.
    """
    from ftqp.app.commands.covering import make_plan
    from ftqp.app.run.runs import free_folder

    folder = None if report is None else free_folder(report, "plan")
    given = {"waypoints": waypoints, "spacing": spacing, "nodes": nodes, "share": share, "stride": stride}
    knobs = {name: value for name, value in given.items() if value is not None}
    return make_plan(
        scenario, overrides or (), file, folder, method=method, start=start, optimise=optimise, seed=seed,
        knobs=knobs, mtbf=mtbf, as_json=as_json,
    )  # fmt: skip


def campaign(
    study: str,
    overrides: list[str] | None = None,
    episodes: int | None = None,
    out: Path | None = None,
    jobs: int | None = None,
    dask: str | None = None,
    table: bool = False,
    replay: int | None = None,
    as_json: bool = False,
) -> ExitCode:
    """Run a campaign of random episodes, or go on with that in --out; every one is judged from outside.

    Options:
        study STUDY: A campaign file, or the name of a bundled one: safety.
        out --out DIR: Folder to make, or one with results of this very study to go on with; a new one,
            runs/<study>-<time>, if left out.
        episodes --episodes N: How many episodes there are in all; more of them go on with those in --out.
        table --table: Print how often each law was broken, value by value.
        replay --replay N: Run this episode alone, with log and figures, and judge it.
    """
    from ftqp.app.campaign.episode_study import load_campaign
    from ftqp.app.commands.campaign_episodes import replay_episode, run_episodes

    more = () if episodes is None else (f"campaign.episodes={episodes}",)
    made = load_campaign(study, (*(overrides or ()), *more))
    if replay is not None:
        if not 0 <= replay < NUMBERS:
            raise InputError(f"episode {replay} is none of {made.name}, expected 0 to {NUMBERS - 1}")
        return replay_episode(made, replay, out, as_json=as_json)
    return run_episodes(made, out, jobs=jobs, dask=dask, table=table, as_json=as_json)


ANALYSES: dict[Callable[..., ExitCode], str] = {
    calibrate: "Example: ftqp calibrate runs/healthy-1 runs/healthy-2 --out healthy.json",
    converge: "Example: ftqp converge planar3-unidentified --set faults.0.at=2.0",
    workspace: "Example: ftqp workspace planar3-map --out runs/map --jobs 2",
    coverage: "Example: ftqp coverage panda-y-line --plan plan.npz --out runs/coverage",
    plan: "Example: ftqp plan panda-y-line -o plan.npz --report runs/plan",
}
"""Each command with an example of it."""
