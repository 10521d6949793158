"""The folder of a study: a new one, or one that the study can go on in."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ftqp.app.output.console import say
from ftqp.app.run.runs import free_folder, holds
from ftqp.app.study.results_file import FILE_NAME, LOCK_NAME

LEFT = {LOCK_NAME, f"{LOCK_NAME}-journal"}
"""What a study leaves that ended before it had a results file."""


def study_folder(out: Path | None, name: str) -> Path:
    """The folder wanted where it holds results, or nothing but the lock of a study; else as for a run."""
    if out is not None and (holds(out, FILE_NAME) or _is_empty(out)):
        return out
    return free_folder(out, name)


@contextmanager
def told_how_to_go_on(folder: Path) -> Iterator[None]:
    """Whoever interrupts a study is told what goes on with it, which its folder is part of."""
    try:
        yield
    except KeyboardInterrupt:
        say(f"what is done is kept; the same command with --out {folder} goes on from there")
        raise


def _is_empty(folder: Path) -> bool:
    try:
        return {entry.name for entry in folder.iterdir()} <= LEFT
    except OSError:
        return False
