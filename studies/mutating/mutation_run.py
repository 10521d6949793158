"""A plugin for pytest, ``-p mutating.mutation_run``: the collected tests run once, then beside each mutant.

The tests run once as they are, for their CPU time and for which lines of the modules each reaches; what fails
or takes too long as plain Python is left out. Then each mutant gets a process of its own, forked from this
one, in which the tests that reach its line run, the quickest first, until one fails: the mutant is found.
A mutant that takes several times as long as it may counts as found as well.

``FTQP_MUTATION`` names a JSON file with ``modules, count, seed, budget, out``; ``out`` gets a line a mutant.
"""

import json
import os
import signal
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from _pytest.runner import runtestprotocol
from mutating import mutation

JOB = "FTQP_MUTATION"
FOUND, MISSED, NOT_REACHED = "found", "missed", "not reached"
HANGS = 4.0
"""A mutant may take so many times the CPU time of its tests, and GRACE seconds more."""
GRACE = 3.0


def passes(item: pytest.Item, after: pytest.Item | None) -> str:
    """Runs a test: ``passed``, ``skipped`` or ``failed``."""
    outcomes = {report.outcome for report in runtestprotocol(item, log=False, nextitem=after)}
    return "failed" if "failed" in outcomes else "skipped" if "skipped" in outcomes else "passed"


class Baseline:
    """What each test takes and reaches, without a mutant."""

    def __init__(self, session: pytest.Session, modules: list[str]) -> None:
        import coverage

        files = [str(mutation.file_of(module)) for module in modules]
        watch = coverage.Coverage(data_file=None, include=files, config_file=False)
        self.seconds: dict[str, float] = {}
        self.items = {item.nodeid: item for item in session.items}
        self.failed: list[str] = []
        watch.start()
        for k, item in enumerate(session.items):
            watch.switch_context(item.nodeid)
            began = time.process_time()
            outcome = passes(item, session.items[k + 1] if k + 1 < len(session.items) else None)
            if outcome == "passed":
                self.seconds[item.nodeid] = time.process_time() - began
            elif outcome == "failed":
                self.failed.append(item.nodeid)
        watch.switch_context("")
        watch.stop()
        data = watch.get_data()
        self._lines: dict[str, dict[int, list[str]]] = {
            module: data.contexts_by_lineno(file) for module, file in zip(modules, files, strict=True)
        }

    def reaching(self, mutant: mutation.Mutant, budget: float) -> list[str]:
        """The tests that reach a mutant's line, those of its own test file and the quickest first."""
        lines = self._lines[mutant.module]
        names = set(lines.get(mutant.line, ())) & self.seconds.keys()
        if not names:  # of a constant, or of a line that goes on: all that reach the module
            names = {name for found in lines.values() for name in found} & self.seconds.keys()
        own = f"test_{mutant.module.rsplit('.', 1)[1]}.py"
        ranked = sorted(names, key=lambda name: (own not in name, self.seconds[name], name))
        chosen, left = [], budget
        for name in ranked:
            if self.seconds[name] <= left:
                chosen.append(name)
                left -= self.seconds[name]
        return chosen


def verdict(mutant: mutation.Mutant, baseline: Baseline, budget: float) -> dict[str, Any]:
    """Whether a mutant is found, by what, and in which time."""
    names = baseline.reaching(mutant, budget)
    row = {key: getattr(mutant, key) for key in ("module", "operator", "line", "before", "after")}
    row["tests"] = len(names)
    if not names:
        return row | {"outcome": NOT_REACHED, "by": "", "seconds": 0.0}
    reader, writer = os.pipe()
    began = time.monotonic()
    child = os.fork()
    if child == 0:
        os.close(reader)
        _run(mutant, [baseline.items[name] for name in names], sum(map(baseline.seconds.get, names)), writer)
    os.close(writer)
    with os.fdopen(reader, encoding="utf-8") as told:
        by = told.read()
    _, status = os.waitpid(child, 0)
    survived = os.WIFEXITED(status) and os.WEXITSTATUS(status) == 0
    row["outcome"] = MISSED if survived else FOUND
    row["by"] = "" if survived else by or "hangs or ends the process"
    return row | {"seconds": round(time.monotonic() - began, 2)}


def _run(mutant: mutation.Mutant, items: list[pytest.Item], seconds: float, writer: int) -> None:
    """The child: ends with 0 where all tests pass, with 1 where one does not."""
    quiet = os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 1), os.dup2(quiet, 2)
    signal.signal(signal.SIGXCPU, signal.SIG_DFL)
    used = time.process_time()
    import resource

    most = int(used + HANGS * seconds + GRACE) + 1
    resource.setrlimit(resource.RLIMIT_CPU, (most, most + 1))
    try:
        mutation.planted(mutant)
        for k, item in enumerate(items):
            if passes(item, items[k + 1] if k + 1 < len(items) else None) != "passed":
                os.write(writer, item.nodeid.encode())
                os._exit(1)
    except BaseException as error:
        os.write(writer, f"{type(error).__name__}: {error}"[:200].encode())
        os._exit(1)
    os._exit(0)


def pytest_runtestloop(session: pytest.Session) -> bool:
    """In the place of pytest's own loop."""
    job = json.loads(Path(os.environ[JOB]).read_text(encoding="utf-8"))
    baseline = Baseline(session, job["modules"])
    with Path(job["out"]).open("w", encoding="utf-8") as out:
        told = {"tests": len(baseline.seconds), "seconds": sum(baseline.seconds.values())}
        told |= {"failed": baseline.failed, "left_out": len(session.items) - len(baseline.seconds)}
        out.write(json.dumps(told) + "\n")
        for module in job["modules"]:
            every = len(mutation.mutants(module))
            for mutant in mutation.sampled(module, job["count"], job["seed"]):
                row = verdict(mutant, baseline, job["budget"])
                out.write(json.dumps(row | {"of": every}) + "\n")
                out.flush()
                sys.stderr.write(f"{row['outcome']} {row['seconds']} {module}:{row['line']}\n")
    return True
