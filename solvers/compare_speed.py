"""How long solvers take for recorded QPs: set-up apart from solving, cold and warm, p50, p99 and worst.

    python solvers/compare_speed.py                      every profile on every recorded sequence
    python solvers/compare_speed.py --quick              shows that it works; figures mean little
    python solvers/compare_speed.py --backends active_set,daqp-fast,osqp --sequences panda-healthy

One core; the contenders take turns, so that noise hits all alike, and each is compared with active_set in the
same run. Each has a process of its own and ``--limit`` seconds for a turn: whoever hangs or crashes is left
out of that sequence, with the reason, and the others go on. Tables go to the screen; tables, figures and one
JSON object to ``--out``. Nothing is a pass or a fail.
"""

import argparse
import sys
from contextlib import ExitStack
from dataclasses import asdict
from typing import Any

from bench.contenders import contenders, split
from bench.isolation import Apart
from bench.results import circumstances
from comparison import console, speed_report
from comparison.recorded import recorded
from comparison.sequences import sequences
from comparison.speed import EMPTY, FULL, QUICK, measured, on_one_core
from comparison.truth import Fact, truth
from rich.console import Console


def main() -> int:
    """Measures, prints, writes."""
    options = console.options(__doc__ or "")
    return console.run(options, compared, speed_report.tables, speed_report.markdown)


def compared(chosen: argparse.Namespace, messages: Console) -> dict[str, Any]:
    """Every contender on every sequence, as the object that ``--json`` prints."""
    ready, left_out = split(contenders(chosen.backends, quick=chosen.quick))
    recordings = sequences(chosen.sequences, quick=chosen.quick)
    settings = QUICK if chosen.quick else FULL
    told = {"quick": chosen.quick, "core": on_one_core(), **asdict(settings)}
    result = circumstances("compare_speed", ready, told)
    about: dict[str, Any] = {}
    cells: list[dict[str, Any]] = []
    with ExitStack() as stack:
        processes = {
            name: stack.enter_context(Apart(chosen.limit)) for name in (EMPTY, *(who.name for who in ready))
        }
        for name, recording in recordings.items():
            sequence = recorded(name, recording)
            messages.print(f"timing {name}, {len(sequence)} QPs, {len(ready)} contenders")
            facts = truth(sequence.problems, sequence.solutions, sequence.feasible)
            solvable = len(sequence) - facts.count(Fact.INFEASIBLE)
            found, declined = measured(ready, processes, sequence, settings, solvable)
            cells += found
            left_out |= {f"{who} ({name})": why for who, why in declined.items()}
            about[name] = {
                "qps": len(sequence),
                "size": list(sequence.size),
                "infeasible": facts.count(Fact.INFEASIBLE),
                "origin": sequence.origin,
            }
    return {
        **result,
        "sequences": about,
        "cells": cells,
        "left_out": left_out,
        "limitations": list(speed_report.LIMITATIONS),
    }


if __name__ == "__main__":
    sys.exit(main())
