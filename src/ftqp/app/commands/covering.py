"""``ftqp coverage``: which failures a motion survives, in numbers, pictures and a page."""

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from ftqp import __version__
from ftqp.analysis import CoverageReport, Plan, PlanSettings, coverage, plan
from ftqp.analysis.survival.coverage import CoverageCase
from ftqp.analysis.survival.coverage_report import SENTENCES, NotSurvived
from ftqp.analysis.survival.failure_instants import Pairs
from ftqp.analysis.survival.task_path import TaskPath, task_path
from ftqp.analysis.survival.way_round import DT
from ftqp.app.commands.coverage_words import HEAT_MAP, MOTION, PAGE, coverage_summary, write_page
from ftqp.app.output.console import ExitCode, answer, json_text, progress, say
from ftqp.app.run.runs import SUMMARY, holds, make_folder, write
from ftqp.app.scenario.setup import Setup, load
from ftqp.app.study.results_file import FILE_NAME, ResultsFile
from ftqp.app.study.runner import refuse_wrong_workers, run_study, study_folder
from ftqp.app.view.verdicts_file import write_verdicts
from ftqp.control.planner.running_task import rows_of
from ftqp.control.task.soft_tasks import PoseTask, PositionTask, RelativeTask
from ftqp.core.checks import FloatArray, positive
from ftqp.core.errors import InputError, MissingPackage, ScenarioError
from ftqp.core.whole_file import free_path
from ftqp.kernel.entry.continuation_study import Continuations
from ftqp.kernel.layout.enums import Survival
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.model.frames import way_to
from ftqp.model.robot import Robot
from ftqp.sim.loop import MEMORY, Simulation
from ftqp.sim.plants.kinematic_plant import KinematicPlant
from ftqp.sim.schedule import Schedule

SAMPLES = 400
"""A path is looked at so often, about."""
ALONG_TOOL = (0.0, 0.0, 1.0)
"""The only tool axis that coverage knows."""


def task_of(setup: Setup) -> TaskPath:
    """The scenario's path and rows, sampled at ticks of its planner, some 400 times."""
    planner, task, robot = setup.planner, setup.planner.task, setup.robot
    refuse_what_moves(setup)
    rows: str | list[str] = list(planner.task_rows)
    if task.rows == "position_axis":
        if task.axis != ALONG_TOOL:
            raise ScenarioError(
                f"{setup.name} has the tool axis {list(task.axis)}, expected [0, 0, 1]: turn the end "
                "effector by [robot.tool]"
            )
        rows = "position_axis"
    return task_path(
        robot if robot.is_serial else robot.arm_to(robot.tip), setup.path, rows=rows,
        dt=planner.dt * _ticks_per_sample(setup),
        scene=planner.scene, clearance=planner.clearance,
    )  # fmt: skip


def refuse_what_moves(setup: Setup) -> None:
    """Refuse a path that is repeated, and a base that moves."""
    if setup.tables.path.laps is not None:
        raise ScenarioError(
            f"{setup.name} repeats its path, and it is looked at once: take path.laps out, for example by "
            "--set path.laps="
        )
    if setup.world is not None:
        raise ScenarioError(
            f"{setup.name} has a base that moves; which failures a path survives is known for a base that "
            "stands, so take [base] out"
        )


def motion_of_task(setup: Setup, name: str) -> tuple[TaskPath, FloatArray]:
    """The way of a task's frame in a run in which nothing fails, and the joints on the way to it."""
    planner, robot = setup.planner, setup.robot
    if planner.scene is not None:
        raise ScenarioError(
            f"{setup.name} has a scene, which coverage by task does not look at; leave it out by "
            "--set scene=[] --set clearance="
        )
    frame, rows = robot.tip, list(planner.task_rows)
    if name != robot.tip:
        given = planner.tasks[name].given
        if not isinstance(given, PoseTask | PositionTask | RelativeTask):
            raise InputError(
                f"task {name!r} is a {type(given).__name__}, which leads no frame along a path; expected a "
                "PoseTask, PositionTask or RelativeTask, or leave --task out"
            )
        frame = given.frame
        rows = [row for k, row in enumerate(COMPONENTS) if rows_of(given) & (1 << k)]
    refuse_what_moves(setup)
    dt = planner.dt * _ticks_per_sample(setup)
    q = _healthy_run(setup, np.array([dt * k for k in range(round(setup.path.duration / dt) + 1)]))
    arm = robot.arm_to(frame)
    goals = np.array([robot.pose(row, frame) for row in q])
    on_way = np.ascontiguousarray(q[:, way_to(robot, frame)])
    return task_path(arm, goals, rows=rows, dt=dt), on_way


