"""What the comparison scripts share on the command line: options, the loop over stages, the exit code."""

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from bench import command_line, docs
from bench.isolation import LIMIT
from bench.results import README, stem, written
from bench.tables import Table
from rich.console import Console

from ftqp import FtqpError

WIDTH = 100
"""Columns of a table that does not go to a terminal."""

Comparison = Callable[[argparse.Namespace, Console], dict[str, Any]]


def options(document: str, arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """The options that every comparison has; ``document`` is the script's docstring."""
    parser = command_line.parser(document)
    add = parser.add_argument
    add("--backends", type=_names, metavar="A,B", help="profiles or backends (default: every profile)")
    add("--sequences", type=_names, metavar="A,B", help="recorded sequences (default: all)")
    add("--quick", action="store_true", help="first QPs of each sequence, no paper profiles")
    add("--limit", type=seconds, default=LIMIT, metavar="S", help="seconds for a contender and sequence")
    add("--out", type=Path, default=README.parent / "results", metavar="DIR", help="where results go")
    add("--name", metavar="NAME", help="added to the names of the files (quick, for a quick run)")
    add("--json", action="store_true", help="print one JSON object and nothing else")
    add("--update-readme", action="store_true", help="put the summary into solvers/README.md")
    chosen: argparse.Namespace = parser.parse_args(arguments)
    return chosen


def seconds(text: str) -> float:
    """A time above 0, for ``type`` of an option."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"is {text!r}, expected seconds above 0")
    return value


def _names(text: str) -> list[str]:
    names = [name.strip() for name in text.split(",") if name.strip()]
    if not names:
        raise argparse.ArgumentTypeError("is empty, expected names with commas between them")
    return names


def run(
    chosen: argparse.Namespace,
    compared: Comparison,
    tables: Callable[[dict[str, Any]], list[Table]],
    markdown: Callable[[dict[str, Any]], str],
    figures: Callable[[dict[str, Any], Path, str], list[Path]] = lambda *_: [],
) -> int:
    """Measure, print, write: 0 when somebody took part, 1 when nobody, 2 for bad input, 130 when interrupted.

    The first of ``tables`` goes into the README; ``figures`` writes pictures into a folder, under a stem.
    """
    messages = Console(stderr=True, highlight=False)
    try:
        result = compared(chosen, messages)
        name = stem(result["benchmark"], name=chosen.name, quick=chosen.quick)
        files = written(result, markdown(result), chosen.out, name, figures)
        if chosen.update_readme:
            files += docs.shown(result, files[0], {README: tables(result)[:1]})
    except KeyboardInterrupt:
        messages.print("interrupted; nothing was written")
        return 130
    except FtqpError as error:
        messages.print(str(error), style="red", soft_wrap=True, markup=False)
        return 2
    if chosen.json:
        sys.stdout.write(json.dumps(result) + "\n")
    else:
        screen = Console(highlight=False, width=None if sys.stdout.isatty() else WIDTH)
        for table in tables(result):
            screen.print(table.rich())
            screen.print()
        for who, why in result["left_out"].items():
            screen.print(f"{who} could not take part: {why}", markup=False)
    for file in files:
        messages.print(f"wrote {file}", soft_wrap=True)
    return 0 if result["cells"] else 1
