"""New files, and files that are written whole or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ftqp.core.errors import InputError


def free_path(path: str | Path, what: str, ending: str = "") -> Path:
    """A path of a file or folder that may be made, with those above it; nothing is overwritten."""
    wanted = Path(path)
    if os.path.lexists(wanted):
        raise InputError(f"{what} {wanted} exists, and nothing is overwritten; name another one")
    if ending and wanted.suffix != ending:
        raise InputError(
            f"{what} {str(path)!r} has to end in {ending}; name it {wanted.stem or what}{ending}"
        )
    try:
        above = next(parent for parent in wanted.absolute().parents if parent.exists())
    except OSError as error:  # for example a name that is too long
        raise InputError(f"{what} {wanted} cannot be made: {error.strerror}") from error
    if not (above.is_dir() and os.access(above, os.W_OK)):
        raise InputError(f"{what} {wanted} cannot be made: {above} is not a folder that can be written to")
    return wanted


@contextmanager
def whole_file(file: Path) -> Iterator[Path]:
    """A path to write to, which gets the name of ``file`` in the end; a file of that name is replaced."""
    part = file.with_name(f".{file.name}.{os.getpid()}.part")
    try:
        yield part
        part.replace(file)
    finally:
        part.unlink(missing_ok=True)
