"""Arrays and a JSON text in an NPZ file, written whole or not at all."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ftqp.core.whole_file import whole_file

ABOUT = "about"
"""The array that holds the JSON text."""


def write_npz(file: Path, arrays: Mapping[str, NDArray[Any]], about: Mapping[str, Any]) -> None:
    """Write arrays and what JSON can hold about them; a file of the same name is replaced at the end."""
    text = np.array(json.dumps(about, allow_nan=False))
    file.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(file) as part, part.open("wb") as stream:
        np.savez_compressed(stream, **{ABOUT: text}, **arrays)  # type: ignore[arg-type]


def read_npz(file: Path) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """The arrays of a file that ``write_npz`` has written, and what its text says."""
    arrays = npz_arrays(file)
    return arrays, json.loads(str(arrays.pop(ABOUT)))


def npz_arrays(file: Path) -> dict[str, NDArray[Any]]:
    """The arrays of an NPZ file by name; a ``ValueError`` where it is none or is damaged."""
    try:
        with file.open("rb") as stream, np.load(stream, allow_pickle=False) as found:
            return {name: found[name] for name in found.files}
    except OSError:
        raise
    except Exception as error:  # numpy, zipfile and zlib have many for a file that is damaged
        raise ValueError("it is no archive of arrays, or is damaged") from error
