"""A strict file of numbers: columns with known names, the same number of finite values in each."""

import csv
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError, nearest

NUMBER = re.compile(r"[+-]?((\d+\.?\d*|\.\d+)(e[+-]?\d+)?|inf|infinity|nan)", re.ASCII | re.IGNORECASE)
"""A number as other programs write it; Python would take ``1_000`` and digits of any script, too."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class TableFile:
    """A file of columns of numbers, and what it may hold.

    Attributes:
        file: The file.
        what: What it is called in a message, for example ``waypoint file``.
        sample: What one line holds, for example ``waypoint``.
        valid: Names that its columns may have.
        expected: The same in words.
        needed: Names of columns that it has in any case.
        together: Names of columns of which it has all or none.
        largest: A file of more bytes is taken for a mistake.
    """

    file: Path
    what: str
    sample: str
    valid: tuple[str, ...]
    expected: str
    needed: tuple[str, ...]
    together: tuple[str, ...]
    largest: int

    def wrong(self, why: str) -> InputError:
        """What to say of the file."""
        return InputError(f"{self.what} {self.file}{why}")

    def refuse_unread(self, endings: str) -> None:
        """Refuse what is no file, or too large to be read.

        Raises:
            InputError: It is missing, a folder or too large.
        """
        if not self.file.is_file():
            raise self.wrong(f" does not exist; expected a {endings} file")
        size = self.file.stat().st_size
        if size > self.largest:
            raise self.wrong(f" has {size / 1e6:.0f} MB, expected at most {self.largest / 1e6:.0f} MB")

    def csv_columns(self) -> dict[str, FloatArray]:
        """The columns of a CSV file in UTF-8 by name, each (K,), K >= 1; values may be infinite or NaN.

        Raises:
            InputError: Not text, too few lines, a wrong header, a line of another length, not a number.
        """
        try:
            with self.file.open(newline="", encoding="utf-8-sig") as stream:
                lines = [line for line in csv.reader(stream, skipinitialspace=True) if line]
        except (UnicodeDecodeError, csv.Error) as error:
            raise self.wrong(" is not text in UTF-8 with comma-separated values") from error
        except OSError as error:
            raise self.wrong(f" cannot be read: {error.strerror or error}") from error
        if len(lines) < 2:
            raise self.wrong(f" has {len(lines)} lines, expected a header and at least one {self.sample}")
        header = [name.strip() for name in lines[0]]
        self.check_names(header)
        rows = np.empty((len(lines) - 1, len(header)))
        for number, line in enumerate(lines[1:], start=2):
            if len(line) != len(header):
                raise self.wrong(f", line {number} has {len(line)} values, expected {len(header)}")
            for column, text in enumerate(line):
                if not NUMBER.fullmatch(text.strip()):
                    raise self.wrong(
                        f", line {number}, column {header[column]!r} is {text!r:.40}, expected a number such "
                        "as -1.5 or 2e-3"
                    )
                rows[number - 2, column] = float(text)
        return {name: rows[:, column] for column, name in enumerate(header)}

    def check_names(self, names: list[str]) -> None:
        """Refuse columns that cannot be.

        Raises:
            InputError: One is unknown, is there twice, or is missing.
        """
        for name in names:
            if name not in self.valid:
                raise self.wrong(
                    f": {name!r:.40} is not a column{nearest(name, self.valid)}; expected {self.expected}"
                )
            if names.count(name) > 1:
                raise self.wrong(f": column {name!r} appears {names.count(name)} times")
        asked = (*self.needed, *(self.together if set(self.together) & set(names) else ()))
        for name in asked:
            if name not in names:
                raise self.wrong(f": column {name!r} is missing; it has {', '.join(names)}")

    def check_values(self, table: Mapping[str, FloatArray]) -> None:
        """Refuse values that are not finite, and times that do not rise.

        Args:
            table: Columns by name, each (K,).

        Raises:
            InputError: There are some.
        """
        for name, column in table.items():
            if not np.isfinite(column).all():
                row = int(np.argmax(~np.isfinite(column)))
                raise self.wrong(
                    f": {name} of {self.sample} {row + 1} is {column[row]}, expected a finite number"
                )
        t = table.get("t", np.zeros(0))
        if (np.diff(t) <= 0.0).any():
            row = int(np.argmax(np.diff(t) <= 0.0))
            raise self.wrong(
                f": t does not rise from {self.sample} {row + 1} ({t[row]:g} s) to {row + 2} "
                f"({t[row + 1]:g} s); sort the {self.sample}s by time"
            )
