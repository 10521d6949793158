"""A study on the command line: it measures, and its tables and numbers go on record."""

import argparse
import json
import logging
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from time import process_time
from typing import Any

from bench import command_line, docs, results
from bench.tables import Table

BESIDE = ("pin", "mujoco", "example-robot-data")
"""Packages whose versions are told where a study has loaded them; the last has no module."""


def options(document: str | None, name: str, quick: str) -> argparse.ArgumentParser:
    """The parser of a study; ``quick`` says what that option leaves."""
    parser = command_line.parser(document)
    parser.add_argument("--quick", action="store_true", help=quick)
    parser.add_argument("--json", action="store_true", help="print the numbers as JSON and write nothing")
    results.add_out(parser, name)
    return parser


def on_record(
    given: argparse.Namespace,
    title: str,
    measure: Callable[[argparse.Namespace], dict[str, Any]],
    tables: Callable[[dict[str, Any]], Sequence[Table]],
    limitations: Sequence[str],
    *,
    quick: bool | None = None,
    figures: Callable[[dict[str, Any], Path, str], list[Path]] | None = None,
) -> dict[str, Any]:
    """Measure, print and write; returns the result, with what was measured.

    Args:
        given: The options that were given, those of ``options`` among them.
        title: Of the report.
        measure: From the options to the numbers.
        tables: From the numbers to what a reader sees.
        limitations: What they do not say.
        quick: Whether the result stands beside that of a full run; None asks ``given.quick``.
        figures: As of ``results.written``; None draws none.
    """
    logging.getLogger("ftqp").setLevel(logging.ERROR)
    name, began = Path(sys.argv[0]).stem, process_time()
    left_out = ("out", "json", "quick", *(option.lstrip("-") for option in results.PLACES))
    settings = {name: it for name, it in vars(given).items() if name not in left_out and it is not None}
    quick = given.quick if quick is None else quick
    found = measure(given)
    result = results.circumstances(name, [], settings | {"processor_seconds": round(process_time() - began)})
    loaded = [one for one in BESIDE if {"pin": "pinocchio"}.get(one, one).replace("-", "_") in sys.modules]
    result["versions"] |= results.packages(loaded)
    result |= found | {"limitations": list(limitations)}
    if given.json:
        print(json.dumps(result))
        return result
    report = docs.report(title, result, tables(result))
    results.written(result, report, given.out, f"{name}-quick" if quick else name, figures)
    print(report)
    return result
