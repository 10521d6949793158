"""Says on a terminal how many pages of the site are made, and about how long the others will take."""

import sys
from time import monotonic
from typing import Any, Final

ROUNDS: Final = 2
"""Every page is read in one round and written in another."""
_state: dict[str, float] = {}


def left(done: int, pages: int, seconds: float) -> str:
    """The line after so many pages of both rounds."""
    rest = seconds * (ROUNDS * pages - done) / max(done, 1)
    return f"{done // ROUNDS} of {pages} pages, about {rest:.0f} s left"


def on_files(files: Any, config: Any) -> Any:
    """Count the pages."""
    _state.update(pages=len(files.documentation_pages()), done=0.0, begun=monotonic())
    return files


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
