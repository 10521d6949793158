"""What the project's files promise: versions that agree, extras that the messages name."""

import tomllib
from pathlib import Path
from typing import Any

import pytest

import ftqp

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def project() -> dict[str, Any]:
    """The file pyproject.toml."""
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def test_version_is_the_same_everywhere() -> None:
    assert f"\nversion: {ftqp.__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\n## {ftqp.__version__}\n" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_extras_are_those_that_messages_name(project: dict[str, Any]) -> None:
    extras = set(project["project"]["optional-dependencies"])
    assert extras == {"viz", "sim", "robots", "ros", "solvers", "build", "distributed", "docs", "dev"}
