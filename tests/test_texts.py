"""Every text tells the truth: the names of ftqp, the files and the tests that it mentions exist."""

import ast
import importlib
import inspect
import io
import pkgutil
import re
import tokenize
from functools import cache
from pathlib import Path
from types import MemberDescriptorType

import pytest

import ftqp
from ftqp.core.fixed import Fixed

ROOT = Path(__file__).parents[1]
FOLDERS = ("src", "examples", "bench", "solvers", "benchmarks", "studies", "tests")
TEXTS = sorted(
    [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md")]
    + [ROOT / folder / "README.md" for folder in ("solvers", "benchmarks", "studies")]
    + [*(ROOT / "docs").rglob("*.md")]
)
SOURCES = sorted(file for folder in FOLDERS for file in (ROOT / folder).rglob("*.py"))
INSTANCES = {
    "step": ftqp.Step, "planner": ftqp.Planner, "follower": ftqp.PathFollower, "target": ftqp.Target,
    "targets": ftqp.Targets, "robot": ftqp.Robot,
}  # fmt: skip
"""What a text means by these words before a dot."""
NAME = re.compile(r"(?<![\w./@-])(ftqp(?:\.[A-Za-z_]\w*)+)")
INSTANCE = re.compile(rf"`({'|'.join(INSTANCES)})((?:\.[A-Za-z_]\w*)+)")
FILE = re.compile(rf"(?<![\w/.<])((?:docs|{'|'.join(FOLDERS)})/[\w./-]*\w)(?![\w*<{{])")
COMMENT = re.compile(r"#.*(?:ftqp\.|`|\bspec\b)")
"""What may be a comment that a test here looks at: others are not searched for, as that takes longest."""
FILE_ENDINGS = ("toml", "npz", "sqlite", "md", "json", "git", ".h", ".hpp", ".c", ".mjs", ".wasm", ".o")


def relative(file):
    return str(file.relative_to(ROOT))


def strings(tree):
    """Every string of a module, parts of f-strings included."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


def docstrings(tree):
    """Every string of a module that is a statement of its own."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr):
            yield from strings(node.value) if isinstance(node.value, ast.Constant) else ()


@cache
def words_of(file):
    """What a file says: a text as it is, of a module its strings and comments."""
    text = file.read_text(encoding="utf-8")
    if file.suffix == ".md":
        return text
    own = relative(file).startswith("tests/")  # strings of tests are inputs as often as texts
    said = list((docstrings if own else strings)(ast.parse(text)))
    if COMMENT.search(text):
        tokens = tokenize.generate_tokens(io.StringIO(text).readline)
        said += [token.string for token in tokens if token.type == tokenize.COMMENT]
    return "\n".join(said)


def member(owner, name):
    """The attribute of a module or class, or the class of an attribute that instances have.

    Raises:
        AttributeError: there is none.
    """
    try:
        return inspect.getattr_static(owner, name) if inspect.isclass(owner) else getattr(owner, name)
    except AttributeError:
        if inspect.ismodule(owner) and hasattr(owner, "__path__"):
            try:
                return importlib.import_module(f"{owner.__name__}.{name}")
            except ModuleNotFoundError as error:
                raise AttributeError(name) from error
        if inspect.isclass(owner) and re.search(rf"self\.{name}\b[^=\n]*=", sources_of(owner)):
            return None
        if inspect.isclass(owner) and any(
            name in getattr(base, "__annotations__", {}) for base in owner.mro()
        ):
            return None
        raise


def sources_of(owner):
    return "\n".join(inspect.getsource(base) for base in owner.mro() if base.__module__.startswith("ftqp"))


def missing(dotted, start=None):
    """The first part of a dotted name that does not exist, or None."""
    first, *rest = dotted.split(".")
    found = ftqp if start is None else start
    for part in rest:
        if found is None:  # an attribute of an instance, of which nothing more is known
            return None
        try:
            found = member(found, part)
        except AttributeError:
            return f"{first} has no {part}: {dotted}"
        if isinstance(found, property | Fixed | MemberDescriptorType):
            found = None
        first = f"{first}.{part}"
    return None


def wrong_names(text):
    names = {name for name in NAME.findall(text) if not name.endswith(FILE_ENDINGS)}
    found = [missing(name) for name in names]
    found += [missing(f"{word}{rest}", INSTANCES[word]) for word, rest in set(INSTANCE.findall(text))]
    return sorted(one for one in found if one)


def test_every_name_of_ftqp_in_a_text_exists():
    files = [file for file in (*TEXTS, *SOURCES) if file != Path(__file__)]
    wrong = {relative(file): wrong_names(words_of(file)) for file in files}
    assert not {file: names for file, names in wrong.items() if names}


def test_a_wrong_name_is_found():
    text = "`ftqp.qp.dtrnn.solve(...)`, `ftqp.Planner(robot).step`, `ftqp.Step.status`, see `ftqp run`."
    assert wrong_names(text) == []
    wrong = "`ftqp.qp.dtrn.solve`, ftqp.Plan(1), `ftqp.Planner.halt`, `step.stat`, ``ftqp.kernel.rows.none``"
    assert len(wrong_names(wrong)) == 5


@pytest.mark.parametrize("file", TEXTS, ids=relative)
def test_every_file_that_a_text_names_exists(file):
    text = file.read_text(encoding="utf-8")
    named = set(FILE.findall(text))
    assert not sorted(name for name in named if not list(ROOT.glob(name)))


@pytest.mark.parametrize("file", TEXTS, ids=relative)
def test_every_test_that_a_text_tells_to_run_exists(file):
    """``pytest FILE -k WORDS``: the file has a test with those words in its name."""
    for name, words in re.findall(r"pytest (tests/\S+\.py) -k (\w+)", file.read_text(encoding="utf-8")):
        tests = (ROOT / name).read_text(encoding="utf-8")
        assert re.search(rf"(?:def test|class Test)\w*{words}", tests, re.I), f"{name} -k {words}"


def test_every_target_of_make_that_a_text_names_exists():
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M))
    for file in TEXTS:
        named = re.findall(r"(?:^ {4}|`)make ([\w-]+)", file.read_text(encoding="utf-8"), re.M)
        assert set(named) <= targets, f"{relative(file)}: {set(named) - targets}"


def references():
    """The keys of references.bib."""
    return set(re.findall(r"@\w+\{(\w+),", (ROOT / "docs" / "references.bib").read_text(encoding="utf-8")))


def test_every_source_that_is_cited_is_in_the_references():
    known = references()
    assert known
    for file in (ROOT / "docs").rglob("*.md"):
        cited = set(re.findall(r"(?<=[\[ ])@(\w+)", file.read_text(encoding="utf-8")))
        assert cited <= known, f"{relative(file)}: {cited - known}"


def test_nothing_in_a_package_hides_a_module_of_its_name():
    """``ftqp.qp.dtrnn`` is the package, also after a function of that name has been imported."""
    hidden = []
    for found in list(pkgutil.walk_packages(ftqp.__path__, "ftqp.")):
        parent, _, name = found.name.rpartition(".")
        if name == "__main__":
            continue
        held = vars(importlib.import_module(parent)).get(name)
        if held is not None and not inspect.ismodule(held):
            hidden.append(found.name)
    assert not hidden
