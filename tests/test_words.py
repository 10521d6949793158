"""What a newcomer reads is short, and uses the terms of the field, which docs/making/glossary.toml lists."""

import ast
import re
import tomllib
from inspect import getdoc
from pathlib import Path

import pytest

from tests.docs.test_site import in_nav
from tests.test_docstrings import in_scope, public

ROOT = Path(__file__).parents[1]
GLOSSARY = tomllib.loads((ROOT / "docs" / "making" / "glossary.toml").read_text(encoding="utf-8"))
OTHERS = ("reference", "theory/", "evidence/", "contributing", "changelog", "history", "security")
PAGES = [ROOT / "docs" / page for page in in_nav() if not page.startswith(("index", *OTHERS))]
PAGES.append(ROOT / "README.md")
"""Pages of the navigation that are written for users."""
MOST_WORDS, MOST_WORDS_IN_ALL, MOST_IN_A_SENTENCE, MOST_IN_README = 1_600, 25_000, 40, 1_000


def plain(file: Path) -> str:
    """The running text of a page, without code, addresses and marks."""
    text = file.read_text(encoding="utf-8")
    text = re.sub(r"^```.*?^```$|^ {4}[^\n]*$|!\[[^\]]*\]\([^)]*\)|<[^>]*>", "", text, flags=re.M | re.S)
    text = re.sub(r"`[^`\n]*`", "x", text)
    return re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)


def sentences(text: str) -> list[str]:
    """Sentences, and the cells of tables, each of which stands for itself."""
    parts = re.split(r"\n\s*\n|^#+.*$|^\s*(?:[-*]|\d+\.) |\|", text, flags=re.M)
    return [one for part in parts for one in re.split(r"(?<=[.!?:;])\s+", " ".join(part.split())) if one]


@pytest.mark.parametrize("file", PAGES, ids=lambda file: file.relative_to(ROOT).as_posix())
def test_a_page_is_short_and_so_are_its_sentences(file):
    assert len(file.read_text(encoding="utf-8").split()) <= MOST_WORDS
    long = [one for one in sentences(plain(file)) if len(one.split()) > MOST_IN_A_SENTENCE]
    assert not long


def test_the_pages_that_a_user_reads_are_few_words_in_all():
    assert sum(len(file.read_text(encoding="utf-8").split()) for file in PAGES) <= MOST_WORDS_IN_ALL


def test_every_other_page_leads_to_how_it_works():
    made = ("index", "contributing", "changelog", "history", "security", "references", "reference/")
    pages = [page for page in in_nav() if not page.startswith((*made, "how-it-works"))]
    assert len(pages) > 25
    texts = {page: (ROOT / "docs" / page).read_text(encoding="utf-8") for page in pages}
    assert not [page for page, text in texts.items() if "how-it-works.md)" not in text]


def test_readme_is_read_in_a_few_minutes():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").split()) <= MOST_IN_README


def wrong_words(
    text: str, words: dict[str, str] = GLOSSARY["instead_of"], also: tuple[str, ...] = ()
) -> list[str]:
    """Words of a text in whose place the glossary has others; ``also`` is what may stand besides."""
    found = []
    for word, better in words.items():
        for hit in re.finditer(rf"\b(?:{word})\b", text, re.I):
            around = text[max(0, hit.start() - 30) : hit.end() + 30]
            if not any(allowed in around for allowed in (*GLOSSARY["allowed"], *also)):
                found.append(f"{' '.join(around.split())!r}: {better} in place of {hit[0]!r}")
    return found


@pytest.mark.parametrize("file", PAGES, ids=lambda file: file.relative_to(ROOT).as_posix())
def test_a_page_uses_the_terms_of_the_field(file):
    assert not wrong_words(plain(file))


def test_another_word_for_a_term_is_found():
    assert len(wrong_words("The tip is told of a dead joint.")) == 3


