"""New files and folders that are there whole or not at all, and never in place of another."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ftqp.core.errors import InputError


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """A new file: the body writes the path that it gets, and the file gets its name when it is complete.

    Args:
        path: The file.

    Raises:
        InputError: It exists already or cannot be written.
    """
    file = Path(path)
    _refuse_existing(file, "file")
    part = file.with_name(f".{file.name}.{os.getpid()}.part")
    try:
        yield part
        _rename(part, file)
    except FileExistsError as error:
        raise InputError(f"file {file} exists already; choose another name") from error
    except OSError as error:
        raise InputError(f"file {file} cannot be written: {error.strerror or error}") from error
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


@contextmanager
def whole_folder(path: str | Path) -> Iterator[Path]:
    """A new folder: the body makes the path that it gets, of the same name, which is moved when complete.

    Args:
        path: The folder.

    Raises:
        InputError: It exists already or cannot be written.
    """
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


def _refuse_existing(path: Path, kind: str) -> None:
    if path.exists() or path.is_symlink():
        raise InputError(f"{kind} {path} exists already; choose another name")


def _rename(part: Path, file: Path) -> None:
    """A second name for a complete file, which fails where the name was taken meanwhile."""
    try:
        os.link(part, file)
    except FileExistsError:
        raise
    except OSError:  # no second names on this file system
        _refuse_existing(file, "file")
        part.replace(file)
