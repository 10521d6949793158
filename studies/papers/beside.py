"""A paper's figures beside ours: a table, pictures, and a report of both."""

import argparse
import json
import platform
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from datetime import date
from importlib import metadata
from pathlib import Path
from typing import Any

from bench import results

PACKAGES = ("ftqp", "numpy", "numba", "pin")


@dataclass(frozen=True)
class Row:
    """One figure of a paper, in words, and what ftqp finds."""

    figure: str
    published: str
    ours: str


@dataclass(frozen=True)
class Found:
    """What a script found: rows of the table, and what draws its pictures, by a word each."""

    rows: Sequence[Row]
    pictures: dict[str, Callable[[Path], Any]]


def told(name: str, title: str, doc: str, page: str, work: Callable[[bool], Found]) -> None:
    """The command line of a script: do the work, draw, and write or print the table.

    Args:
        name: Of the script.
        title: Of the report.
        doc: What --help says.
        page: The page that explains what differs.
        work: Does it, a part of it where it is to be quick.
    """
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a part of it")
    parser.add_argument("--json", action="store_true", help="print the table as JSON and write nothing")
    results.add_out(parser, name)
    given = parser.parse_args()
    found = work(given.quick)
    result = {
        "command": " ".join(["python", f"studies/{name}.py", *sys.argv[1:]]),
        "date": date.today().isoformat(),
        "machine": f"{platform.machine()} {platform.system()}",
        "versions": {"python": platform.python_version()}
        | {package: metadata.version(package) for package in PACKAGES},
        "rows": [asdict(row) for row in found.rows],
    }
    if given.json:
        print(json.dumps(result))
        return
    text = _markdown(title, page, result)

    def drawn(_: dict[str, Any], folder: Path, stem: str) -> list[Path]:
        files = []
        for word, draw in found.pictures.items():
            files.append(folder / f"{stem}-{word}.png")
            draw(files[-1])
        return files

    stem = results.stem(name, name=None, quick=given.quick)
    results.written(result, text, given.out, stem, drawn)
    print(text)


def _markdown(title: str, page: str, result: dict[str, Any]) -> str:
    """The report."""
    versions = ", ".join(f"{name} {result['versions'][name]}" for name in PACKAGES)
    lines = [
        f"# {title}",
        "",
        f"`{result['command']}`, {result['date']}, {result['machine']}, "
        f"Python {result['versions']['python']}, {versions}. "
        f"What differs from the paper, and why, is on [its page](../../docs/evidence/{page}).",
        "",
        "| figure of the paper | published | ftqp |",
        "|---|---|---|",
    ]
    lines += [f"| {row['figure']} | {row['published']} | {row['ours']} |" for row in result["rows"]]
    return "\n".join(lines) + "\n"