UNITS = r"(?:mm|cm|m|µm|us|µs|ms|s|%|Hz|kHz|N m|N|mrad|rad|deg|degrees|kB|MB|GB|MiB|bytes)"
AMOUNT, COUNT = r"\d[\d,.]*(?:e-?\d+)?", r"\d[\d,]* of (?:the )?\d[\d,]*\d"
NUMBER = re.compile(rf"(?<![\w.])(?:{AMOUNT}(?: to {AMOUNT})? {UNITS}(?:/s²?|²)?(?!\w)|{COUNT})")
EVIDENCE = (ROOT / "docs" / "evidence" / "README.md").read_text(encoding="utf-8")
SETTINGS = tomllib.loads((ROOT / "docs" / "making" / "numbers.toml").read_text(encoding="utf-8"))


def measured() -> dict[str, list[str]]:
    """By page the figures that the page of evidence names with their commands."""
    table = EVIDENCE.partition("## Figures in README and the manual")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| (\S+\.md) \| ([^|]+) \| (?:[^|]*`|the page's own program)[^|]* \|$", table, re.M)
    found: dict[str, list[str]] = {}
    for page, figure in rows:
        found.setdefault(page, []).append(figure)
    return found


def unnamed(text: str, figures: list[str], settings: list[str]) -> tuple[set[str], set[str]]:
    """Numbers of a text that are neither measured figures nor settings, and those of both that it has not."""
    numbers = {one[0] for one in NUMBER.finditer(" ".join(text.split()))}
    known = {one for one in numbers for of in (*figures, *settings) if one == of or one.endswith(f" {of}")}
    idle = {
        of for of in (*figures, *settings) if not any(one == of or one.endswith(f" {of}") for one in numbers)
    }
    return numbers - known, idle


@pytest.mark.parametrize("file", PAGES, ids=lambda file: file.relative_to(ROOT).as_posix())
def test_every_number_with_a_unit_is_a_setting_or_has_its_command_on_the_page_of_evidence(file):
    name = file.relative_to(ROOT).as_posix()
    assert unnamed(plain(file), measured().get(name, []), SETTINGS.get(name, [])) == (set(), set())


def test_a_number_without_a_command_is_found_and_so_is_a_row_without_a_number():
    assert unnamed("It strays by 7 mm within 3 s.", ["3 s", "2 %"], []) == ({"7 mm"}, {"2 %"})
    assert len(measured()) >= 10 and set(measured()) <= {file.relative_to(ROOT).as_posix() for file in PAGES}


def messages(file: Path) -> list[str]:
    """Texts of several words that a file of the program can show, without docstrings and code."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    bare = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    texts = [
        node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in bare
    ]
    return [re.sub(r"`[^`\n]*`", "x", text) for text in texts if " " in text.strip()]


def docstrings() -> list[tuple[str, str]]:
    """Names of what users call, each with its docstring, without code and names of arguments."""
    found = {name: value for name, value in public().items() if in_scope(value)}
    for name, value in list(found.items()):
        if isinstance(value, type):
            found |= {
                f"{name}.{one}": of
                for one, of in vars(value).items()
                if isinstance(of, property) and one[0] != "_"
            }
    code = r"``[^`]*``|`[^`\n]*`|^    \*{0,2}\w+(?:, \w+)*:"
    return [
        (name, " ".join(re.sub(code, "x", getdoc(of) or "", flags=re.M).split()))
        for name, of in found.items()
    ]


def test_public_docstrings_use_the_terms_of_the_field():
    words = {
        word: better for word, better in GLOSSARY["instead_of"].items() if word != "tips?"
    }  # a frame's name
    texts = docstrings()
    assert len(texts) > 400
    assert not [(name, wrong) for name, text in texts if (wrong := wrong_words(text, words))]


SHOWN = [file for file in sorted((ROOT / "src" / "ftqp").rglob("*.py")) if "kernel" not in file.parts]


def test_what_the_program_says_uses_the_terms_of_the_field():
    words = {word: better for word, better in GLOSSARY["instead_of"].items() if word != "tips?"}
    words |= GLOSSARY["in_messages"]
    also = tuple(GLOSSARY["allowed_in_messages"])
    texts = [(file.name, text) for file in SHOWN for text in messages(file)]
    assert len(texts) > 3_000
    found = [(name, wrong) for name, text in texts if (wrong := wrong_words(text, words, also))]
    assert not found
