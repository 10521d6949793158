"""A result for a person: sentences and tables, which the terminal and a page show alike."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from ftqp.app.output.console import tell, tell_table
from ftqp.viz.pages.page import paragraph, table


class Table(NamedTuple):
    """A table; ``numbers`` are the heads of columns that stand to the right."""

    title: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    numbers: Sequence[str] = ()


Told = Iterable[str | Table]


def tell_all(told: Told) -> None:
    """A result on the terminal."""
    for one in told:
        if isinstance(one, Table):
            tell_table(one.title, one.heads, one.rows, numbers=one.numbers)
            tell("")
        else:
            tell(one)


def page_parts(told: Told) -> list[str]:
    """A result on a page."""
    return [
        table(one.title, one.heads, one.rows, numbers=one.numbers)
        if isinstance(one, Table)
        else paragraph(one)
        for one in told
    ]
