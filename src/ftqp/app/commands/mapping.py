"""``ftqp workspace``: computes the map of a study, or goes on with it, sums it up and draws it."""

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np

from ftqp import __version__
from ftqp.analysis import WorkspaceReport
from ftqp.analysis.goals import goal_study
from ftqp.analysis.workspace_map import COUNTS, MEASURES, WorkspaceTask, map_chunk, points, workspace_task
from ftqp.app.output.console import ExitCode, Shown, Table, answer, json_text, say
from ftqp.app.run.runs import write
from ftqp.app.scenario import document
from ftqp.app.scenario.setup import arm_from
from ftqp.app.schema.reading import Table as Section
from ftqp.app.schema.reading import plain, read
from ftqp.app.schema.robot_section import Quaternion, RobotTable, quaternion_rotation
from ftqp.app.study.results_file import ResultsFile
from ftqp.app.study.runner import Outcome, refuse_wrong_workers, run_study, study_folder, told_how_to_go_on
from ftqp.core.checks import FloatArray
from ftqp.core.errors import FtqpError, InputError, MissingPackage, ModelError, ScenarioError
from ftqp.core.pose import transform
from ftqp.core.setting import REQUIRED, setting
from ftqp.model.chain import frame_id
from ftqp.model.posture import places
from ftqp.model.robot import Robot


