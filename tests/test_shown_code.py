"""Code that a text shows is right: its Python passes mypy as examples do, its commands and options exist."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import typer

from ftqp.app.commands.cli import app

ROOT = Path(__file__).parents[1]
TEXTS = sorted(
    [
        *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "SECURITY.md")),
        *(ROOT / "docs").rglob("*.md"),
    ]
)
BEFORE = """\
import ftqp
from ftqp.core.checks import FloatArray
from ftqp.sim.log.log_arrays import Log
robot: ftqp.Robot
planner: ftqp.Planner
target: ftqp.Target
q: FloatArray
v: FloatArray
tau: FloatArray
log: Log
"""
"""What goes without saying in texts that show pieces."""
USAGE: Any = typer.BadParameter.__base__
"""What is raised of a wrong use; versions of typer have it from click, or as their own."""
PIECES = ("detection.md", "choosing.md", "go-to-a-goal.md")
FOREIGN = ("rclpy.pyi", "sensor_msgs/msg.pyi", "trajectory_msgs/msg.pyi")
"""Packages of ROS, which pip does not install, as mypy is told of them."""
INDENTED = re.compile(r"^ {4}(ftqp [a-z].*)$", re.M)
INLINE = re.compile(r"`(ftqp [a-z][^`]*)`")


def blocks(text: str) -> list[str]:
    """The Python that a text shows."""
    return re.findall(r"```python\n(.*?)```", text, re.S)


def complaints(folder, code: dict[str, str]) -> str:
    """What mypy says of pieces of code by name, as strictly as of the examples."""
    pytest.importorskip("mypy", reason='needs mypy (pip install -e ".[dev]")')
    for name in FOREIGN:
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("from typing import Any\ndef __getattr__(name: str) -> Any: ...\n")
        if "/" in name:
            (folder / name).with_name("__init__.pyi").touch()
    for name, text in code.items():
        (folder / f"{name}.py").write_text(text, encoding="utf-8")
    done = subprocess.run(  # in a process of its own, which gives back the gigabyte that it takes
        [sys.executable, "-m", "mypy", *(str(folder / f"{name}.py") for name in code)],
        cwd=ROOT,  # where its settings and what it keeps of the last run are
        env={**os.environ, "MYPYPATH": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stderr + "".join(
        line for line in done.stdout.splitlines(True) if not line.startswith("Success")
    )


@pytest.mark.slow
def test_python_that_texts_show_passes_mypy(tmp_path):
    code = {}
    for file in TEXTS:
        for k, block in enumerate(blocks(file.read_text(encoding="utf-8"))):
            before = BEFORE if file.name in PIECES else ""
            code[f"{file.stem.replace('-', '_')}_{k}"] = before + block
    assert len(code) > 10
    code["mistaken"] = "import ftqp\nftqp.Planner(ftqp.robots.load('panda'), dt='1').reset()\n"
    said = complaints(tmp_path, code).splitlines()
    assert any("mistaken.py:2" in line and "arg-type" in line for line in said)
    assert [line for line in said if "mistaken.py" not in line][:-1] == []


def commands(text: str) -> list[str]:
    """The commands of ftqp that a text shows, each without the words beside it."""
    inline = (f"{line} ..." for line in INLINE.findall(text))  # where more may be left out
    return [re.split(r" {2,}| #| > ", line)[0].rstrip(" \\") for line in (*INDENTED.findall(text), *inline)]


def wrong(line: str) -> str | None:
    """What is wrong with a command, or None: its name, an option, or the words that it takes."""
    group: Any = typer.main.get_command(app)
    name, *words = shlex.split(line)[1:]
    if name not in group.commands:
        return f"{line}: there is no command {name}"
    command = group.commands[name]
    known = {option for one in command.params for option in (*one.opts, *one.secondary_opts)}
    for word in words:
        option = word.strip("[]").split("=")[0].split("|")[0]
        if option.startswith("-") and option not in known | {"--help", "-h"}:
            return f"{line}: ftqp {name} has no option {option}"
    if re.search(r"[\[\]|]|(?<= )[A-Z]{2,}\b", line) or "--help" in words:
        return None  # a form with places to be filled in
    try:
        command.make_context(name, [word for word in words if word != "..."])
    except USAGE as error:
        if type(error).__name__ == "MissingParameter" and words[-1:] == ["..."]:
            return None
        return f"{line}: {error.format_message()}"
    return None


@pytest.mark.parametrize("file", TEXTS, ids=lambda file: str(file.relative_to(ROOT)))
def test_every_command_that_a_text_shows_exists_with_its_options(file):
    assert [said for line in commands(file.read_text(encoding="utf-8")) if (said := wrong(line))] == []


def test_a_wrong_command_is_found():
    text = """
    ftqp run panda-circle --backend daqp      # right
    ftqp runn panda-circle
    ftqp run panda-circle --sett a=1
    ftqp run panda-circle iiwa-line
    ftqp export panda
    ftqp campaign safety --replay seven

Say `ftqp view RUN --fast`, but `ftqp export` and `ftqp check panda-circle` are right.
"""
    assert [wrong(line) is None for line in commands(text)] == [True, *6 * [False], True, True]
