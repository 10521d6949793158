"""One scenario under every backend: the same arm, path and fault, another solver in the loop.

    python solvers/compare_closed_loop.py                            every installed backend, three cases
    python solvers/compare_closed_loop.py --quick                    short runs: shows that it works
    python solvers/compare_closed_loop.py my.toml --schemes mvn,mke  other scenarios and schemes
    python solvers/compare_closed_loop.py --backends active_set,osqp-fast,daqp

A run agrees with active_set when no joint is ever farther than 1e-6 rad from where it is there. Some schemes
are chaotic: every case is run twice with active_set, the second time from a start 1e-9 rad away, and where
that grows beyond 1e-6 rad, joint differences say nothing and invariants are compared instead: completion,
limits, task error. Each run has a process of its own and ``--limit`` seconds: a backend that hangs or crashes
is left out, with the reason. Tables go to the screen; longer ones, a figure a case and one JSON object to
``--out``. Nothing is a pass or a fail.
"""

import argparse
import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bench import command_line
from bench.contenders import REFERENCE, contenders, split
from bench.isolation import LIMIT
from bench.results import add_out, circumstances
from comparison import closed_loop_report, console
from comparison.closed_loop import AGREEMENT, NUDGE, Case, measured
from comparison.speed import on_one_core
from rich.console import Console

from ftqp.core.errors import InputError
from ftqp.qp import backends
from ftqp.qp.adapters.registry import PREFIX

PLANAR = ("path.duration=8.0", "faults.0.at=6.0")
CASES = (
    Case(scenario="planar6-square", quick=PLANAR),
    Case(scenario="planar6-square", scheme="mtn", quick=PLANAR),
    Case(scenario="panda-circle", quick=("path.duration=1.0", "path.radius=0.005", "faults.0.at=0.5")),
)
"""What is compared unless something is named: a published case, a chaotic one, a 7-joint arm."""


def main() -> int:
    """Measures, prints, writes."""
    chosen = options()
    with tempfile.TemporaryDirectory() as folder:

        def figures(result: dict[str, Any], out: Path, stem: str) -> list[Path]:
            drawn = sorted(Path(folder).glob("*.png"))
            return [Path(shutil.copy(file, out / f"{stem}-{file.name}")) for file in drawn]

        return console.run(
            chosen,
            lambda chosen, messages: compared(chosen, messages, Path(folder)),
            closed_loop_report.tables,
            closed_loop_report.markdown,
            figures,
        )


def options(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """What the command line asks for."""
    parser = command_line.parser(__doc__)
    add = parser.add_argument
    add("scenarios", nargs="*", metavar="SCENARIO", help="scenario files or bundled names")
    add("--schemes", type=_names, metavar="X,Y", help="schemes in place of the scenarios' own")
    add("--backends", type=_names, metavar="A,B", help="backends or profiles (default: all there are)")
    add("--quick", action="store_true", help="short runs")
    add("--limit", type=console.seconds, default=LIMIT, metavar="S", help="seconds for a run")
    add_out(parser, "compare_closed_loop")
    add("--name", metavar="NAME", help="added to the names of the files (quick, for a quick run)")
    add("--json", action="store_true", help="print one JSON object and nothing else")
    add("--update-readme", action="store_true", help="put the first table into solvers/README.md")
    chosen: argparse.Namespace = parser.parse_args(arguments)
    return chosen


def _names(text: str) -> list[str]:
    names = [name.strip() for name in text.split(",")]
    if not all(names):
        raise argparse.ArgumentTypeError(f"is {text!r}, expected names with commas between them")
    return list(dict.fromkeys(names))


def cases(chosen: argparse.Namespace) -> tuple[Case, ...]:
    """The scenarios and schemes that were named; the default cases when none was."""
    if not chosen.scenarios and not chosen.schemes:
        return CASES
    scenarios = chosen.scenarios or dict.fromkeys(case.scenario for case in CASES)
    known = {case.scenario: case.quick for case in CASES}
    return tuple(
        Case(scenario=scenario, scheme=scheme, **({"quick": known[scenario]} if scenario in known else {}))
        for scenario in scenarios
        for scheme in chosen.schemes or (None,)
    )


def _slow(name: str, *, quick: bool) -> bool:
    """Whether it is left out: those of qpsolvers in a quick run, and the row that stands for all of them."""
    return name.startswith(PREFIX) and (quick or "<" in name)


def compared(chosen: argparse.Namespace, messages: Console, folder: Path) -> dict[str, Any]:
    """Every contender on every case, as the object that ``--json`` prints; figures go into ``folder``."""
    names = chosen.backends or [info.name for info in backends() if not _slow(info.name, quick=chosen.quick)]
    ready, left_out = split(contenders(list(dict.fromkeys([REFERENCE, *names]))))
    if chosen.quick and not chosen.backends:
        left_out[f"{PREFIX}<name>"] = "a quick run leaves out what is set up anew at every step"
    todo = cases(chosen)
    titles = [case.title() for case in todo]
    if repeated := sorted({title for title in titles if titles.count(title) > 1}):
        raise InputError(f"{repeated[0]} is asked for twice, expected once")
    settings = {"quick": chosen.quick, "core": on_one_core(), "agreement": AGREEMENT, "nudge": NUDGE}
    result = circumstances("compare_closed_loop", ready, settings)
    cells: list[dict[str, Any]] = []
    about: list[dict[str, Any]] = []
    for case, title in zip(todo, titles, strict=True):
        messages.print(f"running {title} with {len(ready)} backends")
        rows, facts, declined = measured(case, ready, folder, quick=chosen.quick, seconds=chosen.limit)
        cells += rows
        about.append(facts)
        left_out |= {f"{who} ({title})": why for who, why in declined.items()}
    return {
        **result,
        "cases": about,
        "cells": cells,
        "left_out": left_out,
        "limitations": list(closed_loop_report.LIMITATIONS),
    }


if __name__ == "__main__":
    sys.exit(main())
