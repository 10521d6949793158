"""No command runs Python code that lies in the current folder, in none of its processes."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterable
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
import typer
from tests.app.conftest import SHORT
from typer.testing import CliRunner

from ftqp.app.commands.cli import app

PROGRAM = "import sys\nfrom ftqp.__main__ import main\nif __name__ == '__main__':\n    sys.exit(main())\n"
"""What pip writes as ``bin/ftqp``."""
ONE_AFTER_ANOTHER = """import sys
from ftqp.__main__ import main
if __name__ == '__main__':
    for arguments in {commands!r}:
        sys.argv[1:] = arguments
        try:
            main()
        except SystemExit as end:
            sys.stderr.write(f"{{arguments[0]}} ended with {{end.code}}\\n")
"""
"""The same for many commands: what was not loaded by one is loaded by the next."""
HOSTILE = (
    "import pathlib\n"
    "pathlib.Path({marker!r}).touch()\n"
    "raise ImportError('code from the current folder was run')\n"
)
OF_FTQP = {"json", "multiprocessing", "numba", "numpy", "pinocchio", "rich", "scipy", "sqlite3",
           "tomllib", "typer", "typing"}  # fmt: skip
"""Modules that ftqp asks for; ``python -m`` itself imports others before it comes to ftqp."""

STUDY = """
[robot]
name = "planar"
options = { lengths = [1.0, 0.8], continuous = true }

[map]
goal = [1.2, 0.9]
grid = 3
configurations = 2
steps = 6
"""
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
CASE = """
[robot]
name = "planar"
options = { lengths = [1.0, 1.0, 1.0], continuous = true }

[planner]
dt = 0.01

[planner.task]
rows = ["x", "y"]

[start]
q = [-1.3846534, 0.7853982, 0.7465384]

[path]
kind = "point_to_point"
position = [1.5, 1.5, 0.0]
duration = 0.2
law = "constant"

[[faults]]
kind = "locked"
joint = "j2"
at = 0.0
announced = "never"
"""
FILES = {"short": SHORT, "study": STUDY, "campaign": CAMPAIGN, "case": CASE}
MINUTE = (
    "--set", "faults=", "--set", "simulation.duration=60", "--set", "sensors.position_noise=1e-4",
    "--set", "planner.noise.q=1e-4", "--set", "path.displacement=[-0.3, -0.3, 0.0]",
    "--set", "path.duration=10.0",
)  # fmt: skip
ALARMS = ("--alarms", "3600", "--extrapolate")
COARSE = ("--waypoints", "3", "--spacing", "0.5", "--stride", "50")

COMMANDS = {
    "backends": (),
    "build": ("planar6", "-o", "built"),
    "calibrate": ("made/minute", *ALARMS, "--out", "c.json"),
    "campaign": ("campaign.toml", "--out", "campaign", "--jobs", "2"),
    "check": ("short.toml",),
    "compare": ("short.toml", "--schemes", "mvn", "--out", "compare"),
    "converge": ("case.toml", "--out", "converge"),
    "coverage": ("short.toml", "--stride", "50", "--out", "coverage", "--jobs", "1"),
    "demo": ("--out", "demo"),
    "doctor": (),
    "export": ("made/run", "--format", "npz", "-o", "export.npz"),
    "identify": ("--motion", "planar6", "--seconds", "6", "-o", "motion.csv"),
    "inspect": ("planar6", "--out", "inspect"),
    "plan": ("panda-y-line", *COARSE, "-o", "plan.npz", "--jobs", "1"),
    "replay": ("made/qps.npz", "--tick", "3"),
    "report": ("made/run", "-o", "report.html"),
    "robots": (),
    "run": ("short.toml", "--out", "run"),
    "schemes": (),
    "view": ("made/run", "--no-browser", "--port", "0", "--json"),
    "workspace": ("study.toml", "--out", "workspace", "--jobs", "1"),
}
"""Each command with arguments that keep it short; what workers import does not depend on their work."""


@cache
def every() -> set[str]:
    """Every module that this Python has, and what it looks for when it starts."""
    return {*sys.stdlib_module_names, *packages_distributions(), "ftqp", "sitecustomize", "usercustomize"}


def hostile(folder: Path, names: Iterable[str] | None = None) -> Path:
    """A folder with a stranger's module in the place of each of these."""
    folder.mkdir(exist_ok=True)
    (folder / "markers").mkdir()
    for name in every() if names is None else names:
        file = folder / name / "__init__.py" if name == "multiprocessing" else folder / f"{name}.py"
        file.parent.mkdir(exist_ok=True)
        file.write_text(HOSTILE.format(marker=str(folder / "markers" / name)), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Scenarios, a run with its QPs, and a minute of the healthy arm, for the commands to work on."""
    folder = tmp_path_factory.mktemp("made")
    for name, text in FILES.items():
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    short, qps = folder / "short.toml", folder / "qps.npz"
    for arguments in (("run", "--no-figures", "--record-qps", qps), ("minute", "--no-figures", *MINUTE)):
        name, *more = map(str, arguments)
        result = CliRunner().invoke(app, ["run", str(short), "--out", str(folder / name), *more])
        assert result.exit_code == 0, result.output
    return folder


@pytest.fixture
def current(made: Path, tmp_path: Path) -> Path:
    """The current folder: a stranger's modules beside what the user wants to work on."""
    folder = hostile(tmp_path / "current")
    for file in made.glob("*.toml"):
        (folder / file.name).write_bytes(file.read_bytes())
    (folder / "made").symlink_to(made)
    return folder


def environment() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"}


def program(folder: Path, text: str = PROGRAM) -> list[str]:
    """The command, as it is installed: a script in a folder of its own."""
    script = folder / "bin" / "ftqp"
    script.parent.mkdir()
    script.write_text(text, encoding="utf-8")
    return [sys.executable, str(script)]


def run(command: list[str], folder: Path) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        command, cwd=folder, env=environment(), capture_output=True, text=True, check=False, timeout=600
    )


