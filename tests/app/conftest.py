"""A short scenario, so that a run of the command line takes a moment."""

import signal
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from ftqp.app.commands.cli import app
from ftqp.app.scenario.document import Document
from ftqp.app.scenario.setup import Setup, resolve, validated

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


def invoke(*arguments: object) -> Result:
    """The command line in this process."""
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def heed_interrupts() -> None:
    """Ctrl-C means something to the child even if the tests run in the background, where shells ignore it."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@pytest.fixture
def short(tmp_path: Path) -> Path:
    """The file of a scenario of 51 steps with a lock on the way."""
    file = tmp_path / "short.toml"
    file.write_text(SHORT, encoding="utf-8")
    return file


def setup_of(folder: Path | None = None, **tables: Any) -> Setup:
    """What a scenario with these tables stands for: a Panda that goes along a line where they are silent."""
    content: dict[str, Any] = {
        "robot": {"name": "panda"},
        "path": {"kind": "line", "displacement": [0.1, 0.0, 0.0], "duration": 1.0},
    }
    found = Document(name="test", origin="test", folder=folder or Path.cwd(), content=content | tables)
    return resolve(found, validated(found))
