"""Episodes in a process of their own, so that a crash or a hang of it is a result like any other."""

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from fuzz import episode

TOO_LONG = 300.0
"""An episode that takes longer hangs [s]."""
SCRIPT = Path(__file__).resolve().parents[1] / "fuzz_step.py"


def work(seed: int, first: int, count: int, ticks: int) -> None:
    """What the process does: a line before each episode, and one with what came of it.

    Args:
        seed: Of the run.
        first: The number of the first episode.
        count: How many there are.
        ticks: How long each is.
    """
    for number in range(first, first + count):
        sys.stdout.write(f"{number}\n")
        sys.stdout.flush()
        sys.stdout.write(json.dumps(asdict(episode.run(seed, number, ticks=ticks))) + "\n")
        sys.stdout.flush()


def outcomes(
    seed: int, first: int, count: int, ticks: int, paths: str, plain: bool
) -> Iterator[dict[str, Any]]:
    """What came of each episode; after a crash or a hang of the process a new one goes on behind it.

    Args:
        seed: Of the run.
        first: The number of the first episode.
        count: How many there are.
        ticks: How long each is.
        paths: Where the process finds its modules.
        plain: Whether it runs without compilation.
    """
    environment = {**os.environ, "PYTHONPATH": paths, "NUMBA_DISABLE_JIT": "1" if plain else "0"}

    def command(first: int) -> list[str]:
        numbers = {"seed": seed, "first": first, "episodes": end - first, "ticks": ticks}
        return [str(SCRIPT), "--worker", *(f"--{name}={number}" for name, number in numbers.items())]

    end = first + count
    yield from apart(command, first, end, environment)


def apart(
    command: Callable[[int], list[str]], first: int, end: int, environment: dict[str, str]
) -> Iterator[dict[str, Any]]:
    """What came of numbered work in a process of its own; after a crash a new one goes on behind it.

    Args:
        command: What Python is started with, from the number with which it begins.
        first: The first number.
        end: The number behind the last one.
        environment: Of the process.
    """
    while first < end:
        line_of = [sys.executable, "-X", "faulthandler", *command(first)]
        with subprocess.Popen(line_of, stdout=subprocess.PIPE, text=True, env=environment) as process:
            begun = first
            try:
                for line in _lines(process):
                    if line.startswith("{"):
                        yield json.loads(line)
                        first = begun + 1
                    elif line.strip().isdecimal():  # others are what libraries of solvers print
                        begun = int(line)
                code = process.wait()
            finally:
                process.kill()
        if first < end:
            yield {"number": begun, "crashed": 1, "wrong": [_end_of(code)]}
            first = begun + 1


def _lines(process: Any) -> Iterator[str]:
    """Lines of a process, which is killed when none comes for too long."""
    while True:
        watch = threading.Timer(TOO_LONG, process.kill)
        watch.start()
        line = process.stdout.readline()
        watch.cancel()
        if not line:
            return
        yield line


def _end_of(code: int) -> str:
    """How a process ended, in words."""
    if code == -signal.SIGKILL:
        return f"the process hung for {TOO_LONG:g} s, or was killed"
    if code < 0:
        return f"the process crashed: {signal.Signals(-code).name}"
    return f"the process ended with {code}"
