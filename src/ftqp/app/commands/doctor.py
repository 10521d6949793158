"""``ftqp doctor``: whether this installation is sound, what is missing, and what that keeps from working."""

import platform
import re
import statistics
import sys
from importlib.metadata import PackageNotFoundError, requires, version
from typing import Any, NamedTuple

import numpy as np

import ftqp
from ftqp.app.output.console import ExitCode, answer
from ftqp.core import clock
from ftqp.core.errors import FtqpError
from ftqp.core.extras import NAME, missing_library, remedy_for_extra
from ftqp.kernel.compiled import library
from ftqp.kernel.compiled.library import BUILT, KERNEL, REMEDY, NoLibrary, level_here, library_in

NEEDED_FOR = {
    "viz": "figures, reports, the live page",
    "sim": "physics",
    "robots": "URDFs with meshes",
    "ros": "bags of ROS 2",
    "distributed": "studies on a cluster",
}
"""Extras that are looked for, and what they are for; of solvers ``ftqp backends`` lists them."""
REQUIREMENT = re.compile(r"^([\w.-]+)")
EXTRA = re.compile(r"extra == [\"']([\w-]+)[\"']")
TRIES = 200
"""Steps of the trial."""
DIGITS = 1e-9
"""A target that stands is kept to this [m]."""


class Check(NamedTuple):
    """One thing that was looked at: what, what there is, ``ok``, ``missing`` or ``wrong``, and what to do."""

    name: str
    found: str
    state: str = "ok"
    remedy: str = ""


def examine(*, as_json: bool) -> ExitCode:
    """Look at everything and print it; done where nothing is wrong."""
    version = f"{platform.python_implementation()} {platform.python_version()}"
    python = Check("Python", f"{version}, {sys.platform}")
    checks = [python, _processor(), _kernel(), *_packages(), _trial()]
    wrong = sum(one.state == "wrong" for one in checks)
    facts: dict[str, Any] = {"sound": not wrong, "checks": [one._asdict() for one in checks]}
    answer(facts, as_json, lines(checks, wrong))
    return ExitCode.STOPPED if wrong else ExitCode.DONE


def lines(checks: list[Check], wrong: int) -> list[str]:
    """The checks for a person: a line each, with what to do."""
    width = max(len(one.name) for one in checks)
    marks = {"ok": "ok     ", "missing": "missing", "wrong": "WRONG  "}
    said = []
    for one in checks:
        said.append(f"{marks[one.state]}  {one.name:{width}}  {one.found}")
        said += [f"{'':{width + 11}}{one.remedy}"] if one.remedy else []
    ending = (
        f"{wrong} of these keep ftqp from working as it should" if wrong else "this installation is sound"
    )
    return [*said, "", f"ftqp {ftqp.__version__}: {ending}"]


def _processor() -> Check:
    """The machine, and the class of processors that it belongs to."""
    level = level_here()
    if level is None:
        found = f"{platform.machine()}, of no class that a kernel is built for"
        remedy = "ftqp runs as plain Python here, some hundred times slower"
        return Check("processor", found, "wrong", remedy)
    return Check("processor", f"{platform.machine()}, {level}")


def _kernel() -> Check:
    """The built library."""
    if library.PLAIN:
        return Check("kernel", "plain Python, as NUMBA_DISABLE_JIT asks for", "wrong", "unset it")
    try:
        found = library_in(BUILT, KERNEL)
    except NoLibrary as error:
        return Check("kernel", f"plain Python: {error}", "wrong", REMEDY)
    return Check("kernel", f"built for {found.level}, in {BUILT}")


def _packages() -> list[Check]:
    """What ftqp needs, and each extra."""
    try:
        declared = requires(NAME) or []
    except PackageNotFoundError:
        remedy = "its dependencies cannot be looked up; install it: pip install . in its folder"
        return [Check("package", "not installed, only on the path", "missing", remedy)]
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
        what = f"[{kind}]" if kind else "needs"
        if not absent:
            checks.append(Check(what, ", ".join(f"{name} {number}" for name, number in there.items())))
            continue
        again = "install ftqp anew: pip install . in its folder"
        remedy = f"for {NEEDED_FOR[kind]}: {remedy_for_extra(kind)}" if kind else again
        state = "missing" if kind else "wrong"
        checks.append(Check(what, f"without {', '.join(absent)}", state, remedy))
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
        return Check("trial", f"failed: {error}", "wrong", remedy)
    still = step.status is ftqp.StepStatus.OK and step.position_error < DIGITS and bool(np.isfinite(q).all())
    found = (
        f"{TRIES} steps, a joint locked, {step.status.name}, {1e-3 * statistics.median(times):.1f} us a step"
    )
    remedy = "" if still else "this should be OK; please report it, with these lines"
    return Check("trial", found, "ok" if still else "wrong", remedy)
