"""Tables of results in docs/evidence/speed.md, and the reports of the small benchmarks."""

import argparse
import json
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from bench import command_line
from bench.results import appendix, circumstances, folder, inserted, preamble, written
from bench.tables import Table

ROOT = Path(__file__).resolve().parents[1]
SPEED = ROOT / "docs" / "evidence" / "speed.md"


def options(parser: argparse.ArgumentParser) -> None:
    """Add where results go: nowhere, unless told."""
    add = parser.add_argument
    add("--out", type=Path, metavar="DIR", help="write report and JSON there (default: nothing is written)")
    add("--update-docs", action="store_true", help="put it on record, and into docs/evidence/speed.md")
    add("--json", action="store_true", help="print one JSON object and nothing else")


def asked(document: str | None, quick: str = "", **counts: tuple[int, str]) -> argparse.Namespace:
    """The options of a benchmark: how many of what, by default and in words, and what ``--quick`` takes."""
    parser = command_line.parser(document)
    for name, (default, of) in counts.items():
        told = f"{of} (default {default})"
        parser.add_argument(
            f"--{name}", type=command_line.at_least_one, default=default, metavar="N", help=told
        )
    if quick:
        parser.add_argument("--quick", action="store_true", help=quick)
    options(parser)
    return parser.parse_args()


def measured(
    benchmark: str, settings: dict[str, Any], rows: Any, limitations: Sequence[str], **more: Any
) -> dict[str, Any]:
    """The result of a benchmark, with the machine, the versions and the command."""
    return circumstances(benchmark, [], settings) | {"rows": rows, "limitations": list(limitations)} | more


def report(title: str, result: dict[str, Any], tables: Sequence[Table]) -> str:
    """The whole report of a result, in Markdown."""
    lines = [line for table in tables for line in table.markdown()]
    return "\n".join([*preamble(title, result), *lines, *appendix(result)])


def shown(result: dict[str, Any], report: Path, places: Mapping[Path, Sequence[Table]]) -> list[Path]:
    """Put tables of a result between its markers in texts, with where they come from; returns the texts.

    Raises:
        InputError: A text has no markers of the benchmark.
    """
    machine = f"{result['machine']['cpu']}, {result['machine']['cores']} cores"
    for text, tables in places.items():
        link = f"[{report.name}]({Path(os.path.relpath(report, text.parent)).as_posix()})"
        source = f"From {link}, {result['date'][:10]}, {machine}. Made by `{result['command']}`."
        lines = [line for table in tables for line in table.markdown(3)]
        said = inserted(text.read_text(encoding="utf-8"), result["benchmark"], [*lines, source])
        text.write_text(said, encoding="utf-8")
    return list(places)


def publish(result: dict[str, Any], title: str, tables: Sequence[Table], chosen: argparse.Namespace) -> None:
    """Print a result and, where asked for, write its report and what speed.md in docs/evidence has of it."""
    if chosen.json:
        sys.stdout.write(json.dumps(result) + "\n")
    else:
        screen = Console(highlight=False)
        for table in tables:
            screen.print(table.rich())
    out = chosen.out or (folder(result["benchmark"]) if chosen.update_docs else None)
    if out is None:
        return
    files = written(result, report(title, result, tables), out, result["benchmark"])
    if chosen.update_docs and f"<!-- begin {result['benchmark']} -->" in SPEED.read_text(encoding="utf-8"):
        files += shown(result, files[0], {SPEED: tables})
    for file in files:
        sys.stderr.write(f"wrote {file}\n")
