"""A short scenario, so that a run of the command line takes a moment."""

from pathlib import Path

import pytest

SHORT = """
[robot]
name = "planar6"

[planner]
dt = 0.01

[path]
kind = "line"
displacement = [0.01, 0.0, 0.0]
duration = 0.5

[[faults]]
kind = "locked"
joint = "j2"
at = 0.2
"""


@pytest.fixture
def short(tmp_path: Path) -> Path:
    """The file of a scenario of 51 steps with a lock on the way."""
    file = tmp_path / "short.toml"
    file.write_text(SHORT, encoding="utf-8")
    return file