@dataclass(frozen=True, slots=True, kw_only=True)
class MapTable(Section):
    """The goal, the starts, and what is asked of them."""

    goal: tuple[float, ...] = setting(
        REQUIRED, "where the end effector is to go, [x, y] or [x, y, z]", unit="m", count=(2, 3)
    )
    rows: Literal["position", "pose"] | tuple[str, ...] = setting(
        "position", "task rows, 'position', 'pose' or their names"
    )
    orientation: Quaternion | None = setting(
        None, "quaternion x, y, z, w of the goal, where rows count rotation"
    )
    plane: Literal["xy", "xz", "yz", "space"] = setting(
        "xz",
        "the plane through the goal that is mapped, or all of space; that of the rows, if they have two axes",
    )
    instants: int = setting(
        4, "nodes of a line at which failures are simulated, >= 0; at none, only R is said", least=0.0
    )
    grid: int = setting(52, "nodes of the square grid of starts along each axis, >= 2", least=2.0)
    configurations: int = setting(
        90, "postures at a start, >= 1: of each self-motion that is traced, or quasi-random starts", least=1.0
    )
    steps: int = setting(100, "equal parts of the straight line to the goal, >= 1", least=1.0)
    weights: tuple[tuple[float, ...], ...] | None = setting(
        None, "W, weights of the joint rates in the controller, (nv, nv); the identity if absent"
    )
    seed: int = setting(0, "moves quasi-random postures, >= 0", least=0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkspaceFile(Section):
    """A whole study of a workspace."""

    whole: ClassVar[str] = "a study"

    description: str = setting("", "what a reader should know")
    robot: RobotTable = setting(REQUIRED, "the arm")
    map: MapTable = setting(REQUIRED, "the goal, the starts, and what is asked of them")


KIND = "workspace"
AXES = "xyz"
ANY = "any"
"""The column of a measure for a failure of any joint."""


def map_rows(task: WorkspaceTask, every: FloatArray, items: Sequence[int]) -> list[tuple[Any, ...]]:
    """The rows of the starts with these numbers: place, measures of each joint and of any, counts."""
    places = every[list(items)]
    found = map_chunk(task, places)
    parts = [places, *(found[name] for name in MEASURES), *(found[name][:, None] for name in COUNTS)]
    return [tuple(row) for row in np.hstack(parts).tolist()]


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkspaceStudy:
    """A study that is ready to be computed."""

    name: str
    tables: WorkspaceFile
    text: str
    robot: Robot
    task: WorkspaceTask
    places: FloatArray

    @property
    def columns(self) -> dict[str, str]:
        """The columns of its results: the place, every measure for each joint and for any, counts."""
        joints = (*self.robot.joints, ANY)
        names = [
            *AXES[: self.places.shape[1]],
            *(f"{measure}_{joint}" for measure in MEASURES for joint in joints),
            *COUNTS,
        ]
        return dict.fromkeys(names, "REAL")

    @property
    def key(self) -> str:
        """Its fingerprint: a hash of its text, the arm's constants and the version."""
        digest = hashlib.sha256(f"{__version__}\n{self.text}".encode())
        for name, value in sorted(self.robot.chain.constants().items()):
            digest.update(name.encode() + np.ascontiguousarray(value).tobytes())
        limits = self.robot.limits
        digest.update(np.concatenate([limits.q_min, limits.q_max]).tobytes())
        return digest.hexdigest()

    def arm_at_goal(self) -> FloatArray | None:
        """Joints and tip of the arm with its tip at the goal, (nv + 2, 3) [m]; None where none is found."""
        study = goal_study(self.robot, self.task.pose, list(self.task.rows))
        q, left, _ = study.limited.solutions(study.starts(64, limited=True), bounded=True)
        good = np.flatnonzero(left < study.tolerance)
        if not good.size:
            return None
        model = self.robot.model
        joints, _ = places(model, frame_id(model, self.robot.tip), self.robot.configuration(q[good[0]]))
        return np.vstack([np.zeros(3), joints])

    def arrays(self, rows: Sequence[Sequence[Any]]) -> dict[str, FloatArray]:
        """The rows of a results file as arrays: ``places``, measures, (P, nv + 1) each, counts, (P,) each."""
        table = np.array(rows, dtype=np.float64).reshape(len(rows), 1 + len(self.columns))[:, 1:]
        width = self.robot.nv + 1
        ends = np.cumsum([self.places.shape[1], *[width] * len(MEASURES), *[1] * len(COUNTS)])
        places, *parts = np.split(table, ends[:-1], axis=1)
        found = dict(zip((*MEASURES, *COUNTS), parts, strict=True))
        return {"places": places} | found | {name: found[name][:, 0] for name in COUNTS}


def load_study(source: str, overrides: Iterable[str] = ()) -> WorkspaceStudy:
    """The study of a file."""
    found = document.read(source, overrides, kind="study")
    tables = read(WorkspaceFile, found.content, f"{found.origin} has errors:")
    try:
        robot = arm_from(tables.robot, found.folder)
    except FtqpError as error:
        raise _at("robot", found.origin, error) from error
    try:
        task = _task(robot, tables.map)
    except InputError as error:
        raise _at("map", found.origin, error) from error
    places = points(task)
    if not len(places):
        raise ScenarioError(f"{found.origin} has errors:", ["map.grid: no node of the grid is within reach"])
    text = document.toml(plain(tables, found.folder))
    return WorkspaceStudy(name=found.name, tables=tables, text=text, robot=robot, task=task, places=places)


def _at(place: str, origin: str, error: FtqpError) -> ScenarioError:
    """An error of a table."""
    findings = error.findings if isinstance(error, ModelError) and error.findings else (str(error),)
    return ScenarioError(f"{origin} has errors:", [f"{place}: {finding}" for finding in findings])


def _task(robot: Robot, table: MapTable) -> WorkspaceTask:
    """What all starts share."""
    goal: Any = table.goal
    if table.orientation is not None:
        goal = transform(quaternion_rotation(table.orientation), np.array(table.goal))
    return workspace_task(
        robot, goal, table.rows, grid=table.grid, configurations=table.configurations, steps=table.steps,
        plane=None if table.plane == "space" else table.plane, instants=table.instants, W=table.weights,
        seed=table.seed,
    )  # fmt: skip


STUDY, SUMMARY = "study.toml", "summary.json"
WHOLE = 100.0 - 1e-9
"""A measure from here on is all of it [percent]."""


def map_workspace(
    source: str,
    overrides: Sequence[str],
    out: Path | None,
    *,
    jobs: int | None,
    dask: str | None,
    as_json: bool,
) -> ExitCode:
    """Compute, sum up and draw the map of a study."""
    refuse_wrong_workers(jobs, dask)
    study = load_study(source, overrides)
    folder = study_folder(out, study.name)
    about = {"study": study.text, "ftqp": __version__, "robot": study.robot.name}
    with (
        told_how_to_go_on(folder),
        ResultsFile(folder, kind=KIND, key=study.key, columns=study.columns, about=about) as results,
    ):
        write(folder / STUDY, study.text)
        work = partial(map_rows, study.task, study.places)
        outcome = run_study(work, len(study.places), results, what=study.name, jobs=jobs, dask=dask)
        found = study.arrays(results.table())
    facts = _summary(study, found, outcome, folder)
    facts["figures"] = [str(file) for file in _figures(study, found, folder)]
    write(folder / SUMMARY, json_text(facts))
    answer(facts, as_json, _shown(study, facts))
    return ExitCode.STOPPED if outcome.crashed else ExitCode.DONE


def _summary(
    study: WorkspaceStudy, found: dict[str, FloatArray], outcome: Outcome, folder: Path
) -> dict[str, Any]:
    """What ``summary.json`` holds."""
    joints = (*study.robot.joints, ANY)
    means = WorkspaceReport.of(study.task, found["places"], found).means()
    return {
        "study": study.name,
        "robot": study.robot.name,
        "folder": str(folder),
        "starts": len(found["places"]),
        "computed_now": outcome.computed,
        "crashed": {str(item): reason for item, reason in outcome.crashed.items()},
        "cpu_seconds": outcome.seconds,
        "configurations": int(found["configurations"].sum()),
        "failed_lines": int(found["failed"].sum()),
        "runs": int(found["runs"].sum()),
        "unresolved": int(found["unresolved"].sum()),
        "means": {name: dict(zip(joints, values.tolist(), strict=True)) for name, values in means.items()},
        **{
            f"starts_with_{name}_of_100": dict(
                zip(joints, (found[name] >= WHOLE).sum(axis=0).tolist(), strict=True)
            )
            for name in ("R100", "C100")
        },
    }


def _figures(study: WorkspaceStudy, found: dict[str, FloatArray], folder: Path) -> list[Path]:
    """The pictures; none, with a note, when the package that draws them is missing."""
    try:
        from ftqp.viz.figures.study_pictures import save_maps
    except MissingPackage as error:
        say(f"note: {error}")
        return []
    if study.task.plane is None:
        say("note: a map of all of space is not drawn; its rows are in the results file")
        return []
    (folder / "figures").mkdir(exist_ok=True)
    return save_maps(
        folder / "figures", study.name, study.robot.joints, study.task.goal, study.arm_at_goal(), found
    )


def _shown(study: WorkspaceStudy, facts: dict[str, Any]) -> Shown:
    """The summary for a person."""
    joints = (*study.robot.joints, ANY)
    rows = [(name, *(_percent(value) for value in by.values())) for name, by in facts["means"].items()]
    rows += [
        (f"starts with {name} = 100", *(str(count) for count in facts[f"starts_with_{name}_of_100"].values()))
        for name in ("R100", "C100")
    ]
    title = f"{study.name}: {study.robot.name}, means over {facts['starts']} starts in percent"
    again = f"the same command with --out {facts['folder']} tries them again"
    return [
        Table(title, ("measure", *joints), rows, joints),
        f"{facts['configurations']} ways to the goal, {facts['failed_lines']} of them end at a singularity; "
        f"{facts['runs']} motions after a failure, {facts['unresolved']} of them unresolved",
        "R: the goal stays within reach; F: where it does, the end effector gets there; C: both, on the "
        "whole way.",
        "100: configurations with all of it; avg: their mean; sens: the best minus the worst.",
        *([f"{len(facts['crashed'])} starts killed their worker; {again}."] if facts["crashed"] else []),
        f"{facts['cpu_seconds']:.1f} s of processor time; files: {facts['folder']}",
    ]


def _percent(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.2f}"
