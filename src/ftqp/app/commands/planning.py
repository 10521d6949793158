"""``ftqp plan``: a trajectory along a scenario's path that survives more failures, and what it gains."""

import hashlib
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Self, final

from ftqp import __version__
from ftqp.analysis import Plan, PlanSettings, coverage, plan
from ftqp.analysis.planning.plan_case import Portion
from ftqp.analysis.survival.task_path import TaskPath
from ftqp.app.commands import covering
from ftqp.app.commands.coverage_words import coverage_told
from ftqp.app.output.console import ExitCode, answer, progress, say
from ftqp.app.run.healthy_motion import task_of
from ftqp.app.scenario.setup import load
from ftqp.app.study.results_file import FILE_NAME, ResultsFile
from ftqp.app.study.runner import refuse_wrong_workers, run_study
from ftqp.core.errors import InputError

KIND = "plan"
COLUMNS = {"value": "TEXT"}
REMEDY = "plan into another file by -o, or remove that folder"


@final
class KeptPortions:
    """Keeps what is done of a plan in a folder, and has processes or a cluster do what can be shared.

    ``study`` tells the plan from every other one, a line for each fact: with another text, or another version
    of ftqp, what the folder holds is refused. ``told`` hears of what is done, of how much, and of what stage.
    """

    def __init__(
        self,
        folder: Path,
        study: str,
        *,
        jobs: int | None,
        dask: str | None,
        told: Callable[[int, int, str], None],
    ) -> None:
        self.folder, self._study, self._told = folder, study, told
        self._jobs, self._dask = jobs, dask
        self._open: dict[str, ResultsFile] = {}
        self._known: dict[str, dict[int, str]] = {}

    @property
    def keeps(self) -> bool:
        """That an interrupted plan is kept."""
        return True

    @property
    def threads(self) -> int | None:
        """One for each worker; all cores where this process is the only one."""
        return None if self._jobs is None and self._dask is None else 1

    def each(self, stage: str, work: Portion, count: int) -> Iterator[str]:
        """The texts of all items of a stage, in order, after those that are missing have been computed."""
        results, jobs = self._file(stage), 1 if self._jobs is None else self._jobs
        done = run_study(
            work, count, results, what=stage, jobs=jobs, dask=self._dask,
            heard=lambda done: self._told(round(done), count, stage),
        )  # fmt: skip
        done.refuse_gaps(f"parts of the stage {stage!r}")
        return iter([text for _, text in results.table()])

    def one(self, stage: str, item: int, work: Callable[[], str]) -> str:
        """The text of one item, from the file where it is there."""
        results = self._file(stage)
        if stage not in self._known:
            self._known[stage] = dict(results.table())
        known = self._known[stage]
        if item not in known:
            known[item] = work()
            results.write([item], [(known[item],)], 0.0, "")
        return known[item]

    def _file(self, stage: str) -> ResultsFile:
        if stage not in self._open:
            key = hashlib.sha256(f"{__version__}\n{self._study}\n{stage}".encode()).hexdigest()
            about: Mapping[str, Any] = {"ftqp": __version__, "study": self._study}
            self._open[stage] = ResultsFile(
                self.folder / stage, kind=KIND, key=key, columns=COLUMNS, about=about, remedy=REMEDY,
                onward="the same command with --resume",
            )  # fmt: skip
        return self._open[stage]

    def forget(self) -> None:
        """Take what is kept away, once the plan is made."""
        self.close()
        for file in self.folder.glob(f"*/{FILE_NAME}"):
            shutil.rmtree(file.parent, ignore_errors=True)
        with suppress(OSError):
            self.folder.rmdir()

    def close(self) -> None:
        """Let go of all files."""
        for results in self._open.values():
            results.close()
        self._open.clear()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


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
    jobs: int | None,
    dask: str | None,
    resume: bool,
    as_json: bool,
) -> ExitCode:
    """Plan, write the file, and say what the plan survives."""
    if file.exists():
        raise InputError(f"file {file} exists, and nothing is overwritten; name another one by -o")
    if file.suffix != ".npz":
        raise InputError(f"the plan's file is {file}, expected one that ends in .npz")
    if not file.absolute().parent.is_dir():
        raise InputError(f"file {file} cannot be made: there is no folder {file.absolute().parent}")
    if start not in STARTS:
        raise InputError(f"--start is {start!r}, expected one of {', '.join(STARTS)}")
    freedoms: Any = [name.strip() for name in (optimise or "").split(",") if name.strip()]
    if freedoms and start == "given":
        raise InputError(
            "--optimise moves the path, so that it need not begin at the scenario's start; leave --start out"
        )
    refuse_wrong_workers(jobs, dask)
    setup = load(source, [*overrides, "faults="])
    setup.refuse_tables("ftqp plan", "constraints")
    task = task_of(setup)
    chosen: Any = method
    hours = None if mtbf is None else covering.hours_by_joint(task.robot, mtbf)
    settings, q0 = PlanSettings(**knobs), setup.q if start == "given" else None
    weights = None if hours is None else {joint: 1.0 / value for joint, value in hours.items()}
    part = file.with_name(f"{file.name}.part")
    _refuse_leftovers(part, resume)
    study = {
        "method": method, "seed": seed, "optimise": freedoms, **settings.text(), "weights": weights,
        "start": None if q0 is None else q0.tolist(), "path and robot": task.digest,
    }  # fmt: skip
    text = "\n".join(f"{name} = {value}" for name, value in study.items())
    with (
        _bar(setup.name) as told,
        KeptPortions(part, text, jobs=jobs, dask=dask, told=told) as portions,
    ):
        try:
            made = plan(
                setup.robot,
                task,
                q0,
                chosen,
                seed,
                settings=settings,
                optimise=freedoms,
                weights=weights,
                progress=told,
                portions=portions,
            )
        except KeyboardInterrupt:
            say(f"what is done is kept in {part}; the same command with --resume goes on from there")
            raise
        except InputError:
            if not resume:
                portions.forget()
            raise
        made.save(file)
        portions.forget()
    found = covering.Subject(name=setup.name, title=f"the plan by {method}", task=made.task, q=made.q)
    rep = coverage(task.robot, None, made, stride=made.stride)
    facts = covering.facts_of(found, rep) | _about(made, task, file)
    if hours is not None:
        facts["mission"] = covering.mission_of(rep, hours)
    if folder is not None:
        facts |= covering.report(found, rep, facts, folder)
    answer(facts, as_json, [*coverage_told(facts), *_told(facts)])
    return ExitCode.DONE


