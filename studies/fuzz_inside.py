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

import sys
from typing import Any

from bench import command_line, results
from fuzz import workers
from fuzz.inside.episode import TICKS, run

COUNTED = ("steps", "beyond", "infinite", "disagreements", "shut", "crashed", "seconds")
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


def disturbed(given: Any) -> dict[str, Any]:
    """Run episodes until enough steps were made: what came of them."""
    total, places = workers.nothing(COUNTED, ("done", "statuses")), set()
    end = given.first + (10**9 if given.episodes is None else given.episodes)
    coming = workers.episodes(__file__, given, total, end)
    for outcome in coming:
        places.update(outcome.get("places", []))
        if given.episodes is None and total["steps"] >= given.steps:
            break
    coming.close()
    return total | {"places": sorted(places)}


def markdown(result: dict[str, Any]) -> str:
    """The report."""
    total = result["total"]
    rows = {
        "episodes": f"{total['episodes']:,}",
        "steps, each judged": f"{total['steps']:,}",
        "commands beyond limits": f"{total['beyond']:,}",
        "commands that are not finite": f"{total['infinite']:,}",
        "disagreements of belief and kernel, or with what a call promises": f"{total['disagreements']:,}",
        "crashes or hangs of the process": f"{total['crashed']:,}",
        "episodes with any of these": f"{total['failing']:,}",
        "ticks in which the gate was shut": f"{total['shut']:,}",
        "lines of ftqp at which something was raised or called": f"{len(total['places']):,}",
        "steps a second": f"{total['steps'] / max(total['seconds'], 1e-9):,.0f}",
    }
    tables = {"done": "What was done before steps", "statuses": "Statuses"}
    return workers.report("Planners disturbed from inside", result, rows, tables)


def main() -> int:
    """Disturbs, prints, writes; 0: nothing was wrong, 1: something was, 2: bad input, 130: Ctrl-C."""
    parser = workers.parser(__doc__, "fuzz_inside", TICKS)
    add = parser.add_argument
    add("--steps", type=command_line.at_least_one, default=100_000, help="steps to be made and judged")
    add("--episodes", type=command_line.at_least_one, help="episodes to be run, in the place of --steps")
    given = parser.parse_args()
    if (code := workers.run_here(given, run)) is not None:
        return code
    try:
        total = disturbed(given)
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        return 130
    settings = {"seed": given.seed, "ticks": given.ticks}
    result = results.circumstances("fuzz_inside", (), settings) | {
        "total": total,
        "limitations": list(LIMITATIONS),
    }
    code = results.told(result, markdown(result), given.out, "fuzz_inside", as_json=given.json)
    return code or (1 if total["failing"] else 0)


if __name__ == "__main__":
    sys.exit(main())
