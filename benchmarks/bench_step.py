"""The whole user step, measured: set the target, solve, check, integrate.

    python benchmarks/bench_step.py                  ftqp with each native backend
    python benchmarks/bench_step.py --peers          placo, pink and mink, each in an environment of its own
    python benchmarks/bench_step.py --ways paced     one way of calling only
    python benchmarks/bench_step.py --peers --json   one JSON object on stdout, nothing else

Two robots (Panda, a 30-joint chain), two levels (velocity; acceleration with torque rows), healthy and with
one joint locked, called in three ways: ``best`` with recurring arrays and targets made ahead, ``readme`` with
fresh arrays and one target that is rewritten every tick, ``paced`` as ``readme`` but once a millisecond with
the process asleep between. All variants follow the same recorded targets in closed loop and take turns, a
chunk at a time, in one run. Tables and the JSON object are also written to ``--out`` (default
``benchmarks/results``), as ``bench_step-part`` unless everybody was measured. No figure is a pass or a fail.
"""

import argparse
import json
import sys
import tempfile
from dataclasses import asdict, replace
from itertools import product
from pathlib import Path
from typing import Any

from bench import cases, command_line, docs, results
from bench.ways import PERIOD, WAYS
from rich.console import Console
from steps import environments, report
from steps.measure import Settings, Worker, last_core, measured
from steps.own import tasks

WIDTH = 150
"""Columns of a table that does not go to a terminal."""
RESULTS = Path(__file__).resolve().parent / "results"
HOT = Settings(steps=20_000, chunk=500, warm=cases.PERIOD, share=5)
PACED = Settings(steps=8_000, chunk=100, warm=cases.PERIOD, discard=5, share=5)
"""Its steps take a millisecond each, whoever makes them."""
QUICK = Settings(steps=200, chunk=100, warm=100, share=5)
PACED_QUICK = Settings(steps=20, chunk=10, warm=20, discard=1, share=5)
LEADING = (report.OURS, report.REFERENCE)
"""They make all steps; every other variant makes a fifth of them."""


def main() -> int:
    """Measures, prints, writes: 0 when ftqp was measured, else 1; 2 for bad input, 130 when interrupted."""
    options = _options()
    messages = Console(stderr=True, highlight=False)
    try:
        result = _measured(options, messages)
    except KeyboardInterrupt:
        messages.print("interrupted; nothing was written")
        return 130
    except environments.NotInstalled as error:
        needed = "the tables of docs/evidence/speed.md need it: nothing was measured"
        messages.print(f"{error}; {needed}", soft_wrap=True)
        return 2
    if options.json:
        sys.stdout.write(json.dumps(result) + "\n")
    else:
        report.show(result, Console(highlight=False, width=None if sys.stdout.isatty() else WIDTH))
    full = options.peers and options.ways == WAYS and not options.steps and report.complete(result)
    suffix = "-quick" if options.quick else "" if full else "-part"  # only a full run replaces that on record
    files = results.written(result, report.markdown(result), options.out, f"bench_step{suffix}")
    if options.update_docs and report.complete(result):
        tables = [report.reached(result), report.missed(result), *report.contenders(result)]
        files += docs.shown(result, files[0], {docs.SPEED: tables})
    elif options.update_docs:
        left = "a ratio is missing, so that the result on record and the texts were left as they are"
        messages.print(left, style="yellow", soft_wrap=True)
    for file in files:
        messages.print(f"wrote {file}", soft_wrap=True)
    return 0 if any(any(result[f"us{suffix}"].values()) for suffix in report.SUFFIXES.values()) else 1


def settings_of(way: str, options: argparse.Namespace) -> Settings:
    """How much is measured in a way."""
    hot, paced = (QUICK, PACED_QUICK) if options.quick else (HOT, PACED)
    settings = paced if way == "paced" else hot
    if options.steps and options.steps < settings.steps:
        settings = replace(settings, steps=options.steps, chunk=min(settings.chunk, options.steps))
    return settings