def _refuse_leftovers(part: Path, resume: bool) -> None:
    """Refuses to begin anew where an interrupted plan is kept."""
    if part.exists() and not resume:
        raise InputError(
            f"{part} keeps what an interrupted plan has done; go on from there by --resume, or remove it"
        )
    if resume and not part.exists():
        say(f"note: nothing of an interrupted plan is kept in {part}; this one begins anew")


@contextmanager
def _bar(name: str) -> Iterator[Callable[[int, int, str], None]]:
    """A bar that starts anew with each kind of work."""
    doing = [name]
    with progress(lambda: f"{name}: {doing[0]}", 1.0) as told:

        def hear(done: int, total: int, what: str) -> None:
            doing[0] = what
            told(done / max(total, 1))

        yield hear


def _about(made: Plan, task: TaskPath, file: Path) -> dict[str, Any]:
    """What is said of a plan beside what it survives."""
    return {
        "file": str(file),
        "method": made.method,
        "settings": dict(made.settings),
        "start": made.q[0].tolist(),
        "moved": made.task_digest != task.digest,
    }


def _told(facts: dict[str, Any]) -> list[str]:
    """The rest, for a person."""
    told = [f"  plan: {facts['file']}; run it: ftqp run {facts['scenario']} --plan {facts['file']}"]
    if facts["moved"]:
        settings = facts["settings"]
        ways = ", ".join(f"{name} {settings[name]}" for name in ("yaw", "base") if name in settings)
        told.insert(
            0, f"  the path is moved ({ways}); move path, tool or base of the scenario alike before it is run"
        )
    return told
