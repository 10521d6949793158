"""Results of a comparison: what they were made with, the files they go to, the README's copy."""

import argparse
import json
import os
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from bench.contenders import Contender
from ftqp import __version__
from ftqp.core.errors import InputError

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = tuple(ROOT / name for name in ("solvers", "benchmarks", "studies"))
"""Where scripts are, each beside the folder of its results."""
README = ROOT / "solvers" / "README.md"
PLACES = ("--out", "--file", "--keep", "--env-dir", "--environments", "--sets")
"""Options that name a folder or a file."""
ALWAYS = ("ftqp", "numpy", "numba", "scipy")
"""Packages whose versions matter whoever takes part."""
DISTRIBUTIONS = {"proxqp": "proxsuite", "highs": "highspy", "jaxopt_osqp": "jaxopt"}
"""Solvers of qpsolvers whose package has another name."""


def circumstances(
    benchmark: str, taking_part: Sequence[Contender], settings: dict[str, Any]
) -> dict[str, Any]:
    """What a result begins with: date, command line, settings, machine, versions, contenders."""
    return {
        "benchmark": benchmark,
        "date": datetime.now().astimezone().isoformat(timespec="seconds"),
        "command": command(benchmark, sys.argv[1:]),
        "settings": settings,
        "machine": machine(),
        "versions": versions(taking_part),
        "contenders": {contender.name: contender.settings for contender in taking_part},
        "left_out": {},
    }


def command(benchmark: str, arguments: Sequence[str]) -> str:
    """The line that makes the result again; places, which differ from machine to machine, are left out."""
    kept, skip = [], False
    for argument in arguments:
        if not skip and argument.split("=")[0] not in PLACES:
            kept.append(argument)
        skip = argument in PLACES
    return shlex.join(["python", f"{folder(benchmark).parent.name}/{benchmark}.py", *kept])


def folder(benchmark: str) -> Path:
    """Where the results of a script are on record: ``results``, in the folder of the script."""
    (home,) = (place for place in FOLDERS if (place / f"{benchmark}.py").is_file())
    return home / "results"


def add_out(parser: argparse.ArgumentParser, benchmark: str) -> None:
    """Add the folder that the results of a script go to."""
    publish = "where results go (default: where they are on record)"
    parser.add_argument("--out", type=Path, default=folder(benchmark), metavar="DIR", help=publish)


