"""Corrupts every input of ``planner.step`` and of the calls around it, and judges what comes back.

An episode is a random planner (arm, level, mode, drive, scheme, backend) and some hundred ticks. Numbers
are damaged (NaN, 1e308, glitches, wrapped angles, dead encoders, flipped bits), handed in as lists,
strided, byte-swapped, read-only, object and foreign arrays, and changed after the call; calls are made in
any order (report, withdraw, reset, stop, resume, carry, tool, copy, pickle, from threads), and mistakes in
between. What is promised is held against the model file by ftqp.checker: finite, inside limits, failed
joints held, statuses honest, mistakes refused in a sentence. Episodes run in a process of their own, so
that a crash is seen.

    python studies/fuzz_step.py --steps 100000          # until so many corrupted steps were made
    python studies/fuzz_step.py --steps 100000 --go-on  # so many more, added to the last result
    python studies/fuzz_step.py --replay 4711           # one episode alone, in this process
    python studies/fuzz_step.py --episodes 4 --plain    # without compilation: what would be undefined raises
"""

import json
import sys
from pathlib import Path
from typing import Any

from bench import results
from fuzz import workers
from fuzz.episode import TICKS, run

COUNTED = ("steps", "corrupted", "mistakes", "crashed")
TABLES = {"statuses": "Statuses", "done": "Calls", "damages": "Damage by channel and kind"}
LIMITATIONS = (
    "The arm of an episode does exactly what the planner's reference says; a joint that swings falls as the "
    "model has it. What physics makes of commands is the matter of `ftqp campaign physics`.",
    "Limits are judged where the planner promises them: with the bounds `viability`, and of a joint that a "
    "reset, or a failure before it was mended, has put outside, from when it is inside again.",
    "OK is held against forward kinematics eight times an episode, where samples are not late and no tool "
    "was changed.",
)


def fuzzed(given: Any, total: dict[str, Any], path: Path) -> None:
    """Run episodes until enough were made, and keep the growing counters in a file all the time."""
    most = given.episodes if given.steps is None else 10**9
    wanted = None if given.steps is None else total["corrupted"] + given.steps
    end = given.first + total["episodes"] + most
    coming = workers.episodes(__file__, given, total, end, plain=given.plain)
    for _ in coming:
        if total["episodes"] % 20 == 0:
            path.write_text(json.dumps(total), encoding="utf-8")
        if wanted is not None and total["corrupted"] >= wanted:
            break
    coming.close()


def markdown(result: dict[str, Any]) -> str:
    """The report."""
    total = result["total"]
    inputs = "corrupted steps: numbers or form of an input, or a call just before"
    rows = {
        "episodes": total["episodes"],
        "steps": total["steps"],
        inputs: total["corrupted"],
        "mistakes of `step` in between, to be refused": total["mistakes"],
        "calls around a step": sum(total["done"].values()),
        "crashes or hangs of the process": total["crashed"],
        "episodes that broke a promise": total["failing"],
    }
    told = {what: f"{count:,}" for what, count in rows.items()}
    return workers.report("Corrupted steps", result, told, TABLES)


def main() -> int:
    """Fuzzes, prints, writes; 0 when every promise was kept, 1 when not, 2 for bad input, 130 for Ctrl-C."""
    parser = workers.parser(__doc__, "fuzz_step", TICKS)
    add = parser.add_argument
    add("--episodes", type=int, default=100, help="how many there are")
    add("--steps", type=int, help="corrupted steps to be made, in the place of --episodes")
    add("--go-on", action="store_true", help="add to the last result in --out of the same seed")
    add("--plain", action="store_true", help="without compilation, which is slow")
    given = parser.parse_args()
    if (code := workers.run_here(given, run)) is not None:
        return code
    total, kept = workers.nothing(COUNTED, TABLES), given.out / "fuzz-counters.json"
    settings = {"seed": given.seed, "ticks": given.ticks, "plain": given.plain}
    if given.go_on and kept.exists():
        total = json.loads(kept.read_text(encoding="utf-8"))
    try:
        given.out.mkdir(parents=True, exist_ok=True)
        fuzzed(given, total, kept)
    except KeyboardInterrupt:
        sys.stderr.write("interrupted; --go-on takes it up again\n")
        return 130
    kept.write_text(json.dumps(total), encoding="utf-8")
    result = results.circumstances("fuzz_step", (), settings) | {
        "total": total,
        "limitations": list(LIMITATIONS),
    }
    code = results.told(result, markdown(result), given.out, "fuzz", as_json=given.json)
    return code or (1 if total["failing"] else 0)


if __name__ == "__main__":
    sys.exit(main())
