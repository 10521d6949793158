"""A table once, as text on a terminal and as Markdown."""

from collections.abc import Sequence
from dataclasses import dataclass

from rich import box
from rich.table import Table as RichTable
from rich.text import Text


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Cells under headings.

    Attributes:
        title: What the figures are, with their unit.
        headings: One a column; the first column is text, the others are figures.
        rows: The cells.
        notes: What must be known to read it, a sentence each.
        bold: The row that others are compared with.
        text_last: Whether the last column holds text, too.
    """

    title: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str]]
    notes: Sequence[str] = ()
    bold: str = ""
    text_last: bool = False

    def _is_text(self, column: int) -> bool:
        return column == 0 or (self.text_last and column == len(self.headings) - 1)

    def rich(self) -> RichTable:
        """For a terminal."""
        table = RichTable(
            title=Text(self.title),
            title_justify="left",
            title_style="bold",
            caption=Text("\n".join(self.notes)),
            caption_justify="left",
            box=box.SIMPLE_HEAD,
        )
        for i, heading in enumerate(self.headings):
            text = self._is_text(i)
            table.add_column(heading, justify="left" if text else "right", overflow="fold", no_wrap=i == 0)
        for row in self.rows:
            table.add_row(*map(Text, row), style="bold" if row[0] == self.bold else None)
        return table

    def markdown(self, level: int = 2) -> list[str]:
        """Lines of a Markdown section."""
        rule = ["---" if self._is_text(i) else "---:" for i in range(len(self.headings))]
        lines = [f"{'#' * level} {self.title}", ""]
        lines += ["| " + " | ".join(cells) + " |" for cells in (self.headings, rule, *self.rows)]
        for note in self.notes:
            lines += ["", note]
        return [*lines, ""]


NOTHING = 1e-18
"""A relative residual that is printed as 0."""


def quantity(value: float | None, digits: int = 3) -> str:
    """A number with so many significant digits and no exponent; ``-`` where there is none."""
    if value is None:
        return "-"
    if value == 0.0:
        return "0"
    text = f"{value:.{digits}g}"
    if "e" in text:
        text = f"{value:.0f}"
    return text


def exponent(value: float | None) -> str:
    """A small number as 1e-9; ``-`` where there is none, 0 below ``NOTHING``."""
    if value is None:
        return "-"
    return "0" if value < NOTHING else f"{value:.0e}".replace("e-0", "e-").replace("e+0", "e+")


def counted(cold: int, warm: int) -> str:
    """A count of cold starts and, where it differs, of warm ones; nothing for none."""
    if cold == warm:
        return str(cold) if cold else ""
    return f"{cold} / {warm}"