def machine() -> dict[str, Any]:
    """What this was measured on."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.is_file() else []
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return {
        "cpu": models[0] if models else platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
        "load": [round(value, 2) for value in os.getloadavg()] if hasattr(os, "getloadavg") else None,
    }


def versions(taking_part: Sequence[Contender]) -> dict[str, str]:
    """Versions of the packages that take part, by name."""
    names = list(ALWAYS)
    for contender in taking_part:
        names.append(contender.made().package)
        if contender.settings["name"].startswith("qpsolvers:"):
            solver = contender.settings["name"].removeprefix("qpsolvers:")
            names.append(DISTRIBUTIONS.get(solver, solver))
    return {"python": platform.python_version()} | packages(names)


def packages(names: Iterable[str]) -> dict[str, str]:
    """Versions of packages by name; one may be absent, as numba where the kernel is built."""
    found = {}
    for name in dict.fromkeys(names):
        try:
            found[name] = __version__ if name == "ftqp" else version(name)
        except PackageNotFoundError:
            found[name] = "not there"
    return found


def commit() -> str:
    """The commit that this checkout stands at, and whether its files differ from it."""
    git = shutil.which("git")
    if git is None or not (ROOT / ".git").exists():
        return "unknown"

    def said(*arguments: str) -> str:
        done = subprocess.run([git, *arguments], cwd=ROOT, capture_output=True, text=True, check=False)
        return done.stdout.strip() if done.returncode == 0 else "unknown"

    changed = said("status", "--porcelain", "--untracked-files=no")
    return said("rev-parse", "--short=10", "HEAD") + (" with changes" if changed else "")


@contextmanager
def checkout(commit: str) -> Iterator[Path]:
    """The files of another commit, in a folder that goes again.

    Raises:
        InputError: There is no such commit.
    """
    with tempfile.TemporaryDirectory() as folder:
        other = Path(folder) / "other"
        add = ["git", "worktree", "add", "--detach", "--quiet", str(other), commit]
        made = subprocess.run(add, cwd=ROOT, capture_output=True, text=True, check=False)
        if made.returncode != 0:
            raise InputError(f"{commit!r} is no commit of this repository: {made.stderr.strip()}")
        try:
            yield other
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", str(other)], cwd=ROOT, check=False)


def written(
    result: dict[str, Any],
    markdown: str,
    out: Path,
    name: str,
    figures: Callable[[dict[str, Any], Path, str], list[Path]] | None = None,
) -> list[Path]:
    """Write ``<name>.md`` with its pictures, and ``<name>.json``; a result of the same name is replaced.

    Both say at the end which commit they were made at.

    Args:
        result: The result, which goes into the JSON file.
        markdown: The report; pictures that it does not show are added at its end.
        out: The folder, which is made if need be.
        name: What the files are called.
        figures: Writes the pictures of a result into a folder, under names that begin with ``name``.
    """
    files = [out / f"{name}.md", out / f"{name}.json"]
    try:
        out.mkdir(parents=True, exist_ok=True)
        pictures = [] if figures is None else figures(result, out, name)
        hidden = [picture.name for picture in pictures if picture.name not in markdown]
        shown = [f"![{_caption(picture, name)}]({picture})" for picture in hidden]
        at = commit()
        signed = f"Made at commit {at}."
        text = "\n\n".join([markdown.rstrip("\n"), *(["## Figures", *shown] if shown else []), signed])
        files[0].write_text(text + "\n", encoding="utf-8")
        files[1].write_text(json.dumps(result | {"commit": at}, allow_nan=False) + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"results cannot be written to {out}: {error.strerror}") from error
    return [*files, *pictures]


def _caption(picture: str, name: str) -> str:
    return picture.removeprefix(name).removesuffix(".png").strip("-").replace("-", " ") or "figure"


def preamble(title: str, result: dict[str, Any]) -> list[str]:
    """The head of a Markdown report: date and the command that makes it again."""
    settings = ", ".join(f"{name} {value}" for name, value in result["settings"].items())
    return [f"# {title}", "", f"{result['date']}; {settings}. Made by", "", f"    {result['command']}", ""]


def appendix(result: dict[str, Any]) -> list[str]:
    """The foot of a Markdown report: who did not take part, settings, versions, machine, limitations."""
    blocks = {
        "Could not take part": [f"{name}: {why}" for name, why in result["left_out"].items()],
        "Settings": [_settings(name, given) for name, given in result["contenders"].items()],
        "Versions": [f"{name} {number}" for name, number in result["versions"].items()],
        "Machine": [f"{name}: {value}" for name, value in result["machine"].items()],
        "Limitations": list(result["limitations"]),
    }
    lines = []
    for heading, entries in blocks.items():
        if entries:
            lines += [f"## {heading}", "", *(f"- {entry}" for entry in entries), ""]
    return lines


def _settings(name: str, given: dict[str, Any]) -> str:
    values = ", ".join(f"{key} = {json.dumps(value)}" for key, value in given.items())
    return f"`{name}`: {values}"


def inserted(text: str, benchmark: str, lines: Sequence[str]) -> str:
    """``text`` with the lines between the markers of a benchmark replaced."""
    begin, end = f"<!-- begin {benchmark} -->", f"<!-- end {benchmark} -->"
    before, found, rest = text.partition(begin)
    _, closed, after = rest.partition(end)
    if not found or not closed:
        raise InputError(f"the text has no lines {begin} and {end}; put them where the table belongs")
    return f"{before}{begin}\n" + "\n".join(lines).strip() + f"\n{end}{after}"
