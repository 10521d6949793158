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

from bench import docs, study
from bench.contenders import Contender, contenders, split
from bench.isolation import LIMIT, Apart
from bench.results import README, folder, versions
from comparison import accuracy_report
from comparison.accuracy import STARTS, Answers, every_answer, settled, summed_up
from comparison.recorded import Recorded, recorded
from comparison.sequences import sequences
from comparison.truth import Fact, Truth, truth

from ftqp import FtqpError

NAME = "compare_accuracy"


def main() -> int:
    """Measures, prints, writes: 0 when somebody took part, 1 when nobody, 2 for bad input."""
    parser = study.options(__doc__, NAME, "first QPs of each sequence, no paper profiles")
    add = parser.add_argument
    add("--backends", type=_names, metavar="A,B", help="profiles or backends (default: every profile)")
    add("--sequences", type=_names, metavar="A,B", help="recorded sequences (default: all)")
    add("--limit", type=_seconds, default=LIMIT, metavar="S", help="seconds for a contender and sequence")
    add("--update-readme", action="store_true", help="put the summary into solvers/README.md")
    given = parser.parse_args()
    title = "Claims of QP solvers against the truth"
    try:
        result = study.on_record(
            given, title, compared, accuracy_report.every_table, accuracy_report.LIMITATIONS
        )
        if given.update_readme:
            report = folder(NAME) / f"{NAME}.md"
            docs.shown(result, report, {README: accuracy_report.tables(result)[:1]})
    except FtqpError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    return 0 if result["cells"] else 1


def _seconds(text: str) -> float:
    value = float(text)
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"is {text}, expected seconds above 0")
    return value


def _names(text: str) -> list[str]:
    names = [name.strip() for name in text.split(",") if name.strip()]
    if not names:
        raise argparse.ArgumentTypeError("is empty, expected names with commas between them")
    return names


def compared(chosen: argparse.Namespace) -> dict[str, Any]:
    """Every contender on every sequence, as the object that ``--json`` prints."""
    ready, left_out = split(contenders(chosen.backends, quick=chosen.quick))
    recordings = sequences(chosen.sequences, quick=chosen.quick)
    about: dict[str, Any] = {}
    cells: list[dict[str, Any]] = []
    with ExitStack() as stack:
        processes = {who.name: stack.enter_context(Apart(chosen.limit)) for who in ready}
        for name, recording in recordings.items():
            sequence = recorded(name, recording)
            sys.stderr.write(f"solving {name}, {len(sequence)} QPs, {len(ready)} contenders\n")
            true = truth(sequence.problems, sequence.solutions, sequence.feasible)
            given = _answered(ready, processes, sequence, left_out)
            true = settled(true, [said for _, _, said in given])
            cells += [summed_up(who, sequence, start, said, true) for who, start, said in given]
            about[name] = _described(sequence, true)
    return {
        "versions": versions(ready),
        "contenders": {who.name: who.settings for who in ready},
        "sequences": about,
        "cells": cells,
        "left_out": left_out,
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
