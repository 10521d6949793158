"""Disturbs planners from inside, and looks from outside at what leaves them.

An episode is a random planner (arm, level, drive, scheme, with and without detector and rows to give up)
whose arm does what it is told. Before its steps everything that is handed out is written into, and so is
every float of the planner's record but those that its gate judges by; while it is told of faults, loads and
tools, and while it steps, exceptions are raised at any line of ftqp, signals arrive, other threads call, and
objects of the caller raise or call back. After every step numbers are finite, commands within limits and
near the last one, and what the planner believes is what its kernel has and what it was told. Episodes run in
a process of their own, so that a crash is seen.

    python studies/fuzz_inside.py --steps 2000000       # until so many steps were made and judged
    python studies/fuzz_inside.py --replay 4711         # one episode alone, in this process
"""

import json
import os
import sys
from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Any

from bench import command_line, results
from fuzz import workers
from fuzz.inside.episode import TICKS, run

SEED = 14
COUNTED = ("steps", "beyond", "infinite", "disagreements", "shut", "crashed", "seconds")
TABLES = ("done", "statuses")
KEPT = 60
"""So many findings are kept word by word."""
LIMITATIONS = (
    "The rooms `gate`, `chain` and `limits` of a planner's record, its sampling period and its whole "
    "numbers, which are sizes and branches, are not written into: the gate judges by them.",
    "Arrays of a robot cannot be written, but numpy lets whoever asks for it make them writable "
    "(`setflags(write=True)`): that is done to arrays of steps, views and copies, not to the model.",
    "Timers, and threads that run at once, come when they come: an episode with them may differ when it is "
    "replayed.",
    "Limits are judged of joints that work, ranges and ways of all but those that swing freely; "
    "accelerations with the bounds `viability`, and not in the tick of an instant lock.",
)


def added(total: dict[str, Any], outcome: dict[str, Any]) -> None:
    """Count an episode in.

    Args:
        total: The counters so far.
        outcome: Of the episode.
    """
    total["episodes"] += 1
    for name in COUNTED:
        total[name] += outcome.get(name, 0)
    for name in TABLES:
        total[name] = dict(Counter(total[name]) + Counter(outcome.get(name, {})))
    total["places"] = sorted({*total["places"], *outcome.get("places", [])})
    total["failing"] += bool(outcome["wrong"])
    if outcome["wrong"] and len(total["findings"]) < KEPT:
        total["findings"].append({name: outcome.get(name, "") for name in ("number", "sentence", "wrong")})


def nothing() -> dict[str, Any]:
    """Counters before the first episode."""
    zero = dict.fromkeys(("episodes", "failing", *COUNTED), 0)
    return {**zero, "findings": [], "places": [], **{name: {} for name in TABLES}}


def work(seed: int, first: int, count: int, ticks: int) -> None:
    """What the process does: a line before each episode, and one with what came of it."""
    for number in range(first, first + count):
        sys.stdout.write(f"{number}\n")
        sys.stdout.flush()
        sys.stdout.write(json.dumps(asdict(run(seed, number, ticks=ticks))) + "\n")
        sys.stdout.flush()


def disturbed(given: Any) -> dict[str, Any]:
    """Run episodes until enough steps were made: what came of them."""
    total = nothing()
    paths = os.pathsep.join([str(Path(__file__).parent), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = {**os.environ, "PYTHONPATH": paths}
    end = given.first + (10**9 if given.episodes is None else given.episodes)

    def command(first: int) -> list[str]:
        numbers = {"seed": given.seed, "first": first, "episodes": end - first, "ticks": given.ticks}
        return [__file__, "--worker", *(f"--{name}={number}" for name, number in numbers.items())]

    coming = workers.apart(command, given.first, end, environment)
    for outcome in coming:
        added(total, outcome)
        for sentence in outcome["wrong"]:
            sys.stderr.write(f"{outcome['number']}: {sentence[:300]}\n")
        if given.episodes is None and total["steps"] >= given.steps:
            break
    coming.close()
    return total


def markdown(result: dict[str, Any]) -> str:
    """The report."""
    total = result["total"]
    rate = total["steps"] / max(total["seconds"], 1e-9)
    lines = [
        *results.preamble("Planners disturbed from inside", result),
        "| what | how often |",
        "|---|---:|",
        f"| episodes | {total['episodes']:,} |",
        f"| steps, each judged | {total['steps']:,} |",
        f"| commands beyond limits | {total['beyond']:,} |",
        f"| commands that are not finite | {total['infinite']:,} |",
        f"| disagreements of belief and kernel, or with what a call promises | {total['disagreements']:,} |",
        f"| crashes or hangs of the process | {total['crashed']:,} |",
        f"| episodes with any of these | {total['failing']:,} |",
        f"| ticks in which the gate was shut | {total['shut']:,} |",
        f"| lines of ftqp at which something was raised or called | {len(total['places']):,} |",
        f"| steps a second | {rate:,.0f} |",
        "",
        "## What was found",
        "",
        *(
            f"- {found['number']} ({found['sentence']}): {'; '.join(found['wrong'])[:400]}"
            for found in total["findings"]
        ),
        *(["Nothing."] if not total["findings"] else []),
        "",
        *_table("What was done before steps", total["done"]),
        *_table("Statuses", total["statuses"]),
        *results.appendix(result),
    ]
    return "\n".join(lines)


def _table(title: str, counts: dict[str, int]) -> list[str]:
    rows = [f"| {name} | {count:,} |" for name, count in sorted(counts.items(), key=lambda pair: -pair[1])]
    return [f"## {title}", "", "| what | how often |", "|---|---:|", *rows, ""]


def main() -> int:
    """Disturbs, prints, writes; 0: nothing was wrong, 1: something was, 2: bad input, 130: Ctrl-C."""
    parser = command_line.parser(__doc__)
    add = parser.add_argument
    add("--seed", type=int, default=SEED, help="draws everything")
    add("--first", type=int, default=0, help="number of the first episode")
    add("--steps", type=command_line.at_least_one, default=100_000, help="steps to be made and judged")
    add("--episodes", type=command_line.at_least_one, help="episodes to be run, in the place of --steps")
    add("--ticks", type=command_line.at_least_one, default=TICKS, help="how long an episode is")
    add("--replay", type=int, metavar="NUMBER", help="run one episode in this process and say what was wrong")
    results.add_out(parser, "fuzz_inside")
    add("--json", action="store_true", help="print one JSON object and nothing else")
    add("--worker", action="store_true", help="for the script itself")
    given = parser.parse_args()
    if given.worker:
        work(given.seed, given.first, given.episodes, given.ticks)
        return 0
    if given.replay is not None:
        outcome = run(given.seed, given.replay, ticks=given.ticks)
        sys.stdout.write("\n".join([outcome.sentence, *outcome.wrong, ""]))
        return 1 if outcome.wrong else 0
    try:
        total = disturbed(given)
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        return 130
    settings = {"seed": given.seed, "ticks": given.ticks}
    result = results.circumstances("fuzz_inside", (), settings) | {
        "total": total,
        "left_out": {},
        "limitations": list(LIMITATIONS),
    }
    code = results.told(result, markdown(result), given.out, "fuzz_inside", as_json=given.json)
    return code or (1 if total["failing"] else 0)


if __name__ == "__main__":
    sys.exit(main())
