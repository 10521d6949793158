"""No command runs Python code that lies in the current folder, in none of its processes."""

import os
import subprocess
import sys
from collections.abc import Iterable
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

EVERY = {*sys.stdlib_module_names, *packages_distributions(), "ftqp", "sitecustomize", "usercustomize"}
"""Every module that this Python has, and what it looks for when it starts."""
OF_FTQP = {"json", "multiprocessing", "numba", "numpy", "pinocchio", "rich", "scipy", "sqlite3",
           "tomllib", "typer", "typing"}  # fmt: skip
"""Modules that ftqp asks for; ``python -m`` itself imports others before it comes to ftqp."""
HOSTILE = (
    "import pathlib\n"
    "pathlib.Path({marker!r}).touch()\n"
    "raise ImportError('code from the current folder was run')\n"
)
CAMPAIGN = """
[campaign]
seed = 5
episodes = 4
[scenario.robot]
name = "planar"
[scenario.path]
kind = "circle"
radius = 0.05
duration = 0.2
[vary]
"planner.dt" = [0.005, 0.01]
"""
STUDY = ("campaign", "../campaign.toml", "--out", "campaign", "--jobs", "2")
"""A command with workers; what workers import does not depend on their work."""


@pytest.fixture
def hostile(tmp_path: Path):
    """Makes the current folder: a stranger's modules in the place of these."""
    (tmp_path / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    folder = tmp_path / "current"

    def made(names: Iterable[str]) -> Path:
        (folder / "markers").mkdir(parents=True)
        for name in names:
            file = folder / name / "__init__.py" if name == "multiprocessing" else folder / f"{name}.py"
            file.parent.mkdir(exist_ok=True)
            file.write_text(HOSTILE.format(marker=str(folder / "markers" / name)), encoding="utf-8")
        return folder

    return made


def run(folder: Path, *command: str) -> "subprocess.CompletedProcess[str]":
    """A Python in the folder, and that it ran nothing there."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"}
    done = subprocess.run(
        [sys.executable, *command], cwd=folder, env=environment, capture_output=True, text=True, timeout=600
    )
    assert not list((folder / "markers").iterdir()), done.stderr[-900:]
    return done


@pytest.mark.slow
def test_python_m_ftqp_and_its_workers_run_nothing_of_the_current_folder(hostile) -> None:
    done = run(hostile(OF_FTQP), "-m", "ftqp", *STUDY)
    assert done.returncode == 0, done.stderr[-600:]


PROGRAM = """import sys
sys.path[1:1] = {path!r}
from ftqp.__main__ import main
if __name__ == "__main__":
    main()
"""
"""What pip writes as ``bin/ftqp``, with what is on the path of the tests."""


def script(folder: Path) -> str:
    """The command as it is installed."""
    (folder / "ftqp").write_text(PROGRAM.format(path=sys.path), encoding="utf-8")
    return str(folder / "ftqp")


def test_the_command_and_its_workers_run_nothing_of_the_current_folder(hostile, tmp_path) -> None:
    done = run(hostile(EVERY), script(tmp_path), *STUDY)
    assert done.returncode == 0, done.stderr[-600:]


@pytest.mark.slow
def test_python_that_ignores_the_environment_starts_no_workers(hostile, tmp_path) -> None:
    done = run(hostile(EVERY), "-E", script(tmp_path), *STUDY)
    assert done.returncode == 2 and "give python -P, too, or --jobs 1" in " ".join(done.stderr.split())