def healthy_motion(setup: Setup) -> tuple[TaskPath, FloatArray]:
    """The task, and the joints on it in a run in which nothing fails, (N + 1, nv) [rad or m]."""
    task = task_of(setup)
    return task, _healthy_run(setup, task.t)


def _healthy_run(setup: Setup, times: FloatArray) -> FloatArray:
    """The joints at times of the path in a run in which nothing fails, (K, nv) [rad or m]."""
    planner = setup.planner
    with progress(f"{setup.name}, healthy", 1.0) as notify:
        ended = Simulation(
            planner, setup.path, q=setup.q, v=setup.v, schedule=Schedule([]),
            plant=KinematicPlant(setup.robot, planner.dt), follower=setup.follower,
            feed_forward=setup.tables.simulation.feed_forward, log=MEMORY,
            progress=lambda done, total: notify(done / total),
        ).run()  # fmt: skip
    if ended.interrupted:
        raise KeyboardInterrupt
    log = ended.log
    if log is None or not ended.completed:
        raise ScenarioError(
            f"{setup.name} does not get to the end of its path even while nothing fails"
            + (f": it stopped at {ended.stopped_at:.3g} s" if ended.stopped_at is not None else "")
            + "; run it with --set faults= to see why"
        )
    reached = log["progress"] if "progress" in log else planner.dt * np.arange(len(log))
    ticks = np.minimum(np.searchsorted(reached, times - 0.5 * planner.dt), len(reached) - 1)
    q: FloatArray = np.ascontiguousarray(log["q"][ticks])
    return q


def _ticks_per_sample(setup: Setup) -> int:
    """Ticks of the planner from sample to sample."""
    ticks = setup.path.duration / setup.planner.dt
    if ticks < 1.0:
        raise InputError(f"the path lasts {setup.path.duration:g} s, less than one tick")
    return max(1, round(ticks / SAMPLES))


KIND = "coverage"
NUMBERS: Final = ("position", "rotation", "margin", "hurry", "clearance")
"""What is known of a continuation beside its status and its last sample, by name and column."""
COLUMNS: Final = {"failure": "TEXT", "t": "REAL", "status": "TEXT", "last_sample": "INTEGER"} | dict.fromkeys(
    NUMBERS, "REAL"
)


