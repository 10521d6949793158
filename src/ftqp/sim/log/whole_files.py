"""New files and folders that are there whole or not at all, and never in place of another."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ftqp.core.errors import InputError

OTHER_NAME = "choose another name"
"""What to do where a file or folder exists already, unless its owner says something else."""


@contextmanager
def whole_file(path: str | Path, kind: str = "file", remedy: str = OTHER_NAME) -> Iterator[Path]:
    """A new file: the body writes the path that it gets, and the file gets its name when it is complete."""
    file = Path(path)
    _refuse_existing(file, kind, remedy)
    part = file.with_name(f".{file.name}.{os.getpid()}.part")
    try:
        yield part
        _rename(part, file, kind, remedy)
    except FileExistsError as error:
        raise InputError(f"{kind} {file} exists already; {remedy}") from error
    except OSError as error:
        raise InputError(f"{kind} {file} cannot be written: {error.strerror or error}") from error
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


@contextmanager
def whole_folder(path: str | Path) -> Iterator[Path]:
    """A new folder: the body makes the path that it gets, of the same name, which is moved when complete."""
    folder = Path(path)
    _refuse_existing(folder, "folder")
    part = folder.with_name(f".{folder.name}.{os.getpid()}.part")
    try:
        part.mkdir()
        yield part / folder.name
        _refuse_existing(folder, "folder")
        (part / folder.name).rename(folder)
    except OSError as error:
        raise InputError(f"folder {folder} cannot be written: {error.strerror or error}") from error
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _refuse_existing(path: Path, kind: str, remedy: str = OTHER_NAME) -> None:
    if path.exists() or path.is_symlink():
        raise InputError(f"{kind} {path} exists already; {remedy}")


def _rename(part: Path, file: Path, kind: str, remedy: str) -> None:
    """A second name for a complete file, which fails where the name was taken meanwhile."""
    try:
        os.link(part, file)
    except FileExistsError:
        raise
    except OSError:  # no second names on this file system
        _refuse_existing(file, kind, remedy)
        part.replace(file)
