"""A strict CSV file of numbers: a header with known names, the same number of values on every line."""

import csv
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError

NUMBER = re.compile(r"[+-]?((\d+\.?\d*|\.\d+)(e[+-]?\d+)?|inf|infinity|nan)", re.ASCII | re.IGNORECASE)
"""A number as other programs write it; Python would take ``1_000`` and digits of any script, too."""


def csv_columns(
    file: Path, what: str, sample: str, check_names: Callable[[list[str]], None]
) -> dict[str, FloatArray]:
    """The columns of a CSV file by name, each (K,), K >= 1; values may still be infinite or NaN.

    Args:
        file: the file, in UTF-8, its first line the names of the columns.
        what: what the file is called in a message, for example ``waypoint file``.
        sample: what one line holds, for example ``waypoint``.
        check_names: raises for a header that does not fit.

    Raises:
        InputError: not text, too few lines, a wrong header, a line of another length, not a number.
    """
    try:
        with file.open(newline="", encoding="utf-8-sig") as stream:
            lines = [line for line in csv.reader(stream, skipinitialspace=True) if line]
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{what} {file} is not text in UTF-8 with comma-separated values") from error
    except OSError as error:
        raise InputError(f"{what} {file} cannot be read: {error.strerror or error}") from error
    if len(lines) < 2:
        raise InputError(f"{what} {file} has {len(lines)} lines, expected a header and at least one {sample}")
    header = [name.strip() for name in lines[0]]
    check_names(header)
    rows = np.empty((len(lines) - 1, len(header)))
    for number, line in enumerate(lines[1:], start=2):
        if len(line) != len(header):
            raise InputError(f"{what} {file}, line {number} has {len(line)} values, expected {len(header)}")
        for column, text in enumerate(line):
            if not NUMBER.fullmatch(text.strip()):
                raise InputError(
                    f"{what} {file}, line {number}, column {header[column]!r} is {text!r:.40}, "
                    "expected a number such as -1.5 or 2e-3"
                )
            rows[number - 2, column] = float(text)
    return {name: rows[:, column] for column, name in enumerate(header)}


def refuse_large(file: Path, what: str, largest: int) -> None:
    """Raise for a file of more than ``largest`` bytes, which is taken for a mistake.

    Raises:
        InputError: the file is larger.
    """
    size = file.stat().st_size
    if size > largest:
        raise InputError(f"{what} {file} has {size / 1e6:.0f} MB, expected at most {largest / 1e6:.0f} MB")


def refuse_repeated(file: Path, what: str, names: list[str]) -> None:
    """Raise for a name that occurs twice.

    Raises:
        InputError: it does.
    """
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{what} {file}: column {name!r} appears {names.count(name)} times")
