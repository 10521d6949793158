"""A table as HTML, for the cells of notebooks."""

from collections.abc import Sequence
from html import escape

_CELL = 'style="text-align:{};padding:1px 8px"'


def html_table(
    title: str, headings: Sequence[str], rows: Sequence[Sequence[object]], note: str = "", picture: str = ""
) -> str:
    """A titled table; the first column is text, the others are numbers or short words."""

    def line(tag: str, cells: Sequence[object]) -> str:
        sides = ["left", *["right"] * (len(cells) - 1)]
        return "".join(
            f"<{tag} {_CELL.format(side)}>{escape(str(cell))}</{tag}>"
            for side, cell in zip(sides, cells, strict=True)
        )

    head = f"<tr>{line('th', headings)}</tr>" if headings else ""
    body = "".join(f"<tr>{line('td', row)}</tr>" for row in rows)
    below = f"<div>{escape(note)}</div>" if note else ""
    return f"<div><b>{escape(title)}</b></div><table>{head}{body}</table>{picture}{below}"
