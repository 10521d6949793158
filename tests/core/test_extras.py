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


def test_folder_that_pip_installed_from_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    clone = tmp_path / "a clone"
    clone.mkdir()
    said = installed(monkeypatch, tmp_path, {"url": clone.as_uri(), "dir_info": {}})
    assert said == f'pip install "{clone}[viz]"'


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
