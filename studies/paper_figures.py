"""Every figure and table of the five papers that shows a result, made again, and put into its page.

    python studies/paper_figures.py [--out DIR] [--page FILE]     or: make papers

Half a minute on two cores. Pictures go to docs/pictures/papers, the page is docs/evidence/paper-figures.md:
what stands there between markers is written anew. A single figure: ``python studies/holt1994.py --figures
DIR --only 7``.
"""

import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path
from typing import Any

from bench import command_line
from bench.results import ROOT, inserted
from papers.beside import PAPERS

from ftqp.core.errors import FtqpError

PAGE = ROOT / "docs" / "evidence" / "paper-figures.md"
PICTURES = ROOT / "docs" / "pictures" / "papers"


def made(name: str, folder: Path) -> dict[str, Any]:
    """Draw the figures of one paper; what they show."""
    command = [sys.executable, str(ROOT / "studies" / f"{name}.py"), "--figures", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(done.stderr.strip())
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def lines(sheet: dict[str, Any], folder: Path, page: Path) -> list[str]:
    """What goes between the markers of a figure."""
    text = [f"**Ours**: {sheet['ours']}."]
    for k, row in enumerate(sheet["table"]):
        text += [*([] if k else [""]), f"| {' | '.join(row)} |", *([] if k else [f"|{'---|' * len(row)}"])]
    if sheet["file"]:
        place = Path(os.path.relpath(folder.resolve() / sheet["file"], page.resolve().parent)).as_posix()
        text += ["", f"![{sheet['ours']}]({place})"]
    return text


def main() -> int:
    """Draw all and fill the page; 0, or 2 for bad input."""
    parser = command_line.parser(__doc__)
    parser.add_argument("--out", type=Path, default=PICTURES, metavar="DIR", help="where pictures go")
    parser.add_argument(
        "--page", type=Path, default=PAGE, metavar="FILE", help="the page (default: that of the docs)"
    )
    given = parser.parse_args()
    try:
        text = given.page.read_text(encoding="utf-8")
        with ThreadPoolExecutor(2) as pool:
            found = list(pool.map(lambda name: made(name, given.out), PAPERS))
        for name, sheets in zip(PAPERS, found, strict=True):
            for key, sheet in sheets.items():
                text = inserted(text, f"{name} {key}", lines(sheet, given.out, given.page))
        made_with = f"ftqp {version('ftqp')}, numpy {version('numpy')}, scipy {version('scipy')}"
        given.page.write_text(inserted(text, "versions", [f"Made with {made_with}."]), encoding="utf-8")
    except (FtqpError, OSError) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    sys.stderr.write(f"wrote {given.page}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
