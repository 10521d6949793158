"""A page for a browser in one file: text, tables and pictures; nothing is fetched from elsewhere."""

from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1c1c1c }
body { max-width: 60rem; margin: 2rem auto; padding: 0 1rem }
h1 { font-size: 1.6rem } h2 { font-size: 1.2rem; margin-top: 2.2rem; border-bottom: 1px solid #ddd }
table { border-collapse: collapse; margin: 1rem 0 }
caption { text-align: left; font-weight: 600; padding: .3rem 0 }
th, td { padding: .25rem .7rem; border-bottom: 1px solid #e4e4e4; text-align: left; vertical-align: top }
td.number, th.number { text-align: right; font-variant-numeric: tabular-nums }
figure { margin: 1rem 0; overflow-x: auto } img { max-width: 100% } figure svg { width: 100%; height: auto }
@media (max-width: 50rem) { figure svg { min-width: 46rem } figure img { max-width: none } }
iframe { width: 100%; height: 34rem; border: 1px solid #ddd; border-radius: 4px }
pre { background: #f6f6f6; padding: .8rem; overflow-x: auto; font-size: .85rem }
summary { cursor: pointer; font-weight: 600; padding: .4rem 0 } figcaption { color: #555; font-size: .9rem }
footer { margin-top: 3rem; color: #555; font-size: .85rem; border-top: 1px solid #ddd; padding-top: .6rem }
code { background: #f3f3f3; padding: .1rem .3rem; border-radius: 3px }
"""
"""How a page looks; no address is in it."""


WIDE = "body { max-width: 84rem } p, table, pre { max-width: 60rem }"
"""More of a page with large figures."""


def page(title: str, parts: Iterable[str], footer: str = "", *, wide: bool = False) -> str:
    """A whole page."""
    style = STYLE + WIDE if wide else STYLE
    below = f"<footer>{escape(footer)}</footer>" if footer else ""
    body = "\n".join([f"<h1>{escape(title)}</h1>", *parts, below])
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{style}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )


def heading(text: str) -> str:
    """A heading within a page."""
    return f"<h2>{escape(text)}</h2>"


def paragraph(text: str) -> str:
    """A paragraph of plain text; what stands between backticks is set as code."""
    pieces = escape(text).split("`")
    marked = [f"<code>{piece}</code>" if k % 2 else piece for k, piece in enumerate(pieces)]
    return f"<p>{''.join(marked)}</p>"


def table(
    caption: str, headers: Sequence[str], rows: Iterable[Sequence[str]], numbers: Iterable[str] = ()
) -> str:
    """A table."""
    right = set(numbers)
    kinds = [' class="number"' if header in right else "" for header in headers]
    head = "".join(f"<th{kind}>{escape(text)}</th>" for kind, text in zip(kinds, headers, strict=True))
    body = "\n".join(
        "<tr>"
        + "".join(f"<td{kind}>{escape(text)}</td>" for kind, text in zip(kinds, row, strict=True))
        + "</tr>"
        for row in rows
    )
    return f"<table>\n<caption>{escape(caption)}</caption>\n<tr>{head}</tr>\n{body}\n</table>"


def picture(file: Path, caption: str) -> str:
    """A picture from a PNG file, which becomes part of the page."""
    data = b64encode(file.read_bytes()).decode()
    return (
        f'<figure><img src="data:image/png;base64,{data}" alt="{escape(caption, quote=True)}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )


def drawing(svg: str, caption: str) -> str:
    """A drawing as a part of the page."""
    return f"<figure>{svg}<figcaption>{escape(caption)}</figcaption></figure>"


def folded(summary: str, text: str) -> str:
    """A text as it is, for example a file, that opens on a click."""
    return f"<details><summary>{escape(summary)}</summary><pre>{escape(text)}</pre></details>"


def inner_page(page: str, title: str) -> str:
    """A whole page within the page; its scripts run, but reach nothing outside of it."""
    content = page.replace("&", "&amp;").replace('"', "&quot;")
    return (
        f'<iframe title="{escape(title, quote=True)}" sandbox="allow-scripts" loading="lazy" '
        f'srcdoc="{content}"></iframe>'
    )
