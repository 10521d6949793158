"""The file of a plan: an .npz of arrays and a JSON text, read strictly, written whole or not at all."""

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from ftqp.core.checks import FloatArray, is_number
from ftqp.core.errors import InputError
from ftqp.core.npz import npz_arrays

FORMAT = 1
"""Version of the file's layout."""
LARGEST = 2_000_000_000
"""Bytes of the arrays of a file that is read; more is taken for a mistake."""
LARGEST_NUMBER = 1e9
"""Joints and places of a plan are below this [rad or m]."""
ABOUT = "about"
"""The array that holds the JSON text."""
ARRAYS: Final = ("q", "goals")
"""The arrays of a file: configurations (N + 1, nv) and poses (N + 1, 4, 4)."""
TEXTS: Final = ("robot", "robot_digest", "task_digest", "method")
NUMBERS: Final = ("dt", "coverage")
LISTS: Final = ("joints", "rows")
KEYS: Final = {*TEXTS, *NUMBERS, *LISTS, "axis", "stride", "settings", "content"}
"""What the text holds beside the format."""


def write_plan(path: str | Path, arrays: Mapping[str, FloatArray], about: Mapping[str, Any]) -> None:
    """Write a file, whole or not at all; one of the same name is replaced."""
    file = Path(path)
    if file.suffix != ".npz":
        raise InputError(f"plan {str(path)!r} has to end in .npz; name it {file.stem or 'plan'}.npz")
    text = json.dumps({"format": FORMAT, **about, "content": _content(arrays)}, allow_nan=False)
    part = file.with_name(f".{file.name}.{os.getpid()}.part")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with part.open("wb") as stream:
            np.savez_compressed(stream, **{ABOUT: np.array(text)}, **arrays)  # type: ignore[arg-type]
        part.replace(file)
    except OSError as error:
        raise InputError(f"plan {file} cannot be written: {error.strerror or error}") from error
    finally:
        part.unlink(missing_ok=True)


def read_plan(path: str | Path) -> tuple[dict[str, FloatArray], dict[str, Any]]:
    """The arrays of a file, and what its text says, both checked."""
    file = Path(path)
    if not file.is_file():
        raise InputError(f"plan {file} does not exist; `ftqp.analysis.plan(...).save(file)` makes one")
    arrays, text = _arrays(file)
    about = _about(file, text)
    q, goals = arrays["q"], arrays["goals"]
    if q.shape != (len(goals), len(about["joints"])) or goals.shape[1:] != (4, 4) or len(q) < 2:
        raise _no_plan(file, f"q has shape {q.shape} and goals {goals.shape}")
    if not ((np.abs(q) < LARGEST_NUMBER).all() and (np.abs(goals) < LARGEST_NUMBER).all()):
        raise _no_plan(file, f"a number is not finite, or beyond {LARGEST_NUMBER:g}, where no arm gets")
    if about.pop("content") != _content(arrays):
        raise InputError(f"plan {file} is damaged: its arrays are not those that were written; plan it again")
    return arrays, about


def _content(arrays: Mapping[str, FloatArray]) -> str:
    """A hash of the arrays."""
    whole = hashlib.sha256()
    for name in ARRAYS:
        array = np.ascontiguousarray(arrays[name], dtype="<f8")
        whole.update(f"{name}{array.shape}".encode() + array.tobytes())
    return whole.hexdigest()[:32]


def _no_plan(file: Path, reason: str) -> InputError:
    return InputError(
        f"{file} is not a plan: {reason}; expected a file of `ftqp.analysis.plan(...).save(file)`"
    )


def _arrays(file: Path) -> tuple[dict[str, FloatArray], Any]:
    """The arrays of a file by name, and its text."""
    try:
        arrays = npz_arrays(file, LARGEST)
    except ValueError as error:
        raise _no_plan(file, f"it cannot be read or is truncated ({error!s:.100})") from error
    except OSError as error:
        raise InputError(f"plan {file} cannot be read: {error.strerror or error}") from error
    if sorted(arrays) != sorted((ABOUT, *ARRAYS)):
        raise _no_plan(file, f"it has the arrays {', '.join(arrays) or 'none'!s:.80}")
    text = arrays.pop(ABOUT)
    for name, value in arrays.items():
        if value.dtype != np.float64:
            raise _no_plan(file, f"{name} holds {value.dtype}")
    return arrays, text


def _about(file: Path, value: Any) -> dict[str, Any]:
    """What the JSON text in the file says."""
    try:
        about = json.loads(str(value[()])) if value.dtype.kind == "U" and value.shape == () else None
    except (ValueError, RecursionError):
        about = None
    if not isinstance(about, dict) or "format" not in about:
        raise _no_plan(file, "'about' is not its JSON text")
    version = about.pop("format")
    if version != FORMAT:
        raise InputError(
            f"plan {file} has format {version!r:.20}, this ftqp reads {FORMAT}; plan it again with this ftqp"
        )
    good = (
        set(about) == KEYS
        and all(isinstance(about[key], str) for key in (*TEXTS, "content"))
        and all(is_number(about[key], LARGEST_NUMBER) for key in (*NUMBERS, "stride"))
        and all(isinstance(about[key], list) and all(isinstance(x, str) for x in about[key]) for key in LISTS)
        and isinstance(about["axis"], bool)
        and isinstance(about["settings"], dict)
        and about["dt"] > 0.0
    )
    if not good:
        raise _no_plan(file, "'about' does not say what a plan has to")
    return about
