"""A library that is damaged, older than its source or for another machine is not loaded, and it is said."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from ftqp.kernel.compiled.library import MANIFEST, NoLibrary, fingerprint, library_in


@pytest.fixture
def copy(ready: Any, tmp_path: Path) -> tuple[Path, Path]:
    """A copy of the built library and of its source."""
    built, source = tmp_path / "built", tmp_path / "source"
    shutil.copytree(ready.built, built)
    shutil.copytree(ready.source, source, ignore=shutil.ignore_patterns("__pycache__"))
    return built, source


def problem(copy: tuple[Path, Path]) -> str:
    """Why it is not loaded."""
    with pytest.raises(NoLibrary) as caught:
        library_in(*copy)
    return str(caught.value)


def said(built: Path, **changes: Any) -> None:
    """Change the manifest; names with two underscores are those of its library."""
    manifest = json.loads((built / MANIFEST).read_text())
    for name, value in changes.items():
        (manifest["libraries"][0] if name.startswith("of_") else manifest)[name.removeprefix("of_")] = value
    (built / MANIFEST).write_text(json.dumps(manifest))


def library(built: Path) -> Path:
    """The file of the library."""
    (one,) = built.glob("kernel-*.so")
    return one


def test_whole_library_is_loaded(copy: tuple[Path, Path]) -> None:
    assert library_in(*copy).level


def test_no_folder_is_a_kernel_that_is_not_built(tmp_path: Path) -> None:
    assert problem((tmp_path / "none", tmp_path)) == "the kernel is not built"


def test_library_that_is_older_than_its_source_is_not_loaded(copy: tuple[Path, Path]) -> None:
    (file,) = copy[1].glob("*.py")
    file.write_text(file.read_text().replace("x / 3.0", "x / 4.0"))
    assert "is older than its source" in problem(copy)
    said(copy[0], files="")  # as in a wheel, where nobody edits
    assert library_in(*copy)


def test_library_that_is_older_than_its_c_is_not_loaded(copy: tuple[Path, Path]) -> None:
    (copy[1] / "glue.c").write_text("int more;\n")
    assert "is older than its source" in problem(copy)


def test_comments_and_docstrings_make_no_library_older(copy: tuple[Path, Path]) -> None:
    (file,) = copy[1].glob("*.py")
    text = file.read_text()
    file.write_text(text.replace("# of growing size", "#").replace("A wave.", "One wave.") + "# end\n")
    assert library_in(*copy)


def flipped(content: bytes) -> bytes:
    """The same with one bit of another value."""
    half = len(content) // 2
    return content[:half] + bytes([content[half] ^ 1]) + content[half + 1 :]


def of_text(built: Path) -> None:
    """A file that is no machine code, and a manifest that says that it is as it should be."""
    library(built).write_bytes(b"no machine code")
    said(built, of_sha256=fingerprint(b"no machine code"))


OTHERS = ({"format": 1}, {"system": "Plan9"}, {"machine": "m68k"}, {"implementation": "pypy"}, {"pointer": 4})
TEXTS = ("", "{", "null", "{}", "[" * 100_000, '{"libraries": [{}]}', '{"libraries": 3}', "\x00\xff")
OUTSIDE = ("../kernel.so", "/kernel.so", "", "sub/kernel.so")
WRONG: list[tuple[Callable[[Path], object], str]] = [
    *((lambda built, change=change: said(built, **change), "was built for") for change in OTHERS),
    (lambda built: said(built, of_level="x86-64-v9"), "this processor does not have all that"),
    *((lambda b, text=text: (b / MANIFEST).write_text(text), f"{MANIFEST} is damaged") for text in TEXTS),
    *((lambda built, file=file: said(built, of_file=file), f"{MANIFEST} is damaged") for file in OUTSIDE),
    (lambda built: library(built).write_bytes(b""), "its sha256 differs"),
    (lambda built: library(built).write_bytes(library(built).read_bytes()[:-99]), "its sha256 differs"),
    (lambda built: library(built).write_bytes(flipped(library(built).read_bytes())), "its sha256 differs"),
    (of_text, "cannot be loaded"),
    (lambda built: library(built).unlink(), "cannot be read"),
    (
        lambda built: said(built, libraries=[], reason="no linker"),
        "the kernel could not be built (no linker)",
    ),
]


@pytest.mark.parametrize(("spoil", "reason"), WRONG, ids=range(len(WRONG)))
def test_library_that_is_not_what_it_should_be_is_not_loaded(
    copy: tuple[Path, Path], spoil: Callable[[Path], object], reason: str
) -> None:
    spoil(copy[0])
    assert reason in problem(copy)
