"""Citations: [@key] in a text becomes a link to the page of references, which is made of references.bib."""

import posixpath
import re
import unicodedata
from pathlib import Path
from typing import Any

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

BIB = Path(__file__).parents[1] / "references.bib"
PLACE = "references.md"
CITED = re.compile(r"(?<!`)\[((?:@\w+[^\[\]@]*)+)\](?!\()")
FIELD = re.compile(r"(\w+)\s*=\s*\{((?:[^{}]|\{[^{}]*\})*)\}")
ACCENTS = dict(zip("'`\"^~vc", "\u0301\u0300\u0308\u0302\u0303\u030c\u0327", strict=True))
"""TeX's accents as characters that combine with the letter before them."""
ACCENTED = re.compile(r"""\{?\\(['`"^~]|[vc](?= |\{))\s*\{?\\?(\w)\}?\}?""")

SHOWN = {
    "journal": "", "booktitle": "", "publisher": "", "institution": "", "howpublished": "",
    "volume": "vol. ", "number": "no. ", "pages": "p. ",
}  # fmt: skip
"""Fields that tell where a work is, and what stands before them."""


def works() -> dict[str, dict[str, str]]:
    """The fields of every work by its key."""
    text = BIB.read_text(encoding="utf-8")
    return {
        key: {name.lower(): plain(value) for name, value in FIELD.findall(body)}
        for key, body in re.findall(r"^@\w+\{(\w+),(.*?)^\}", text, re.M | re.S)
    }


def plain(value: str) -> str:
    """A field without the braces and accents of TeX."""
    value = ACCENTED.sub(lambda found: unicodedata.normalize("NFC", found[2] + ACCENTS[found[1]]), value)
    return re.sub(r"[{}]", "", value).replace("\\&", "&").replace("--", "\N{EN DASH}")


def authors(work: dict[str, str]) -> list[str]:
    """Surnames."""
    return [name.partition(",")[0].strip() for name in work.get("author", "").split(" and ")]


def short(work: dict[str, str]) -> str:
    """As a text cites it: Holt and Desrochers 1994."""
    names = authors(work)
    who = names[0] + (" et al." if len(names) > 2 else f" and {names[1]}" if len(names) == 2 else "")
    return f"{who} {work.get('year', '')}".strip()


def page() -> str:
    """The page of references."""
    lines = ["# References", "", "What ftqp builds on, for BibTeX in [references.bib](references.bib).", ""]
    for key, work in sorted(works().items(), key=lambda item: (short(item[1]), item[0])):
        where = [word + work[field] for field, word in SHOWN.items() if field in work]
        link = f" [doi:{work['doi']}](https://doi.org/{work['doi']})" if "doi" in work else ""
        if not link and "url" in work:
            link = f" <{work['url']}>"
        who = work.get("author", "").replace(" and ", "; ")
        text = ", ".join([who, f"*{work['title']}*", *where, work.get("year", "")])
        lines += [f'- <a id="{key}"></a>**{key}**: {text}.{link}']
    return "\n".join(lines) + "\n"


def on_files(files: Files, config: Any) -> Files:
    """Add the page."""
    files.append(File.generated(config, PLACE, content=page()))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Turn the citations of a page into links.

    Raises:
        PluginError: a key is not in references.bib.
    """
    known, here = works(), posixpath.dirname(page.file.src_uri) or "."
    to = posixpath.relpath(PLACE, here)

    def link(key: str) -> str:
        if key not in known:
            raise PluginError(f"{page.file.src_uri} cites @{key}, which docs/references.bib does not have")
        return f"[{short(known[key])}]({to}#{key})"

    def cite(found: re.Match[str]) -> str:
        return "(" + re.sub(r"@(\w+)", lambda one: link(one[1]), found[1]) + ")"

    return CITED.sub(cite, markdown)
