"""Every tuned number of the kernel, of control and of detection says what it is, and cites what exists.

Constants of one decision may share what is said: a sentence that goes on in the next docstring ("..."), and
constants above the docstring that speaks of them.
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src/ftqp"
FOLDERS = ("kernel", "control", "faults/detection")
CITED = re.compile(r"\b(?:docs|tests|studies|solvers)/[\w/-]+\.(?:md|py)")
HEADING = re.compile(r'(docs/[\w/-]+\.md), "([^"]+)"(?: and "([^"]+)")?')
NUMBER = (
    ast.Constant,
    ast.Tuple,
    ast.BinOp,
    ast.UnaryOp,
    ast.operator,
    ast.unaryop,
    ast.Call,
    ast.Name,
    ast.Load,
)


def is_tuned(value: ast.expr) -> bool:
    """Whether this is a number, or a tuple of such, with a float in it."""
    nodes = list(ast.walk(value))
    return all(isinstance(node, NUMBER) for node in nodes) and any(
        isinstance(node, ast.Constant) and isinstance(node.value, float) for node in nodes
    )


def text_of(statement: ast.stmt) -> str | None:
    """The docstring that this is, or None."""
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
        return " ".join(str(statement.value.value).split())
    return None


def decisions(source: str) -> Iterator[tuple[list[str], str]]:
    """The tuned constants of each decision, and all that is said of them."""
    names: list[str] = []
    texts: list[str] = []
    block: list[tuple[list[str], str]] = []
    end = 0
    for statement in ast.parse(source).body:
        if statement.lineno > end + 1 or (text_of(statement) is None and not is_assigned(statement)):
            yield from [*block, (names, " ".join(texts))]
            names, texts, block = [], [], []
        end = statement.end_lineno or end
        text = text_of(statement)
        if text is None:
            if texts and not texts[-1].endswith("..."):
                block.append((names, " ".join(texts)))
                names, texts = [], []
            if is_assigned(statement) and is_tuned(statement.value):
                target = statement.targets[0] if isinstance(statement, ast.Assign) else statement.target
                names.append(ast.unparse(target))
        else:
            texts.append(text)
    yield from [*block, (names, " ".join(texts))]


def is_assigned(statement: ast.stmt) -> bool:
    """Whether a name gets a value here."""
    return isinstance(statement, ast.Assign) or (
        isinstance(statement, ast.AnnAssign) and statement.value is not None
    )


def files() -> list[str]:
    """What is looked at, relative to the package."""
    return sorted(
        str(path.relative_to(SOURCE)) for folder in FOLDERS for path in (SOURCE / folder).rglob("*.py")
    )


def test_every_tuned_constant_says_what_it_is():
    without = [
        f"{file}: {', '.join(names)}"
        for file in files()
        for names, said in decisions((SOURCE / file).read_text())
        if names and not said
    ]
    assert not without


def test_what_a_constant_cites_can_be_opened():
    missing = []
    for file in files():
        for names, said in decisions((SOURCE / file).read_text()):
            if names:
                missing += [f"{file}: {path}" for path in CITED.findall(said) if not (ROOT / path).is_file()]
                for page, *headings in HEADING.findall(said):
                    lines = (ROOT / page).read_text().splitlines()
                    titles = [line.lstrip("# ").split(" (")[0] for line in lines if line.startswith("#")]
                    missing += [
                        f"{file}: {page}, {title}" for title in headings if title and title not in titles
                    ]
    assert not missing


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ('A = 1.0\n"""How far [m]."""', []),
        ("A = 1.0", ["A"]),
        ("A = 1", []),
        ('A = 1.0\n"""How far [m] ..."""\nB = 2.0\n"""... and how fast."""', []),
        ('A, B = 1.0, 2\n"""How far [m]."""\n\nC = 2.0', ["C"]),
        ('A = 1.0\n\n\ndef f():\n    """Of something else."""', ["A"]),
    ],
)
def test_a_constant_without_a_word_is_found(source, found):
    assert [name for names, said in decisions(source) if not said for name in names] == found
