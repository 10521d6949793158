"""A library that is damaged, older than its source or for another machine is not loaded, and it is said."""

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ftqp.kernel.compiled.levels import LEVELS
from ftqp.kernel.compiled.library import MANIFEST, NoLibrary, library_in


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


@pytest.mark.parametrize(
    "change",
    [{"format": 1}, {"system": "Plan9"}, {"machine": "m68k"}, {"implementation": "pypy"}, {"pointer": 4}],
)
def test_library_for_another_platform_is_not_loaded(copy: tuple[Path, Path], change: dict[str, Any]) -> None:
    said(copy[0], **change)
    assert "was built for" in problem(copy)


def test_library_for_a_better_processor_is_not_loaded(
    copy: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ftqp.kernel.compiled.levels._features", dict)
    said(copy[0], machine="x86_64", of_level="x86-64-v3")
    monkeypatch.setattr("platform.machine", lambda: "x86_64")
    assert "this processor does not have all that" in problem(copy) and "x86-64-v3" in problem(copy)


def test_unknown_class_of_processors_is_not_loaded(copy: tuple[Path, Path]) -> None:
    assert "x86-64-v9" not in LEVELS["x86_64"]
    said(copy[0], of_level="x86-64-v9")
    assert "this processor does not have all that" in problem(copy)


def test_library_that_is_older_than_its_source_is_not_loaded(copy: tuple[Path, Path]) -> None:
    (file,) = copy[1].glob("*.py")
    file.write_text(file.read_text().replace("x / 3.0", "x / 4.0"))
    assert "is older than its source" in problem(copy)
    said(copy[0], files="")  # as in a wheel, where nobody edits
    assert library_in(*copy)


def test_comments_and_docstrings_make_no_library_older(copy: tuple[Path, Path]) -> None:
    (file,) = copy[1].glob("*.py")
    text = file.read_text()
    file.write_text(text.replace("# of growing size", "#").replace("A wave.", "One wave.") + "# end\n")
    assert library_in(*copy)


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "null", "{}", "[" * 100_000, '{"libraries": [{}]}', '{"libraries": 3}', "\x00\xff"],
    ids=range(9),
)
def test_damaged_manifest_is_named(copy: tuple[Path, Path], text: str) -> None:
    (copy[0] / MANIFEST).write_text(text)
    assert f"{MANIFEST} is damaged" in problem(copy)


@pytest.mark.parametrize("file", ["../kernel.so", "/kernel.so", "", "sub/kernel.so"])
def test_library_outside_its_folder_is_not_looked_at(copy: tuple[Path, Path], file: str) -> None:
    said(copy[0], of_file=file)
    assert f"{MANIFEST} is damaged" in problem(copy)


@pytest.mark.parametrize("share", [0.0, 0.5, 0.99])
def test_part_of_a_library_is_not_loaded(copy: tuple[Path, Path], share: float) -> None:
    content = library(copy[0]).read_bytes()
    library(copy[0]).write_bytes(content[: int(share * len(content))])
    assert "its sha256 differs" in problem(copy)


def test_library_of_another_hash_is_not_loaded(copy: tuple[Path, Path]) -> None:
    content = bytearray(library(copy[0]).read_bytes())
    content[len(content) // 2] ^= 1
    library(copy[0]).write_bytes(content)
    assert "its sha256 differs" in problem(copy)


def test_library_that_is_no_library_cannot_be_loaded(copy: tuple[Path, Path]) -> None:
    from ftqp.kernel.compiled.library import fingerprint

    text = b"no machine code"
    library(copy[0]).write_bytes(text)
    said(copy[0], of_sha256=fingerprint(text))
    assert "cannot be loaded" in problem(copy)


def test_missing_library_is_named(copy: tuple[Path, Path]) -> None:
    library(copy[0]).unlink()
    assert "is missing" in problem(copy)


def test_reason_of_a_build_that_failed_is_passed_on(copy: tuple[Path, Path]) -> None:
    said(copy[0], libraries=[], reason="there was no linker")
    assert problem(copy) == "the kernel could not be built (there was no linker)"


@pytest.mark.parametrize("place", [lambda built: built, lambda built: built / MANIFEST, library])
def test_library_that_others_could_write_is_not_loaded(
    copy: tuple[Path, Path], place: Callable[[Path], Path]
) -> None:
    place(copy[0]).chmod(0o777)
    assert "can be written by other users" in problem(copy)


@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="only root gives files away")
@pytest.mark.parametrize("place", [lambda built: built, lambda built: built / MANIFEST, library])
def test_library_of_another_user_is_not_loaded(
    copy: tuple[Path, Path], place: Callable[[Path], Path]
) -> None:
    os.chown(place(copy[0]), 54_321, -1)
    assert "belongs to another user" in problem(copy)


def test_functions_of_a_copy_compute(copy: tuple[Path, Path], ready: Any) -> None:
    function = library_in(*copy).function(ready.summed, 8)
    record = np.zeros(1, np.dtype([("x", np.float64, (8,)), ("sum", np.float64)]))
    assert function is not None and function(record.ctypes.data, 8) == 16 and record["sum"][0] == 0.0
