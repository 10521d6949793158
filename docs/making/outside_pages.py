"""Pages of the site that lie outside docs/: README, the folders of scripts with results, changelog, examples.

Links are written for readers of the repository, file to file; here they are turned to where the site has it.
"""

import posixpath
import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[2]
MOVED = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "SECURITY.md": "security.md",
    "CITATION.cff": "CITATION.cff",
    "LICENSE": "LICENSE.txt",
}
"""Files of the root and where the site has them."""
FOLDERS = {
    "examples": "gallery.md",
    "solvers": "solvers/README.md",
    "solvers/results": "solvers/README.md",
    "benchmarks": "benchmarks/README.md",
    "benchmarks/results": "benchmarks/README.md",
    "studies": "studies/README.md",
    "studies/results": "studies/README.md",
    "solvers/problems": "solvers/problems/README.md",
    "docs/theory": "theory/README.md",
}
"""Folders that a text links to, and the page that shows what is in them."""
SCRIPTS = ("solvers", "benchmarks", "studies")
SHOWN = (
    *(f"{folder}/{what}" for folder in SCRIPTS for what in ("README.md", "results/*.[mp][dn]*")),
    "solvers/problems/README.md",
    "examples/*.py",
    "notebooks/*.ipynb",
)
LINK = re.compile(r"(\]\()([^)\s#:]+)(#[^)\s]*)?\)")


def outside() -> dict[str, Path]:
    """The files outside docs/ by their place in the site; of results, those that git keeps."""
    found = {place: ROOT / name for name, place in MOVED.items()}
    for pattern in SHOWN:
        for file in sorted(ROOT.glob(pattern)):
            if not re.search(r"-quick|-part\.", file.name):
                found[file.relative_to(ROOT).as_posix()] = file
    return found


def on_files(files: Files, config: Any) -> Files:
    """Add them to the files of the site."""
    for place, file in outside().items():
        if place.endswith(".md"):
            files.append(File.generated(config, place, content=file.read_text(encoding="utf-8")))
        else:
            files.append(File.generated(config, place, abs_src_path=str(file)))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Turn the links of a page."""
    return turned(markdown, page.file.src_uri)


def turned(markdown: str, place: str) -> str:
    """A page's text with its links as the site has them.

    Args:
        markdown: The text as it lies in the repository.
        place: Where the site has the page.
    """
    home = posixpath.dirname(in_repository(place))

    def turn(link: re.Match[str]) -> str:
        target = in_site(posixpath.normpath(posixpath.join(home, link[2])))
        return f"{link[1]}{posixpath.relpath(target, posixpath.dirname(place) or '.')}{link[3] or ''})"

    return LINK.sub(turn, markdown)


def in_repository(place: str) -> str:
    """Where the repository has a page of the site."""
    for name, moved in MOVED.items():
        if place == moved:
            return name
    return place if place.split("/")[0] in (*SCRIPTS, "examples") else f"docs/{place}"


def in_site(name: str) -> str:
    """Where the site has a file of the repository."""
    name = FOLDERS.get(name, name)
    return MOVED.get(name) or name.removeprefix("docs/")
