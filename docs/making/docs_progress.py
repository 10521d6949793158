"""Says how many pages are made and how long the others take; the search finds pages for users first."""

import sys
from time import monotonic
from typing import Any, Final

ROUNDS: Final = 2
"""Every page is read in one round and written in another."""
AHEAD: Final = {"": 4.0, "how-to/": 4.0, "reference/": 1.0}
"""By the folder of a page how much more a hit of the search counts there; what is in no row comes last."""
LAST: Final = 0.2
BEHIND: Final = ("changelog.md", "history.md", "references.md", "contributing.md", "security.md")
_state: dict[str, float] = {}


def left(done: int, pages: int, seconds: float) -> str:
    """The line after so many pages of both rounds."""
    rest = seconds * (ROUNDS * pages - done) / max(done, 1)
    return f"{done // ROUNDS} of {pages} pages, about {rest:.0f} s left"


def on_files(files: Any, config: Any) -> Any:
    """Count the pages."""
    _state.update(pages=len(files.documentation_pages()), done=0.0, begun=monotonic())
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """A user who searches wants the page that says how, not the derivation or the record of a measurement."""
    folder, _, name = page.file.src_uri.rpartition("/")
    top = "reference/" if folder.startswith("reference") else f"{folder}/" if folder else ""
    known = AHEAD.get(top, LAST) if name not in BEHIND else LAST
    page.meta.setdefault("search", {"boost": known})
    return markdown


def _one_more() -> None:
    _state["done"] += 1.0
    if sys.stderr.isatty():
        line = left(int(_state["done"]), int(_state["pages"]), monotonic() - _state["begun"])
        sys.stderr.write(f"\r{line:<60}" + ("\n" if _state["done"] == ROUNDS * _state["pages"] else ""))


def on_page_content(html: str, page: Any, config: Any, files: Any) -> str:
    """A page was read."""
    _one_more()
    return html


def on_post_page(output: str, page: Any, config: Any) -> str:
    """A page is written."""
    _one_more()
    return output
