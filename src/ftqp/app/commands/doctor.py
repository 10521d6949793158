"""``ftqp doctor``: whether this installation is sound, what is missing, and what that keeps from working."""

import platform
import re
import statistics
import sys
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from typing import Any

import numpy as np

import ftqp
from ftqp.app.output.console import ExitCode, answer, tell
from ftqp.core import clock
from ftqp.core.errors import FtqpError
from ftqp.core.extras import NAME, missing_library, remedy_for_extra
from ftqp.kernel.compiled import mode
from ftqp.kernel.compiled.kernel import BUILT
from ftqp.kernel.compiled.library import REMEDY, NoLibrary, level_here, library_in

NEEDED_FOR = {
    "viz": "figures, reports, the live page",
    "sim": "physics",
    "robots": "URDFs with meshes",
    "ros": "bags of ROS 2",
    "distributed": "studies on a cluster",
}
"""Extras that are looked for, and what they are for; of solvers ``ftqp backends`` tells."""
REQUIREMENT = re.compile(r"^([\w.-]+)")
EXTRA = re.compile(r"extra == [\"']([\w-]+)[\"']")
TRIES = 200
"""Steps of the trial."""
DIGITS = 1e-9
"""A target that stands is kept to this [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One thing that was looked at.

    Attributes:
        name: What.
        found: What there is, in a few words.
        state: ``ok``, ``missing`` for what is optional, or ``wrong``.
        remedy: What to do; empty where nothing is to be done.
    """

    name: str
    found: str
    state: str = "ok"
    remedy: str = ""


def examine(*, as_json: bool) -> ExitCode:
    """Look at everything and tell it; done where nothing is wrong."""
    checks = [_python(), _processor(), _kernel(), *_packages(), _trial()]
    wrong = [check for check in checks if check.state == "wrong"]
    facts: dict[str, Any] = {
        "sound": not wrong,
        "checks": [
            {"name": one.name, "found": one.found, "state": one.state, "remedy": one.remedy} for one in checks
        ],
    }
    answer(facts, as_json, lambda: tell("\n".join(lines(checks))))
    return ExitCode.STOPPED if wrong else ExitCode.DONE


def lines(checks: list[Check]) -> list[str]:
    """The checks for a person: a line each, with what to do."""
    width = max(len(one.name) for one in checks)
    marks = {"ok": "ok     ", "missing": "missing", "wrong": "WRONG  "}
    said = []
    for one in checks:
        said.append(f"{marks[one.state]}  {one.name:{width}}  {one.found}")
        if one.remedy:
            said.append(f"{'':{width + 11}}{one.remedy}")
    wrong = sum(one.state == "wrong" for one in checks)
    ending = (
        f"{wrong} of these keep ftqp from working as it should" if wrong else "this installation is sound"
    )
    return [*said, "", f"ftqp {ftqp.__version__}: {ending}"]


def _python() -> Check:
    """The interpreter."""
    found = f"{platform.python_implementation()} {platform.python_version()}, {sys.platform}"
    return Check(name="Python", found=found)


def _processor() -> Check:
    """The machine, and the class of processors that it belongs to."""
    level = level_here()
    if level is None:
        return Check(
            name="processor",
            found=f"{platform.machine()}, of no class that a kernel is built for",
            state="wrong",
            remedy="ftqp runs as plain Python here, some hundred times slower",
        )
    return Check(name="processor", found=f"{platform.machine()}, {level}")


def _kernel() -> Check:
    """The built library."""
    if mode.PLAIN:
        return Check(
            name="kernel",
            found="plain Python, as NUMBA_DISABLE_JIT asks for",
            state="wrong",
            remedy="unset it",
        )
    try:
        library = library_in(BUILT, mode.KERNEL)
    except NoLibrary as error:
        return Check(name="kernel", found=f"plain Python: {error}", state="wrong", remedy=REMEDY)
    return Check(name="kernel", found=f"built for {library.level}, in {BUILT}")


def _packages() -> list[Check]:
    """What ftqp needs, and each extra."""
    try:
        declared = requires(NAME) or []
    except PackageNotFoundError:
        return [
            Check(
                name="package",
                found="not installed, only on the path",
                state="missing",
                remedy="its dependencies cannot be looked up; install it: pip install . in its folder",
            )
        ]
    needed: dict[str, list[str]] = {"": [], **{extra: [] for extra in NEEDED_FOR}}
    for line in declared:
        name, extra = REQUIREMENT.match(line), EXTRA.search(line)
        key = "" if extra is None else extra[1]
        if name is not None and key in needed and not elsewhere(line):
            needed[key].append(name[1])
    checks = []
    for kind, names in needed.items():
        there = {name: found for name in names if (found := version_of(name)) is not None}
        absent = [name for name in names if name not in there]
        found = ", ".join(f"{name} {number}" for name, number in there.items())
        said = found if not absent else f"without {', '.join(absent)}"
        if not kind:
            remedy = "install ftqp anew: pip install . in its folder" if absent else ""
            checks.append(Check(name="needs", found=said, state="wrong" if absent else "ok", remedy=remedy))
        else:
            remedy = f"for {NEEDED_FOR[kind]}: {remedy_for_extra(kind)}" if absent else ""
            checks.append(
                Check(name=f"[{kind}]", found=said, state="missing" if absent else "ok", remedy=remedy)
            )
    return checks


def elsewhere(requirement: str) -> bool:
    """Whether it is asked for on another system than this one only."""
    here = sys.platform
    other = re.search(r"sys_platform ([!=]=) [\"'](\w+)[\"']", requirement)
    return other is not None and (other[2] == here) != (other[1] == "==")


def version_of(name: str) -> str | None:
    """The version of a package; None where it is not installed."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _trial() -> Check:
    """A planner that keeps an arm where it is, and goes on when a joint locks."""
    try:
        robot = ftqp.robots.load("panda")
        planner = ftqp.Planner(robot, dt=1e-3)
        planner.reset(robot.neutral)
        target, q, times = ftqp.Target(robot.pose(robot.neutral)), robot.neutral, []
        for k in range(TRIES):
            if k == TRIES // 2:
                planner.report(ftqp.Locked(2))
            began = clock.now()
            step = planner.step(q, None, target)
            times.append(clock.now() - began)
            q = step.q.copy()
    except (FtqpError, ImportError, OSError) as error:
        lacking = missing_library(error) if isinstance(error, ImportError) else None
        remedy = lacking or "see what is wrong above"
        return Check(name="trial", found=f"failed: {error}", state="wrong", remedy=remedy)
    still = step.status is ftqp.StepStatus.OK and step.position_error < DIGITS and bool(np.isfinite(q).all())
    found = (
        f"{TRIES} steps, a joint locked, {step.status.name}, {1e-3 * statistics.median(times):.1f} us a step"
    )
    remedy = "" if still else "this should be OK; please report it, with these lines"
    return Check(name="trial", found=found, state="ok" if still else "wrong", remedy=remedy)
