"""A strict file of numbers: columns with known names, the same number of finite values in each."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from re import search
from typing import final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError, nearest


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class TableFile:
    """A file of columns of numbers, and what it may hold."""

    file: Path  # The file
    what: str  # What it is called in a message, for example ``waypoint file``
    sample: str  # What one line holds, for example ``waypoint``
    valid: tuple[str, ...] | None  # Names that its columns may have; None is any
    needed: tuple[str, ...]  # Names of columns that it has in any case
    together: tuple[str, ...] = ()  # Names of columns of which it has all or none

    def wrong(self, why: str) -> InputError:
        """What to say of the file."""
        return InputError(f"{self.what} {self.file}{why}")

    def refuse_missing(self, endings: str) -> None:
        """Refuse what is no file."""
        if not self.file.is_file():
            raise self.wrong(f" does not exist; expected a {endings} file")

    def csv_columns(self) -> dict[str, FloatArray]:
        """The columns of a CSV file in UTF-8 by name, each (K,), K >= 1; values may be infinite or NaN."""
        self.refuse_missing(".csv")
        try:
            text = self.file.read_text("utf-8-sig").splitlines()
        except UnicodeDecodeError as error:
            raise self.wrong(" is not text in UTF-8 with comma-separated values") from error
        except OSError as error:
            raise self.wrong(f" cannot be read: {error.strerror or error}") from error
        places = [place for place, line in enumerate(text) if line.strip()]
        lines = [text[place] for place in places]
        if len(lines) < 2:
            raise self.wrong(f" has {len(lines)} lines, expected a header and at least one {self.sample}")
        header = [name.strip(' "') for name in lines[0].split(",")]
        self.check_names(header)
        try:
            rows = np.loadtxt(lines[1:], delimiter=",", quotechar='"', comments=None, ndmin=2)
        except ValueError as error:
            found = search(r"string (.+) to \S+ at row (\d+), column (\d+)", str(error))
            if found is None:
                why = str(error).partition(";")[0]
                raise self.wrong(f": {why} below the header, expected numbers") from error
            line, name = places[int(found[2]) + 1] + 1, header[min(int(found[3]), len(header)) - 1]
            raise self.wrong(f", line {line}: {name} is {found[1]:.40}, expected a number") from error
        if rows.shape[1] != len(header):
            raise self.wrong(f", line {places[1] + 1} has {rows.shape[1]} values, expected {len(header)}")
        return {name: rows[:, column] for column, name in enumerate(header)}

    def check_names(self, names: list[str]) -> None:
        """Refuse columns that are unknown, there twice, or missing."""
        for name in names:
            if self.valid is not None and name not in self.valid:
                guess, known = nearest(name, self.valid), ", ".join(self.valid)
                raise self.wrong(f": {name!r:.40} is not a column{guess}; expected some of {known}")
            if names.count(name) > 1:
                raise self.wrong(f": column {name!r} appears {names.count(name)} times")
        asked = (*self.needed, *(self.together if set(self.together) & set(names) else ()))
        for name in asked:
            if name not in names:
                raise self.wrong(f": column {name!r} is missing; it has {', '.join(names)}")

    def check_values(self, table: Mapping[str, FloatArray]) -> None:
        """Refuse values that are not finite, and times that do not rise, in columns by name, each (K,)."""
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