def pair_rows(pairs: Pairs, threads: int | None, items: Sequence[int]) -> list[tuple[Any, ...]]:
    """The rows of the pairs with these numbers, by so many threads; None is one a core."""
    found, joints, F = pairs.runs(items, threads), pairs.task.robot.joints, len(pairs.failures)
    names = ["+".join(joints[i] for i in failed) for failed in pairs.failures]
    values = zip(*(getattr(found, name).tolist() for name in ("status", "sample", *NUMBERS)), strict=True)
    return [
        (names[item % F], float(pairs.task.t[pairs.samples[item // F]]), Survival(status).name, *more)
        for item, (status, *more) in zip(items, values, strict=True)
    ]


def report_of(
    case: CoverageCase,
    folder: Path,
    settings: Mapping[str, Any],
    *,
    name: str,
    jobs: int | None,
    dask: str | None,
) -> CoverageReport:
    """The report of a case, from its rows in a folder, those computed now that are missing."""
    pairs, bound = case.pairs, case.bound
    facts = {
        **settings, "path and robot": pairs.task.digest,
        "motion": hashlib.sha256(np.ascontiguousarray(pairs.q).tobytes()).hexdigest()[:32],
    }  # fmt: skip
    study = "\n".join(f"{key} = {value}" for key, value in facts.items())
    key = hashlib.sha256(f"{__version__}\n{study}".encode()).hexdigest()
    about = {"study": study, "ftqp": __version__, "robot": pairs.task.robot.name}
    onward = f"the same command with --out {folder} --resume"
    threads = None if jobs is None and dask is None else 1
    with ResultsFile(folder, kind=KIND, columns=COLUMNS, key=key, about=about, onward=onward) as results:
        work = partial(pair_rows, pairs, threads)
        done = run_study(work, pairs.count, results, what=name, jobs=1 if jobs is None else jobs, dask=dask)
        done.refuse_gaps("items")
        found = _continuations(results.table())
    most = None if bound is None else bound.counts(range(len(bound.samples)), threads)
    return case.report(found, most)


def _continuations(rows: Sequence[Sequence[Any]]) -> Continuations:
    """What became of all pairs, from their rows; what was no number is empty on file."""
    _, _, _, names, samples, *numbers = zip(*rows, strict=True)
    values = np.array(numbers, dtype=np.float64)  # which makes NaN of None
    status = np.array([Survival[name] for name in names], dtype=np.int64)
    sample = np.array(samples, dtype=np.int64)
    return Continuations(status=status, sample=sample, **dict(zip(NUMBERS, values, strict=True)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Subject:
    """A motion whose coverage is shown: its path on a time grid, and joints on it, (N + 1, nv) [rad or m]."""

    name: str
    title: str
    task: TaskPath
    q: FloatArray


def cover(
    source: str,
    overrides: Sequence[str],
    plan: Path | None,
    out: Path | None,
    *,
    settings: dict[str, Any],
    mtbf: str | None,
    jobs: int | None,
    dask: str | None,
    resume: bool,
    as_json: bool,
    name: str | None = None,
) -> ExitCode:
    """Verify every pair of joint and instant of a scenario's motion, and say what is survived."""
    refuse_wrong_workers(jobs, dask)
    folder = _folder(out, f"coverage-{Path(source).stem}", resume)
    setup = load(source, [*overrides, "faults="], plan=plan)
    setup.refuse_tables("ftqp coverage", "constraints")
    led = setup.planner.plan
    if name is not None or not setup.robot.is_serial:
        whose = setup.robot.tip if name is None else name
        task, q = motion_of_task(setup, whose)
        found = Subject(name=setup.name, title=f"the way of {whose} in the scenario", task=task, q=q)
    elif isinstance(led, Plan):
        found = Subject(name=setup.name, title=f"the plan by {led.method}", task=led.task, q=led.q)
    else:
        task, q = healthy_motion(setup)
        found = Subject(name=setup.name, title="the scenario's own motion", task=task, q=q)
    hours = None if mtbf is None else hours_by_joint(found.task.robot, mtbf)
    share = partial(report_of, folder=folder, settings=settings, name=setup.name, jobs=jobs, dask=dask)
    try:
        rep = coverage(found.task.robot, found.task, found.q, **settings, verified=share)
    except KeyboardInterrupt:
        say(f"what is done is kept; the same command with --out {folder} --resume goes on from there")
        raise
    facts = facts_of(found, rep)
    if hours is not None:
        facts["mission"] = mission_of(rep, hours)
    facts |= report(found, rep, facts, folder)
    write_verdicts(folder, rep, setup.name, setup.toml, settings.get("velocity"))
    files = f"files: {folder}; read {folder / PAGE}; ftqp view {folder} plays its failures"
    answer(facts, as_json, [*coverage_summary(facts), files])
    return ExitCode.DONE


def _folder(out: Path | None, name: str, resume: bool) -> Path:
    """The folder of a new report, or one whose rows are there to go on with."""
    kept = out is not None and holds(out, FILE_NAME)
    if resume and out is None:
        raise InputError("--resume goes on with what a folder keeps, and none is named; name it by --out")
    if kept and not resume:
        raise InputError(
            f"output folder {out} keeps what a run has done; go on by --resume, or name another folder"
        )
    if resume and not kept:
        say(f"note: no run has kept anything in {out}; this one begins anew")
    return study_folder(out, name)


def facts_of(found: Subject, rep: CoverageReport) -> dict[str, Any]:
    """What is printed and kept of a report."""
    best, turned = rep.best_effort()
    lost = ~rep.survived
    median, high = rep.jump_quantiles()
    shares = rep.per_joint
    return {
        "scenario": found.name,
        "motion": found.title,
        "robot": rep.task.robot.name,
        "rows": list(rep.task.rows),
        "samples": rep.task.N + 1,
        "instants": len(rep.samples),
        "pairs": int(rep.status.size),
        "fault": rep.fault,
        "lock": rep.lock,
        "coverage": rep.coverage,
        "per_joint": shares,
        "structural": list(rep.structural),
        "counts": {verdict.name: count for verdict, count in rep.counts.items() if count},
        "first_safe": rep.first_safe,
        "worst_error": list(rep.worst_error),
        "worst_best_effort": [float(best[lost].max()), float(turned[lost].max())] if lost.any() else None,
        "least_margin": rep.least_margin,
        "least_clearance": rep.least_clearance if np.isfinite(rep.least_clearance) else None,
        "velocity_jump": [median, high],
        "least_manipulability": dict(zip(rep.names, rep.least_manipulability.tolist(), strict=True)),
        "sign_changes": dict(zip(rep.names, rep.sign_changes.tolist(), strict=True)),
        "energy": rep.energy,
        "upper_bound": None if rep.upper_bound is None else rep.upper_bound.tolist(),
        "reasons": {name: _reason(rep, row) for row, name in enumerate(shares)},
        "best_effort": {name: _worst(best[row]) for row, name in enumerate(shares)},
        "way_round": {name: _round(rep, row) for row, name in enumerate(shares) if lost[row].any()},
    }


def _round(rep: CoverageReport, row: int) -> float | None:
    """How long a way round takes where this failure is first not survived [s]; None without one."""
    if rep.post == "planner":
        return None
    try:
        return DT * len(rep.way_round(rep.names[row], float(rep.t[int(np.argmin(rep.survived[row]))])))
    except NotSurvived:
        return None


def _reason(rep: CoverageReport, row: int) -> str | None:
    """What most often ends the path after this failure; None where nothing does."""
    verdicts = rep.status[row][rep.status[row] != Survival.SURVIVED]
    if not len(verdicts):
        return None
    return SENTENCES[Survival(int(np.bincount(verdicts).argmax()))]


def _worst(errors: FloatArray) -> float | None:
    """The largest of the errors that are known [m]."""
    known = errors[~np.isnan(errors)]
    return float(known.max()) if len(known) else None


def hours_by_joint(robot: Robot, text: str) -> dict[str | int, float]:
    """Mean times between failures by joint [h]."""
    hours: dict[str | int, float] = {}
    try:
        if "=" not in text:
            hours = dict.fromkeys(robot.joints, float(text))
        else:
            for part in text.split(","):
                joint, _, value = part.partition("=")
                hours[joint.strip()] = float(value)
    except ValueError as error:
        raise InputError(
            f"--mtbf is {text!r}, expected hours, or joint=hours with commas, such as {robot.joints[0]}=2e4"
        ) from error
    for name, time in hours.items():
        robot.joint(name)
        positive(f"mtbf of {name!r}", time, "h")
    return hours


def mission_of(rep: CoverageReport, hours: dict[str | int, float]) -> dict[str, float]:
    """The probability that the task is finished."""
    return asdict(rep.mission_survival(hours))


def report(found: Subject, rep: CoverageReport, facts: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Write summary, pictures and page into a folder; where they are."""
    make_folder(folder, exist_ok=True)
    made: dict[str, Any] = {"folder": str(folder), "figures": [], "page": None}
    write(folder / SUMMARY, json_text(facts | made))
    try:
        from ftqp.viz.figures.arm_views import draw_motion

        title, task = f"{found.name}: {found.title}", found.task
        motion = draw_motion(folder / MOTION, title, task.robot, task.t, found.q)
        figures = [rep.figure(folder / HEAT_MAP), motion]
    except MissingPackage as error:
        say(f"note: {error}")
        return made
    made |= {"figures": [str(file) for file in figures], "page": str(folder / PAGE)}
    write_page(folder, facts)
    write(folder / SUMMARY, json_text(facts | made))
    return made


STARTS = ("free", "given")
"""Where a plan begins: anywhere on the first self-motions, or where the scenario does."""


def make_plan(
    source: str,
    overrides: Sequence[str],
    file: Path,
    folder: Path | None,
    *,
    method: str,
    start: str,
    optimise: str | None,
    seed: int,
    knobs: dict[str, Any],
    mtbf: str | None,
    as_json: bool,
) -> ExitCode:
    """Plan, write the file, and say what the plan survives."""
    free_path(file, "plan", ".npz")
    if start not in STARTS:
        raise InputError(f"--start is {start!r}, expected one of {', '.join(STARTS)}")
    freedoms: Any = [name.strip() for name in (optimise or "").split(",") if name.strip()]
    if freedoms and start == "given":
        raise InputError(
            "--optimise moves the path, so that it need not begin at the scenario's start; leave --start out"
        )
    setup = load(source, [*overrides, "faults="])
    setup.refuse_tables("ftqp plan", "constraints")
    task = task_of(setup)
    chosen: Any = method
    hours = None if mtbf is None else hours_by_joint(task.robot, mtbf)
    settings, q0 = PlanSettings(**knobs), setup.q if start == "given" else None
    weights = None if hours is None else {joint: 1.0 / value for joint, value in hours.items()}
    with _bar(setup.name) as notify:
        made = plan(
            setup.robot, task, q0, chosen, seed, settings=settings, optimise=freedoms, weights=weights,
            progress=notify,
        )  # fmt: skip
    made.save(file)
    found = Subject(name=setup.name, title=f"the plan by {method}", task=made.task, q=made.q)
    rep = coverage(task.robot, None, made, stride=made.stride)
    facts = facts_of(found, rep) | _about(made, task, file)
    if hours is not None:
        facts["mission"] = mission_of(rep, hours)
    if folder is not None:
        facts |= report(found, rep, facts, folder)
    answer(facts, as_json, [*coverage_summary(facts), *_shown(facts)])
    return ExitCode.DONE


@contextmanager
def _bar(name: str) -> Iterator[Callable[[int, int, str], None]]:
    """A bar that starts anew with each kind of work."""
    doing = [name]
    with progress(lambda: f"{name}: {doing[0]}", 1.0) as notify:

        def show(done: int, total: int, what: str) -> None:
            doing[0] = what
            notify(done / max(total, 1))

        yield show


def _about(made: Plan, task: TaskPath, file: Path) -> dict[str, Any]:
    """What is said of a plan beside what it survives."""
    return {
        "file": str(file),
        "method": made.method,
        "settings": dict(made.settings),
        "start": made.q[0].tolist(),
        "moved": made.task_digest != task.digest,
    }


def _shown(facts: dict[str, Any]) -> list[str]:
    """The rest, for a person."""
    shown = [f"  plan: {facts['file']}; run it: ftqp run {facts['scenario']} --plan {facts['file']}"]
    if facts["moved"]:
        settings = facts["settings"]
        ways = ", ".join(f"{name} {settings[name]}" for name in ("yaw", "base") if name in settings)
        shown.insert(
            0, f"  the path is moved ({ways}); move path, tool or base of the scenario alike before it is run"
        )
    return shown
