"""``ftqp workspace``: computes the map of a study, or goes on with it, sums it up and draws it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ftqp import __version__
from ftqp.analysis import WorkspaceReport
from ftqp.app.output.console import ExitCode, Table, Told, answer, json_text, say
from ftqp.app.run.runs import write
from ftqp.app.study.results_file import ResultsFile
from ftqp.app.study.runner import Outcome, refuse_wrong_workers, run_study, study_folder, told_how_to_go_on
from ftqp.app.study.workspace_study import ANY, KIND, MapWork, WorkspaceStudy, load_study
from ftqp.core.checks import FloatArray
from ftqp.core.errors import MissingPackage

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
        outcome = run_study(
            MapWork(study.task), len(study.places), results, what=study.name, jobs=jobs, dask=dask
        )
        found = study.arrays(results.table())
    facts = _summary(study, found, outcome, folder)
    facts["figures"] = [str(file) for file in _figures(study, found, folder)]
    write(folder / SUMMARY, json_text(facts))
    answer(facts, as_json, _told(study, facts))
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
        from ftqp.viz.figures.map_pictures import save_maps
    except MissingPackage as error:
        say(f"note: {error}")
        return []
    if study.places.shape[1] == 3 and study.tables.map.plane == "space":
        say("note: a map of all of space is not drawn; its rows are in the results file")
        return []
    (folder / "figures").mkdir(exist_ok=True)
    return save_maps(
        folder / "figures", study.name, study.robot.joints, study.task.goal, study.arm_at_goal(), found
    )


def _told(study: WorkspaceStudy, facts: dict[str, Any]) -> Told:
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
        "R: the goal stays within reach; F: where it does, the tip gets there; C: both, on the whole way.",
        "100: configurations with all of it; avg: their mean; sens: the best minus the worst.",
        *([f"{len(facts['crashed'])} starts killed their worker; {again}."] if facts["crashed"] else []),
        f"{facts['cpu_seconds']:.1f} s of processor time; files: {facts['folder']}",
    ]


def _percent(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.2f}"
