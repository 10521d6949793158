"""``python -m ftqp.kernel.building`` builds the library of the kernel from this source.

It needs numpy, numba, and ziglang or ``cc``. Nothing is done where the library is there and no older than the
source.
"""

import argparse
import contextlib
import json
import os
import platform
import sys
from pathlib import Path
from typing import Any

from ftqp.core.clock import now
from ftqp.kernel.building.wheel_targets import TARGETS, BuildTarget, CannotBuild, is_this_machine
from ftqp.kernel.compiled import library
from ftqp.kernel.compiled.library import (
    BUILT,
    KERNEL,
    LEVELS,
    MANIFEST,
    code_key,
    describe,
    file_key,
    level_here,
    platform_facts,
)

ROOT = KERNEL.parents[2]


def main(arguments: list[str] | None = None) -> int:
    """Build it: 0 built, 1 not, and a sentence and the manifest say why, 130 interrupted."""
    parser = argparse.ArgumentParser(prog="python -m ftqp.kernel.building", description=__doc__)
    add = parser.add_argument
    add("--out", type=Path, default=BUILT, help="the folder of the library (%(default)s)")
    add("--store", type=Path, default=ROOT / "build" / "kernel", help="folder of object files (%(default)s)")
    add(
        "--part",
        choices=("first", "demo", "all"),
        default="all",
        help="first: what the demo's first picture and a planner that is given targets need; demo: what the "
        "whole demo needs; all if absent",
    )
    add("--target", default="", choices=("", *TARGETS), help="another system; this one's library if absent")
    add("--levels", default="", help="classes of processors, with commas between; this machine's if absent")
    add("--after-stdin", action="store_true", help="link once standard input ends, as pip brings what links")
    add("--wheel", action="store_true", help="the library is taken to be as new as the source it lies with")
    add(
        "--jobs",
        type=int,
        default=len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count(),
    )
    given = parser.parse_args(arguments)
    try:
        return _built(given)
    except KeyboardInterrupt:
        sys.stderr.write("interrupted; the kernel is as it was before\n")
        return 130


def _built(given: argparse.Namespace) -> int:
    began = now()
    library.BUILDING = True  # before the formulas are imported
    try:
        from ftqp.kernel.entry.table import PARTS

        away = TARGETS.get(given.target)
        machine = platform.machine() if away is None else away.machine
        known = LEVELS.get(machine, {})
        usual = level_here() if away is None or is_this_machine(away) else next(iter(known))
        levels = [name for name in (given.levels or usual or "").split(",") if name]
        if not levels or not set(levels) <= set(known):
            return _report_failure(
                given, f"no class of processors is named for {machine} ({levels or known})"
            )
        wanted: dict[str, Any] = dict.fromkeys(levels, PARTS[given.part])
        if _is_there(given, wanted, away):
            return 0
        try:
            from ftqp.kernel.building.store import Store, build
            from ftqp.kernel.compiled.making.emit import Target, target
        except (ImportError, AttributeError) as error:  # none, or one that is made otherwise inside
            return _report_failure(given, f"building needs numba and llvmlite ({error})")
        try:
            store = Store(given.store)
            with store.alone():
                if _is_there(given, wanted, away):
                    return 0
                triple = None if away is None or is_this_machine(away) else away.triple
                classes = [target(name) if triple is None else Target(triple, name) for name in levels]
                made = build(
                    given.out, wanted, classes, KERNEL, store, jobs=given.jobs, checked=not given.wheel,
                    ready=sys.stdin.read if given.after_stdin else None, away=away,
                )  # fmt: skip
        except CannotBuild as error:
            return _report_failure(given, str(error))
    except OSError as error:
        return _report_failure(given, f"{error.filename or given.out}: {error.strerror or error}")
    seconds, spent = 1e-9 * (now() - began), sum(os.times()[:4])
    sys.stderr.write(f"the kernel is built: {made} units compiled, {seconds:.0f} s, {spent:.0f} s of CPU\n")
    return 0


def _is_there(given: argparse.Namespace, wanted: dict[str, Any], away: BuildTarget | None) -> bool:
    """Whether the library is there and made from this code; new comments are noted in its manifest."""
    try:
        said = json.loads((given.out / MANIFEST).read_bytes())
        facts = platform_facts() | ({"target": ""} if away is None else away.facts)
        if {name: said.get(name, "") for name in facts} != facts or said["code"] != code_key(KERNEL):
            return False
        found = {one["level"]: one["entries"] for one in said["libraries"]}
        there = all((given.out / one["file"]).is_file() for one in said["libraries"])
    except (OSError, ValueError, KeyError, TypeError):
        return False
    for level, pairs in wanted.items():
        if {one.symbol for one in pairs} - set(found.get(level, ())):
            return False
    if there and not given.wheel and said["files"] != file_key(KERNEL):
        describe(given.out, **{**said, "files": file_key(KERNEL)})
    return there


def _report_failure(given: argparse.Namespace, reason: str) -> int:
    """Say why there is no library, here and in the manifest, unless one is there that is marked as older."""
    sys.stderr.write(f"the kernel is not built: {reason}\n")
    with contextlib.suppress(OSError):  # a folder that cannot be written is the reason itself
        if given.wheel or not (given.out / MANIFEST).exists():
            describe(given.out, reason=reason)
    return 1


if __name__ == "__main__":
    sys.exit(main())