def markers(folder: Path) -> list[str]:
    return sorted(file.name for file in (folder / "markers").iterdir())


def test_every_command_is_tried() -> None:
    group = typer.main.get_command(app)
    assert set(COMMANDS) == set(group.commands)  # type: ignore[attr-defined]


def test_commands_run_nothing_of_the_current_folder(current: Path, tmp_path: Path) -> None:
    names = sorted(COMMANDS.keys() - {"view"})
    commands = [[name, *COMMANDS[name]] for name in names]
    done = run(program(tmp_path, ONE_AFTER_ANOTHER.format(commands=commands)), current)
    ends = [line for line in done.stderr.splitlines() if " ended with " in line]
    assert (ends, markers(current)) == ([f"{name} ended with 0" for name in names], []), done.stderr[-900:]


def test_view_runs_nothing_of_the_current_folder(current: Path, tmp_path: Path) -> None:
    with subprocess.Popen(
        [*program(tmp_path), "view", *COMMANDS["view"]],
        cwd=current, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as begun:  # fmt: skip
        assert begun.stdout is not None and begun.stderr is not None
        served = begun.stdout.readline()
        begun.send_signal(signal.SIGINT)
        errors = begun.stderr.read()
    assert "http://" in served, errors
    assert markers(current) == []


def test_python_m_ftqp_and_its_workers_run_nothing_of_the_current_folder(made: Path, tmp_path: Path) -> None:
    folder = hostile(tmp_path / "current", OF_FTQP)
    study = ("campaign", str(made / "campaign.toml"), "--out", "campaign", "--jobs", "2")
    done = run([sys.executable, "-m", "ftqp", *study], folder)
    assert (done.returncode, markers(folder)) == (0, []), done.stderr[-600:]


def test_python_that_ignores_the_environment_starts_no_workers(made: Path, tmp_path: Path) -> None:
    folder = hostile(tmp_path / "current")
    script = program(tmp_path)[1]
    Path(script).write_text(f"import sys\nsys.path[1:1] = {sys.path!r}\n{PROGRAM}", encoding="utf-8")
    study = ("campaign", str(made / "campaign.toml"), "--out", "campaign", "--jobs", "2")
    done = run([sys.executable, "-E", script, *study], folder)
    assert done.returncode == 2 and "give python -P, too, or --jobs 1" in " ".join(done.stderr.split())
    assert markers(folder) == []
