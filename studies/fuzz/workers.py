"""Episodes in a process of their own, so that a crash or a hang of it is a result like any other."""

import argparse
import json
import os
import signal
import subprocess
import sys
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from bench import command_line, results

STUDIES = Path(__file__).resolve().parents[1]
SEED = 14
TOO_LONG = 300.0
"""An episode that takes longer hangs [s]."""
KEPT = 60
"""So many findings are kept word by word."""


def parser(document: str | None, script: str, ticks: int) -> argparse.ArgumentParser:
    """A parser with the options of a script that runs episodes of so many ticks."""
    made = command_line.parser(document)
    add = made.add_argument
    add("--seed", type=int, default=SEED, help="draws everything")
    add("--first", type=int, default=0, help="number of the first episode")
    add("--ticks", type=command_line.at_least_one, default=ticks, help="how long an episode is")
    add("--replay", type=int, metavar="NUMBER", help="run one episode in this process and say what was wrong")
    results.add_out(made, script)
    add("--json", action="store_true", help="print one JSON object and nothing else")
    add("--worker", action="store_true", help="for the script itself")
    return made


def run_here(given: argparse.Namespace, run: Callable[..., Any]) -> int | None:
    """Run what is asked of this very process, a worker's episodes or a replay: its exit code, or None."""
    if given.worker:
        numbers = range(given.first, given.first + given.episodes)
        work(numbers, lambda number: asdict(run(given.seed, number, ticks=given.ticks)))
        return 0
    if given.replay is None:
        return None
    outcome = run(given.seed, given.replay, ticks=given.ticks)
    sys.stdout.write("\n".join([outcome.sentence, *outcome.wrong, ""]))
    return 1 if outcome.wrong else 0


def work(numbers: Iterable[int], outcome: Callable[[int], dict[str, Any]]) -> None:
    """What the process does: a line before each number, and one with what came of it."""
    for number in numbers:
        sys.stdout.write(f"{number}\n")
        sys.stdout.flush()
        sys.stdout.write(json.dumps(outcome(number)) + "\n")
        sys.stdout.flush()


def nothing(counted: Iterable[str], tables: Iterable[str]) -> dict[str, Any]:
    """Counters before the first episode: numbers, and tables of numbers by a word."""
    zero = dict.fromkeys(("episodes", "failing", *counted), 0)
    return {**zero, "findings": [], **{name: {} for name in tables}}


def episodes(
    script: str, given: argparse.Namespace, total: dict[str, Any], end: int, *, plain: bool = False
) -> Iterator[dict[str, Any]]:
    """What comes of each episode in a process of its own, after it was counted in and said what was wrong."""
    options = {"seed": given.seed, "first": None, "episodes": None, "ticks": given.ticks}

    def command(first: int) -> list[str]:
        numbers = options | {"first": first, "episodes": end - first}
        return [script, "--worker", *(f"--{name}={number}" for name, number in numbers.items())]

    jit = {"NUMBA_DISABLE_JIT": "1" if plain else "0"}
    for outcome in apart(command, given.first + total["episodes"], end, jit):
        add(total, outcome)
        for sentence in outcome["wrong"]:
            sys.stderr.write(f"{outcome['number']}: {sentence[:300]}\n")
        yield outcome


def add(total: dict[str, Any], outcome: dict[str, Any]) -> None:
    """Count an episode in."""
    counted = {"episodes": 1, "failing": int(bool(outcome["wrong"])), **outcome}
    for name, before in total.items():
        if isinstance(before, dict):
            counter = Counter(before)
            counter.update(outcome.get(name, {}))
            total[name] = dict(counter)
        elif not isinstance(before, list):
            total[name] = before + counted.get(name, 0)
    if outcome["wrong"] and len(total["findings"]) < KEPT:
        total["findings"].append({name: outcome.get(name, "") for name in ("number", "sentence", "wrong")})


def apart(
    command: Callable[[int], list[str]], first: int, end: int, environment: dict[str, str] | None = None
) -> Iterator[dict[str, Any]]:
    """What came of numbered work in a process of its own; after a crash a new one goes on behind it."""
    paths = os.pathsep.join(filter(None, [str(STUDIES), os.environ.get("PYTHONPATH")]))
    environment = {**os.environ, "PYTHONPATH": paths, **(environment or {})}
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


def report(title: str, result: dict[str, Any], rows: dict[str, str], tables: dict[str, str]) -> str:
    """The report of a script."""
    total = result["total"]
    lines = [
        *results.preamble(title, result),
        *_table(list(rows.items())),
        "## What was found",
        "",
        *(
            f"- {found['number']} ({found['sentence']}): {'; '.join(found['wrong'])[:400]}"
            for found in total["findings"]
        ),
        *(["Nothing."] if not total["findings"] else []),
        "",
    ]
    for name, heading in tables.items():
        counts = sorted(total[name].items(), key=lambda pair: -pair[1])
        lines += [f"## {heading}", "", *_table([(word, f"{count:,}") for word, count in counts])]
    return "\n".join([*lines, *results.appendix(result)])


def _table(rows: Iterable[tuple[str, str]]) -> list[str]:
    return ["| what | how often |", "|---|---:|", *(f"| {what} | {count} |" for what, count in rows), ""]
