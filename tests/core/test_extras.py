"""How an extra is installed: by a command that works, since no index has ftqp."""

import json
import re
import tomllib
from importlib import metadata
from pathlib import Path

import pytest

from ftqp.core import extras
from ftqp.core.extras import missing_library, remedy_for_extra

ROOT = Path(__file__).parents[2]
PROMISES_AN_INDEX = re.compile(r"pip3? install\b[^\n]*?(?<![\w./@-])ftqp(\[[^\]\n]*\])?(?![\w/.\[-])(?! @)")
"""``pip install`` of the bare name, with extras or without."""


def installed(monkeypatch: pytest.MonkeyPatch, folder: Path, origin: object) -> str:
    """What is said where ftqp lies in site-packages, and pip noted its origin."""
    monkeypatch.setattr(extras, "__file__", str(folder / "site-packages" / "ftqp" / "core" / "extras.py"))
    about = folder / "ftqp-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: ftqp\nVersion: 1.0\n", encoding="utf-8")
    if origin is not None:
        (about / "direct_url.json").write_text(json.dumps(origin), encoding="utf-8")
    monkeypatch.setattr(metadata, "distribution", lambda name: metadata.PathDistribution(about))
    return remedy_for_extra("viz")


def test_checkout_that_is_imported_is_named() -> None:
    assert remedy_for_extra("viz") == f'pip install -e "{ROOT}[viz]"'


def test_folder_that_pip_installed_from_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    clone = tmp_path / "a clone"
    clone.mkdir()
    said = installed(monkeypatch, tmp_path, {"url": clone.as_uri(), "dir_info": {}})
    assert said == f'pip install "{clone}[viz]"'


def test_wheel_that_pip_installed_from_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    wheel = tmp_path / "ftqp-1.0-py3-none-any.whl"
    wheel.touch()
    said = installed(monkeypatch, tmp_path, {"url": wheel.as_uri(), "archive_info": {}})
    assert said == f'pip install "ftqp[viz] @ {wheel.as_uri()}"'


def test_repository_that_pip_installed_from_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    origin = {"url": "https://example.org/ftqp.git", "vcs_info": {"vcs": "git", "commit_id": "1"}}
    said = installed(monkeypatch, tmp_path, origin)
    assert said == 'pip install "ftqp[viz] @ git+https://example.org/ftqp.git"'


@pytest.mark.parametrize("origin", [None, {}, [], {"url": "file:///no/such/folder", "dir_info": {}}])
def test_unknown_or_lost_origin_sends_to_a_clone(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, origin: object
) -> None:
    said = installed(monkeypatch, tmp_path, origin)
    assert said == 'pip install ".[viz]" in a clone of its repository'


def test_every_extra_that_the_code_names_exists() -> None:
    known = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    named = {
        extra
        for file in (ROOT / "src").rglob("*.py")
        for extra in re.findall(r'remedy_for_extra\("(\w+)"\)', file.read_text(encoding="utf-8"))
    }
    assert {"viz", "sim", "ros", "distributed"} <= named
    assert named <= set(known["project"]["optional-dependencies"])


@pytest.mark.parametrize(
    ("text", "promises"),
    [
        ('pip install "ftqp[viz]"', True),
        ("pip install ftqp", True),
        ("pip install --upgrade ftqp", True),
        ('pip install -e ".[viz]"', False),
        ('pip install "ftqp[viz] @ git+https://example.org/ftqp.git"', False),
        ("pip install dist/ftqp-1.0-py3-none-any.whl", False),
        ('pip install -e "/home/me/ftqp[viz]"', False),
    ],
)
def test_what_promises_an_index_is_recognised(text: str, promises: bool) -> None:
    assert bool(PROMISES_AN_INDEX.search(text)) == promises


def test_no_text_promises_that_an_index_has_ftqp() -> None:
    texts = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md"), *(ROOT / "examples").rglob("*")]
    texts += [
        file for file in (ROOT / "src").rglob("*") if file.suffix in (".py", ".toml", ".md", ".js", ".html")
    ]
    said = [
        f"{file.relative_to(ROOT)}: {found[0]}"
        for file in texts
        if file.suffix in (".md", ".py", ".toml", ".js", ".html")
        for found in PROMISES_AN_INDEX.finditer(file.read_text(encoding="utf-8"))
    ]
    assert not said, "\n".join(said)


@pytest.mark.parametrize(
    ("file", "package"),
    [("libgomp.so.1", "libgomp1"), ("libstdc++.so.6", "libstdc++6"), ("libEGL_x2.so.1", "libegl_x2-1")],
)
def test_a_library_that_a_slim_system_lacks_is_named_with_its_package(file, package):
    error = ImportError(f"{file}: cannot open shared object file: No such file or directory")
    said = missing_library(error)
    assert said is not None and said.startswith(f"{file} is not on this machine")
    assert said.endswith(f"apt install {package}")


def test_a_module_that_is_missing_is_no_such_library():
    assert missing_library(ModuleNotFoundError("No module named 'pinocchio'")) is None
