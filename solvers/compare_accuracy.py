"""What solvers claim of recorded QPs, against what is true: KKT residuals, errors, infeasibility.

    python solvers/compare_accuracy.py                      every profile on every recorded sequence
    python solvers/compare_accuracy.py --quick              the first QPs of each sequence only
    python solvers/compare_accuracy.py --backends daqp-fast,osqp,my-profile.toml --sequences panda-healthy

Every QP is solved from a cold start and, in the order of its sequence, from a warm one. Each contender has a
process of its own and ``--limit`` seconds for a sequence: whoever hangs or crashes is left out of that
sequence, with the reason, and the others go on. No solver's flag is trusted. Tables go to the screen; tables,
figures and one JSON object to ``--out``. Nothing is a pass or a fail.
"""

import argparse
import sys
from contextlib import ExitStack
from typing import Any

from bench.contenders import Contender, contenders, split
from bench.isolation import Apart
from bench.results import circumstances
from comparison import accuracy_report, console
from comparison.accuracy import STARTS, Answers, every_answer, settled, summed_up
from comparison.recorded import Recorded, recorded
from comparison.sequences import sequences
from comparison.truth import Fact, Truth, truth
from rich.console import Console


def main() -> int:
    """Measures, prints, writes."""
    options = console.options(__doc__ or "")
    return console.run(options, compared, accuracy_report.tables, accuracy_report.markdown)


def compared(chosen: argparse.Namespace, messages: Console) -> dict[str, Any]:
    """Every contender on every sequence, as the object that ``--json`` prints."""
    ready, left_out = split(contenders(chosen.backends, quick=chosen.quick))
    recordings = sequences(chosen.sequences, quick=chosen.quick)
    result = circumstances("compare_accuracy", ready, {"quick": chosen.quick})
    about: dict[str, Any] = {}
    cells: list[dict[str, Any]] = []
    with ExitStack() as stack:
        processes = {who.name: stack.enter_context(Apart(chosen.limit)) for who in ready}
        for name, recording in recordings.items():
            sequence = recorded(name, recording)
            messages.print(f"solving {name}, {len(sequence)} QPs, {len(ready)} contenders")
            true = truth(sequence.problems, sequence.solutions, sequence.feasible)
            given = _answered(ready, processes, sequence, left_out)
            true = settled(true, [said for _, _, said in given])
            cells += [summed_up(who, sequence, start, said, true) for who, start, said in given]
            about[name] = _described(sequence, true)
    return {
        **result,
        "sequences": about,
        "cells": cells,
        "left_out": left_out,
        "limitations": list(accuracy_report.LIMITATIONS),
    }


def _answered(
    ready: list[Contender], processes: dict[str, Apart], sequence: Recorded, left_out: dict[str, str]
) -> list[tuple[Contender, str, Answers]]:
    """Who said what from which start; who cannot take this sequence says why."""
    given = []
    for who in ready:
        ended = processes[who.name].ask(every_answer, who, sequence)
        if ended.reason:
            left_out[f"{who.name} ({sequence.name})"] = ended.reason
        else:
            given += [(who, start, said) for start, said in zip(STARTS, ended.answer, strict=True)]
    return given


def _described(sequence: Recorded, true: Truth) -> dict[str, Any]:
    violations = sorted(float(value) for value in true.violations if value > 0.0)
    return {
        "size": list(sequence.size),
        "origin": sequence.origin,
        "facts": {fact.name.lower(): true.count(fact) for fact in Fact},
        "median_violation": violations[len(violations) // 2] if violations else None,
        "worst_reference": true.worst_reference,
        "disputed": true.disputed,
    }


if __name__ == "__main__":
    sys.exit(main())