def _options() -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    add = parser.add_argument
    add("--peers", action="store_true", help="measure placo, pink and mink too (installs them)")
    add("--json", action="store_true", help="print one JSON object and nothing else")
    add("--quick", action="store_true", help="few steps: shows that it works, figures mean little")
    command_line.add_ways(parser)
    most = "at most so many timed steps a variant and way"
    add("--steps", type=command_line.at_least_one, metavar="N", help=most)
    add("--update-docs", action="store_true", help="put the tables into the page about speed")
    add("--out", type=Path, default=RESULTS, metavar="DIR", help="where results go")
    add("--env-dir", type=Path, default=environments.DEFAULT, metavar="DIR", help="the peers' environments")
    add("--core", type=int, metavar="N", help="the core to run on (default the last one)")
    add("--realtime", action="store_true", help="ask for real-time priority")
    options: argparse.Namespace = parser.parse_args()
    if options.update_docs and (not options.peers or options.quick or options.ways != WAYS):
        parser.error("--update-docs needs a full run with --peers, in every way and without --quick")
    return options


def _measured(options: argparse.Namespace, messages: Console) -> dict[str, Any]:
    """Everything, as the object that ``--json`` prints.

    Raises:
        NotInstalled: The reference cannot be had and the docs need it.
    """
    left_out: dict[str, list[tuple[str, str]]] = {}
    programs: dict[str, Any] = {}
    rows = []
    machine = results.machine()
    settings = {way: settings_of(way, options) for way in options.ways}
    with tempfile.TemporaryDirectory() as folder:
        workers = _workers(options, Path(folder), left_out, messages)
        try:
            for path in tasks():
                for level, locked, way in product(cases.LEVELS, (False, True), options.ways):
                    case = path.case(level, locked=locked)
                    joint = None if case.locked is None else case.joints[case.locked]
                    row: dict[str, Any] = {"robot": path.name, "level": level, "locked": joint, "way": way}
                    place = f"{report.title(row)}, {way}"
                    messages.print(f"measuring {place}")
                    file = Path(folder) / "case.npz"
                    row["variants"], failed, said = measured(
                        path, case, way, file, workers, settings[way], LEADING
                    )
                    for variant, why in failed.items():
                        left_out.setdefault(variant, []).append((place, why))
                    programs |= said
                    rows.append(row)
        finally:
            for worker in workers:
                worker.close()
    told = {way: ", ".join(f"{k} {v}" for k, v in asdict(settings[way]).items()) for way in options.ways}
    return {
        **results.circumstances("bench_step", [], told | {"dt": cases.DT, "period": PERIOD}),
        **report.ratios(rows),
        "steps": {way: settings[way].steps for way in options.ways},
        "machine": machine,
        "versions": {
            name: f"{', '.join(map(' '.join, said['versions'].items()))} "
            f"(core {said['settled']['core']}, priority {said['settled']['priority']})"
            for name, said in programs.items()
        },
        "contenders": {},
        "cases": rows,
        "left_out": {name: _reasons(places) for name, places in left_out.items()},
        "limitations": list(report.LIMITATIONS),
    }


def _workers(
    options: argparse.Namespace, folder: Path, left_out: dict[str, list[tuple[str, str]]], messages: Console
) -> list[Worker]:
    """Our own worker and, if asked for, one for each peer that can be installed."""
    pythons = {"ftqp": (Path(sys.executable), "steps.own")}
    for peer in environments.PEERS if options.peers else ():
        messages.print(f"preparing {peer.name} in {options.env_dir / peer.name}")
        try:
            pythons[peer.name] = (environments.python_of(peer, options.env_dir), peer.module)
        except environments.NotInstalled as error:
            if options.update_docs and peer.name == "placo":
                raise
            left_out[peer.name] = [("all cases", str(error))]
            messages.print(str(error), style="yellow")
    core = last_core() if options.core is None else options.core
    return [
        Worker(name, python, module, log=folder / f"{name}.log", core=core, realtime=options.realtime)
        for name, (python, module) in pythons.items()
    ]


def _reasons(places: list[tuple[str, str]]) -> str:
    """Each reason once, with where it held."""
    cases_of: dict[str, list[str]] = {}
    for place, why in places:
        cases_of.setdefault(why, []).append(place)
    return "; ".join(f"{why} ({_where(found)})" for why, found in cases_of.items())


def _where(found: list[str]) -> str:
    return found[0] if len(found) == 1 else f"{len(found)} cases"


if __name__ == "__main__":
    sys.exit(main())
