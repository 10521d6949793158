"""The file of recorded QPs: an .npz of arrays and a JSON text, read strictly, written whole or not at all."""

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ftqp.core.errors import InputError, nearest
from ftqp.core.npz import npz_arrays

FORMAT = 1
"""Version of the file's layout."""
LARGEST = 4_000_000_000
"""Bytes of the arrays of a file that is read; more is taken for a mistake."""
ABOUT = "about"
"""The array that holds the JSON text."""
KEYS = {"variables", "rows", "metadata"}
"""What the text holds beside the format."""


def write(path: str | Path, arrays: Mapping[str, NDArray[Any]], about: Mapping[str, Any]) -> None:
    """Write a new file, whole or not at all."""
    file = free_file(path)
    try:
        text = json.dumps({"format": FORMAT, **about}, allow_nan=False)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"metadata of the recording are not JSON: {error}") from error
    part = file.with_name(f".{file.name}.{os.getpid()}.part")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with part.open("wb") as stream:
            np.savez_compressed(stream, **{ABOUT: np.array(text)}, **arrays)  # type: ignore[arg-type]
        _put(part, file)
    except OSError as error:
        raise InputError(f"recording {file} cannot be written: {error.strerror or error}") from error
    finally:
        part.unlink(missing_ok=True)


def read(path: str | Path, names: Sequence[str]) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """The arrays called ``names``, and what the text says: variables, rows, metadata."""
    file = Path(path)
    if not file.is_file():
        raise InputError(f"recording {file} does not exist; `ftqp run --record-qps FILE` makes one")
    arrays = _arrays(file, (ABOUT, *names))
    return arrays, _about(file, arrays.pop(ABOUT))


def free_file(path: str | Path) -> Path:
    """``path``, if a recording may be written there."""
    file = Path(path)
    if file.exists() or file.is_symlink():
        raise InputError(f"recording {file} exists, and nothing is overwritten; name another file")
    if file.suffix != ".npz":
        raise InputError(f"recording {str(path)!r} has to end in .npz; name it {file.stem or 'qps'}.npz")
    for parent in file.absolute().parents:
        if parent.exists():
            if not parent.is_dir():
                raise InputError(f"recording {file} cannot be made: {parent} is not a folder")
            if not os.access(parent, os.W_OK):
                raise InputError(f"recording {file} cannot be made: {parent} is not writable")
            break
    return file


def _put(part: Path, file: Path) -> None:
    """Give the finished ``part`` its name; a file that has come to be meanwhile stays."""
    try:
        os.link(part, file)
    except FileExistsError as error:
        raise InputError(f"recording {file} exists, and nothing is overwritten; name another file") from error
    except OSError:  # a file system without hard links
        part.rename(free_file(file))


def _arrays(file: Path, expected: Sequence[str]) -> dict[str, NDArray[Any]]:
    """The arrays of a file, exactly those expected."""
    try:
        arrays = npz_arrays(file, LARGEST)
    except ValueError as error:
        raise InputError(_unreadable(file, str(error))) from error
    except OSError as error:
        raise InputError(f"recording {file} cannot be read: {error.strerror or error}") from error
    _check_keys(file, list(arrays), expected)
    return arrays


def _unreadable(file: Path, reason: str) -> str:
    return (
        f"{file} is not a recording or is truncated ({reason:.100}); expected the .npz of "
        "`ftqp run --record-qps`, with numbers only"
    )


def _check_keys(file: Path, found: Sequence[str], expected: Sequence[str]) -> None:
    for name in found:
        if name not in expected:
            raise InputError(
                f"{file} is not a recording: it has an array {name!r:.40}{nearest(name, expected)}"
            )
    missing = [name for name in expected if name not in found]
    if missing:
        raise InputError(f"{file} is not a recording: it has no {', '.join(missing)}")


def _about(file: Path, value: NDArray[Any]) -> dict[str, Any]:
    """Names and metadata, the JSON text in the file."""
    try:
        about = json.loads(str(value[()])) if value.dtype.kind == "U" and value.shape == () else None
    except (ValueError, RecursionError):
        about = None
    if not isinstance(about, dict) or "format" not in about:
        raise InputError(f"{file} is not a recording: 'about' is not its JSON text")
    version = about.pop("format")
    if version != FORMAT:
        raise InputError(
            f"recording {file} has format {version!r:.20}, this ftqp reads {FORMAT}; "
            "record it again with `ftqp run --record-qps`"
        )
    if set(about) != KEYS or not isinstance(about["metadata"], dict):
        raise InputError(f"{file} is not a recording: 'about' has to hold variables, rows and metadata")
    return about
