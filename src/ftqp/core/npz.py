"""Arrays and a JSON text in an NPZ file: written whole or not at all, and measured before they are read."""

import json
import os
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np
from numpy.typing import NDArray

METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""How numpy packs an array."""
ENCRYPTED = 0x1
"""The bit of a member that takes a password."""
HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}
"""What reads the head of an array, by the version of its format."""


ABOUT = "about"
"""The array that holds the JSON text."""


def write_npz(file: Path, arrays: Mapping[str, NDArray[Any]], about: Mapping[str, Any]) -> None:
    """Write arrays and what JSON can hold about them; a file of the same name is replaced at the end."""
    text = np.array(json.dumps(about, allow_nan=False))
    part = file.with_name(f".{file.name}.{os.getpid()}.part")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with part.open("wb") as stream:
            np.savez_compressed(stream, **{ABOUT: text}, **arrays)  # type: ignore[arg-type]
        part.replace(file)
    finally:
        part.unlink(missing_ok=True)


def read_npz(file: Path, largest: float) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """The arrays of a file that ``write_npz`` has written, and what its text says."""
    arrays = npz_arrays(file, largest)
    return arrays, json.loads(str(arrays.pop(ABOUT)))


def npz_arrays(file: Path, largest: float) -> dict[str, NDArray[Any]]:
    """The arrays of an NPZ file by name.

    Nothing is unpacked that the file does not need for arrays of the sizes that it states, and those are
    added up first: a small file cannot fill the memory.
    """
    try:
        with file.open("rb") as stream, zipfile.ZipFile(stream) as archive:
            members = archive.infolist()
            size = sum(member.file_size for member in members)
            if size > largest:
                raise ValueError(f"it holds {size:.2g} bytes, expected at most {largest:.2g}")
            return {member.filename.removesuffix(".npy"): _array(archive, member) for member in members}
    except (
        EOFError, KeyError, MemoryError, RuntimeError, SyntaxError, TokenError, TypeError, zlib.error,
    ) as error:  # fmt: skip
        raise ValueError("it is damaged") from error
    except zipfile.BadZipFile as error:
        raise ValueError("it is no archive of arrays, or is truncated") from error


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> NDArray[Any]:
    """An array of the archive, whose head has to agree with the size of the member."""
    if member.compress_type not in METHODS or member.flag_bits & ENCRYPTED:
        raise ValueError(f"{member.filename!r:.60} is packed as numpy packs nothing")
    with archive.open(member) as stream:
        version = np.lib.format.read_magic(stream)
        if version not in HEADERS:
            raise ValueError(f"{member.filename!r:.60} is an array of a format that numpy does not write")
        shape, _, kind = HEADERS[version](stream)
        count = 1
        for length in shape:
            if isinstance(length, bool) or length < 0:
                raise ValueError(f"{member.filename!r:.60} has the shape {shape!r:.60}")
            count *= length
        if kind.hasobject or count * kind.itemsize != member.file_size - stream.tell():
            raise ValueError(f"{member.filename!r:.60} holds objects, or other numbers than it says")
    with archive.open(member) as stream:
        array: NDArray[Any] = np.lib.format.read_array(stream, allow_pickle=False)
    return array
