"""A paper's figures beside ours: a table, pictures, and a report of both; and each figure by itself."""

import argparse
import json
import platform
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import date
from pathlib import Path
from typing import Any

from bench import results

from ftqp.core.errors import FtqpError, InputError

PAPERS = {
    "bedrossian1993": "Bedrossian 1993",
    "holt1994": "Holt and Desrochers 1994",
    "goel2005": "Goel et al. 2005",
    "zhang2016": "Zhang et al. 2016",
    "jin2017": "Jin et al. 2017",
}
"""The papers, by the names of their scripts."""
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


@dataclass(frozen=True)
class Sheet:
    """A figure or table of a paper, made again.

    Attributes:
        ours: What it shows, in numbers.
        values: The same by name, for whoever checks them.
        draw: Draws it to a file under a title; None where it is a table.
        table: Its rows, the head first.
        file: The picture; after its script and its name if empty.
    """

    ours: str
    values: dict[str, Any]
    draw: Callable[[Path, str], Any] | None = None
    table: Sequence[Sequence[str]] = ()
    file: str = ""


Sheets = Mapping[str, Callable[[], Sheet]]
"""What makes each figure (``"7"``) and table (``"table 2"``) of a paper, in its order."""


def draw_loop(*given: Any, **options: Any) -> Any:
    """`ftqp.viz.figures.loop_picture.draw_loop`; matplotlib is loaded, or missed, here."""
    from ftqp.viz.figures.loop_picture import draw_loop as draw

    return draw(*given, **options)


def add_figures(parser: argparse.ArgumentParser) -> None:
    """Add the folder of the figures, and which one is wanted."""
    publish = "draw the paper's figures and tables one by one into DIR, and nothing else"
    parser.add_argument("--figures", type=Path, metavar="DIR", help=publish)
    parser.add_argument("--only", metavar="NAME", help="that figure or table alone: 7, or 'table 2'")


def drawn_sheets(name: str, sheets: Sheets, folder: Path, only: str | None) -> int:
    """Draw the figures of a paper, and print as JSON what they show; 0, or 2 for bad input."""
    found = {}
    try:
        if only is not None and only not in sheets:
            raise InputError(f"--only {only}: no such figure of {name}; it has {', '.join(sheets)}")
        from ftqp.viz.figures.canvas import made_folder

        made_folder(folder)
        for key in sheets if only is None else [only]:
            sheet = sheets[key]()
            file = sheet.file or f"{name}-{key.replace(' ', '-')}.png"
            if sheet.draw is not None:
                sheet.draw(folder / file, f"{PAPERS[name]}, figure {key}")
            found[key] = asdict(replace(sheet, draw=None, file=file if sheet.draw else ""))
    except FtqpError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    print(json.dumps(found))
    return 0


def publish(name: str, title: str, doc: str, page: str, work: Callable[[bool], Found], sheets: Sheets) -> int:
    """The command line of a script: do the work, draw, write or print the table; 0, or 2 for bad input.

    Args:
        name: Of the script.
        title: Of the report.
        doc: What --help says.
        page: The page that explains what differs.
        work: Does it, a part of it where it is to be quick.
        sheets: What makes each figure and table of the paper.
    """
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a part of it")
    parser.add_argument("--json", action="store_true", help="print the table as JSON and write nothing")
    results.add_out(parser, name)
    add_figures(parser)
    given = parser.parse_args()
    if given.figures is not None:
        return drawn_sheets(name, sheets, given.figures, given.only)
    found = work(given.quick)
    result = {
        "command": " ".join(["python", f"studies/{name}.py", *sys.argv[1:]]),
        "date": date.today().isoformat(),
        "machine": f"{platform.machine()} {platform.system()}",
        "versions": {"python": platform.python_version()} | results.packages(PACKAGES),
        "rows": [asdict(row) for row in found.rows],
    }
    if given.json:
        print(json.dumps(result))
        return 0
    text = _markdown(title, page, result)

    def drawn(_: dict[str, Any], folder: Path, stem: str) -> list[Path]:
        files = []
        for word, draw in found.pictures.items():
            files.append(folder / f"{stem}-{word}.png")
            draw(files[-1])
        return files

    results.written(result, text, given.out, f"{name}-quick" if given.quick else name, drawn)
    print(text)
    return 0


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
