"""Work for the tests of studies: small, picklable, and deadly where a test wants it."""

import os
import signal
import sqlite3
import time
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from ftqp.app.study.results_file import FILE_NAME, ResultsFile

ROOT = Path(__file__).parents[3]

COLUMNS = {"square": "INTEGER", "root": "REAL", "name": "TEXT"}
"""What ``Squares`` computes of an item."""


@dataclass(frozen=True)
class Squares:
    """Squares and roots of item numbers.

    Attributes:
        seconds: how long an item takes [s].
        deadly: the item at which the worker kills itself.
        all_deadly_below: the item below which each is deadly.
        fails: the item at which the work raises.
    """

    seconds: float = 0.0
    deadly: int = -1
    all_deadly_below: int = 0
    fails: int = -1

    def __call__(self, items):
        rows = []
        for item in items:
            if item == self.deadly or item < self.all_deadly_below:
                os.kill(os.getpid(), signal.SIGKILL)
            if item == self.fails:
                raise ArithmeticError(f"item {item} cannot be computed")
            time.sleep(self.seconds)
            rows.append((item * item, item**0.5, f"item {item}"))
        return rows


def expected(count):
    """The whole table of ``count`` items."""
    return [(item, item * item, item**0.5, f"item {item}") for item in range(count)]


def results_in(folder):
    return ResultsFile(folder, kind="squares", key="k", columns=COLUMNS)


def kept(folder, column="item"):
    """What is on file of each item, in their order, while another process writes it."""
    if not (folder / FILE_NAME).is_file():
        return []
    uri = (folder / FILE_NAME).absolute().as_uri() + "?mode=ro"
    with closing(sqlite3.connect(uri, uri=True)) as connection:
        try:
            return [value for (value,) in connection.execute(f"SELECT {column} FROM results ORDER BY item")]
        except sqlite3.Error:
            return []


def environment():
    """That of a process which finds the work."""
    return os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT / "src"), str(ROOT)])}
