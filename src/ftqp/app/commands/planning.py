"""``ftqp plan``: a trajectory along a scenario's path that survives more failures, and what it gains."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ftqp.analysis import Plan, PlanSettings, coverage, plan
from ftqp.analysis.survival.task_path import TaskPath
from ftqp.app.commands import covering
from ftqp.app.commands.coverage_words import coverage_summary
from ftqp.app.output.console import ExitCode, answer, progress
from ftqp.app.run.healthy_motion import task_of
from ftqp.app.scenario.setup import load
from ftqp.core.errors import InputError

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
    setup = load(source, [*overrides, "faults="])
    setup.refuse_tables("ftqp plan", "constraints")
    task = task_of(setup)
    chosen: Any = method
    hours = None if mtbf is None else covering.hours_by_joint(task.robot, mtbf)
    settings, q0 = PlanSettings(**knobs), setup.q if start == "given" else None
    weights = None if hours is None else {joint: 1.0 / value for joint, value in hours.items()}
    with _bar(setup.name) as notify:
        made = plan(
            setup.robot, task, q0, chosen, seed, settings=settings, optimise=freedoms, weights=weights,
            progress=notify,
        )  # fmt: skip
    made.save(file)
    found = covering.Subject(name=setup.name, title=f"the plan by {method}", task=made.task, q=made.q)
    rep = coverage(task.robot, None, made, stride=made.stride)
    facts = covering.facts_of(found, rep) | _about(made, task, file)
    if hours is not None:
        facts["mission"] = covering.mission_of(rep, hours)
    if folder is not None:
        facts |= covering.report(found, rep, facts, folder)
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
