"""Draws files by their grammar, near what is valid, and judges what is made of them.

Scenarios, campaigns, studies and profiles in TOML, overrides of a command line, tables in CSV, logs as
tables, results in SQLite, plans in NPZ, verdicts, calibrations and summaries in JSON: keys dropped, doubled,
renamed, nested, values of the schema at and beyond their bounds, NaN, 1e308, whole numbers of 400 digits,
dates, digits of other scripts, control characters, views without end, right checksums over wrong numbers. A
file is taken, and then what a user does with it works, or it is refused in a clear sentence; nothing hangs,
nothing else is raised, no file is lost or altered. Files are tried in a process of their own, so that a
crash is seen.

    python studies/fuzz_files.py --files 10000            # of each kind; writes studies/results/fuzz_files.md
    python studies/fuzz_files.py --kinds log,plan --files 500
    python studies/fuzz_files.py --replay scenario:4711       # one file alone, with its text
"""

import sys
import time
import warnings
from dataclasses import asdict
from typing import Any

from bench import command_line, results
from fuzz import workers
from fuzz.files import promises, trial

SEED = 14
SLOW = {"study": 5}
"""Of these kinds there are so many times fewer files, for each takes longer."""
KEPT = 20
"""So many findings of a kind are kept word by word."""
LIMITATIONS = (
    "What is taken is run for a few ticks, not to its end; that is the matter of campaigns.",
    "A file is judged by what it makes of one process; what happens when it is killed in the middle of its "
    "work is the matter of `python studies/kill_runs.py`.",
)


def work(kind: str, seed: int, first: int, count: int) -> None:
    """What the process does: a line before each file, and one with what came of it."""
    promises.limit_memory()
    warnings.simplefilter("ignore")

    def tried(number: int) -> dict[str, Any]:
        begun = time.process_time()
        found = asdict(trial.numbered(kind, seed, number))
        return found | {"number": number, "seconds": time.process_time() - begun}

    workers.work(range(first, first + count), tried)


def counted(kind: str, given: Any) -> dict[str, Any]:
    """What came of all files of a kind."""
    total: dict[str, Any] = dict.fromkeys(("files", "taken", "failing", "crashed"), 0)
    total |= {"seconds": 0.0, "longest": 0.0, "findings": []}
    end = given.first + (max(1, given.files // SLOW[kind]) if kind in SLOW else given.files)

    def command(first: int) -> list[str]:
        numbers = {"seed": given.seed, "first": first, "files": end - first}
        return [__file__, "--worker", kind, *(f"--{name}={number}" for name, number in numbers.items())]

    for found in workers.apart(command, given.first, end):
        total["files"] += 1
        total["taken"] += bool(found.get("taken"))
        total["crashed"] += found.get("crashed", 0)
        total["failing"] += bool(found["wrong"])
        total["seconds"] += found.get("seconds", 0.0)
        total["longest"] = max(total["longest"], found.get("seconds", 0.0))
        for sentence in found["wrong"]:
            sys.stderr.write(f"{kind}:{found['number']}: {sentence!s:.300}\n")
            if len(total["findings"]) < KEPT:
                total["findings"].append({"number": found["number"], "wrong": sentence[:300]})
    return total


def markdown(result: dict[str, Any]) -> str:
    """The report."""
    rows, findings = [], []
    for kind, total in result["kinds"].items():
        rows.append(
            f"| `{kind}` | {trial.KINDS[kind][1]} | {total['files']:,} | {total['taken']:,} | "
            f"{total['files'] - total['taken'] - total['failing']:,} | {total['crashed']:,} | "
            f"{total['failing']:,} | {total['seconds']:.0f} | {total['longest']:.1f} |"
        )
        findings += [f"- {kind}:{one['number']}: {one['wrong']}" for one in total["findings"]]
    lines = [
        *results.preamble("Files drawn by grammar", result),
        "| kind | what it is, and what was done with it | files | taken | refused in a clear sentence | "
        "crashes or hangs of the process | broke a promise | CPU [s] | longest [s] |",
        "|---|---|---:|---:|---:|---:|---:|---:|---:|",
        *rows,
        "",
        "## What was found",
        "",
        *(findings or ["Nothing."]),
        "",
        *results.appendix(result),
    ]
    return "\n".join(lines)


def main() -> int:
    """Tries files, prints, writes; 0: every promise was kept, 1: not, 2: bad input, 130: Ctrl-C."""
    parser = command_line.parser(__doc__)
    add = parser.add_argument
    add("--seed", type=int, default=SEED, help="draws everything")
    add("--first", type=int, default=0, help="number of the first file")
    add(
        "--files",
        type=command_line.at_least_one,
        default=1000,
        help="how many there are of each kind; a fifth of that of studies",
    )
    add("--kinds", default=",".join(trial.KINDS), metavar="A,B", help="which kinds")
    add("--replay", metavar="KIND:NUMBER", help="try one file in this process and say what was wrong")
    results.add_out(parser, "fuzz_files")
    add("--json", action="store_true", help="print one JSON object and nothing else")
    add("--worker", metavar="KIND", help="for the script itself")
    given = parser.parse_args()
    if given.worker:
        work(given.worker, given.seed, given.first, given.files)
        return 0
    if given.replay is not None:
        kind, _, number = given.replay.partition(":")
        if kind not in trial.KINDS or not number.isdecimal():
            parser.error(
                f"argument --replay: is {given.replay}, expected one of {', '.join(trial.KINDS)}:NUMBER"
            )
        trial.shown(kind, given.seed, int(number))
        outcome = trial.numbered(kind, given.seed, int(number))
        sys.stdout.write("\n".join([outcome.sentence or f"taken: {outcome.taken}", *outcome.wrong, ""]))
        return 1 if outcome.wrong else 0
    kinds = [kind.strip() for kind in given.kinds.split(",")]
    if strange := set(kinds) - set(trial.KINDS):
        parser.error(f"argument --kinds: has {', '.join(strange)}, expected some of {', '.join(trial.KINDS)}")
    try:
        found = {kind: counted(kind, given) for kind in kinds}
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        return 130
    result = results.circumstances("fuzz_files", (), {"seed": given.seed, "files": given.files}) | {
        "kinds": found,
        "limitations": list(LIMITATIONS),
    }
    code = results.told(result, markdown(result), given.out, "fuzz_files", as_json=given.json)
    return code or (1 if any(total["failing"] for total in found.values()) else 0)


if __name__ == "__main__":
    sys.exit(main())
