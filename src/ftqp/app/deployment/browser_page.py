"""``ftqp build --page``: a page with the planner in it, for a browser without a server."""

import os
import tempfile
from pathlib import Path
from typing import Any

from ftqp.app.deployment.arm_file import kernel_hash
from ftqp.app.deployment.built_folder import TEXTS, Wanted, build_folder
from ftqp.control.paths.path import Path as Way
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.viz.playground.playground_page import Played, playground_page


def write_page(wanted: Wanted, q: FloatArray, path: Way | None, page: Path) -> dict[str, Any]:
    """Build the library for browsers, write the page with it, and return the bill of the library.

    Args:
        wanted: What is built, for wasm32, into its folder.
        q: Where the arm begins, (nv,) [rad or m].
        path: What is followed; None holds the pose of the start.
        page: The file.
    """
    if page.exists():
        raise InputError(f"file {page} is there already; give a new one with --page")
    if not page.absolute().parent.is_dir():
        raise InputError(f"folder {page.absolute().parent} is missing, in which {page.name} would be made")
    with tempfile.TemporaryDirectory(prefix=f".{page.name}.", dir=page.absolute().parent) as part:
        bill = build_folder(wanted)
        played = Played(
            title=wanted.name,
            planner=wanted.planner,
            q=q,
            path=path,
            kernel=kernel_hash(),
            wasm=(wanted.folder / "lib" / "ftqp.wasm").read_bytes(),
            arm=(wanted.folder / "arm.ftqp").read_bytes(),
            loader=(TEXTS / "ftqp.mjs").read_text(encoding="utf-8"),
        )
        made = Path(part) / "page"
        made.write_text(playground_page(played), encoding="utf-8")
        os.rename(made, page)
    return bill
