"""Tables of results in docs/evidence/speed.md, and the reports of the small benchmarks."""

import argparse
import json
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from bench.results import appendix, folder, preamble, put_into_readme, written
from bench.tables import Table

ROOT = Path(__file__).resolve().parents[1]
SPEED = ROOT / "docs" / "evidence" / "speed.md"


def options(parser: argparse.ArgumentParser) -> None:
    """Add where results go: nowhere, unless told."""
    add = parser.add_argument
    add("--out", type=Path, metavar="DIR", help="write report and JSON there (default: nothing is written)")
    add("--update-docs", action="store_true", help="put it on record, and into docs/evidence/speed.md")
    add("--json", action="store_true", help="print one JSON object and nothing else")


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
        put_into_readme(result["benchmark"], [*lines, source], text)
    return list(places)


def told(result: dict[str, Any], title: str, tables: Sequence[Table], chosen: argparse.Namespace) -> None:
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
    lines = [*preamble(title, result), *(line for table in tables for line in table.markdown())]
    text = "\n".join([*lines, *appendix(result)])
    files = written(result, text, out, result["benchmark"])
    if chosen.update_docs and f"<!-- begin {result['benchmark']} -->" in SPEED.read_text(encoding="utf-8"):
        files += shown(result, files[0], {SPEED: tables})
    for file in files:
        sys.stderr.write(f"wrote {file}\n")
