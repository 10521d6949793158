"""How the recurrent network converges: iterations against method, scaling, condition, bounds, tolerance.

    python solvers/study_dtrnn.py                           everything, some minutes
    python solvers/study_dtrnn.py --quick                   fewer and easier QPs, under a minute
    python solvers/study_dtrnn.py --parts square,recorded   some parts only

Parts: square (every objective on the path of Jin et al. 2017, cold and warm), recorded (iterations and
certificates of infeasibility on the recorded sequences), random (condition, active bounds, tolerance). Counts
iterations, not time. Tables go to the screen; tables and one JSON object to ``--out``. Nothing is a pass or a
fail.
"""

import argparse
import sys
from collections.abc import Sequence
from typing import Any

from bench import command_line
from bench.results import add_out, circumstances, stem
from comparison import console, dtrnn_study_report
from comparison import dtrnn_study_parts as parts
from comparison.dtrnn_study import contenders
from rich.console import Console

from ftqp.core.errors import InputError, unknown

PARTS = ("square", "recorded", "random")


def main() -> int:
    """Measures, prints, writes."""
    return console.run(options(), studied, dtrnn_study_report.tables, dtrnn_study_report.markdown)


def options(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """What the command line asks for."""
    parser = command_line.parser(__doc__)
    add = parser.add_argument
    add("--parts", default=",".join(PARTS), metavar="A,B", help=f"of {', '.join(PARTS)} (default: all)")
    add("--quick", action="store_true", help="fewer and easier QPs")
    add_out(parser, "study_dtrnn")
    add("--name", metavar="NAME", help="added to the names of the files (quick, for a quick run)")
    add("--json", action="store_true", help="print one JSON object and nothing else")
    add("--update-readme", action="store_true", help="put the first table into solvers/README.md")
    chosen: argparse.Namespace = parser.parse_args(arguments)
    return chosen


def studied(chosen: argparse.Namespace, messages: Console) -> dict[str, Any]:
    """Every part that was asked for, as the object that ``--json`` prints."""
    wanted = [name.strip() for name in chosen.parts.split(",")]
    for name in wanted:
        if name not in PARTS:
            raise unknown("part", name, "the study", PARTS)
    if chosen.update_readme and "square" not in wanted:
        raise InputError(
            f"--update-readme needs the part square, got {chosen.parts}; add it or leave --parts out"
        )
    quick = chosen.quick
    result = circumstances("study_dtrnn", contenders(), {"quick": quick, "parts": ",".join(wanted)})
    cells: list[dict[str, Any]] = []
    if "square" in wanted:
        for objective in parts.objectives(quick):
            messages.print(f"the square with {objective}: six variants, cold and warm")
            cells += parts.on_square(objective)
    if "recorded" in wanted:
        messages.print("the recorded sequences: seven variants, cold and warm")
        cells += parts.recorded_sequences(quick)
    if "random" in wanted:
        messages.print("random QPs: condition, active bounds, tolerance")
        cells += [*parts.conditions(quick), *parts.active_bounds(quick), *parts.tolerances(quick)]
    return {
        **result,
        "name": stem("study_dtrnn", name=chosen.name, quick=quick),
        "cells": cells,
        "limitations": list(dtrnn_study_report.LIMITATIONS),
    }


if __name__ == "__main__":
    sys.exit(main())
