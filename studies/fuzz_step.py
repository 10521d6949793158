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
import os
import sys
from collections import Counter
from pathlib import Path
from typing import Any

from bench import command_line, results
from fuzz import workers
from fuzz.episode import TICKS, run

SEED = 14
COUNTED = ("steps", "corrupted", "mistakes", "crashed")
TABLES = ("done", "statuses", "damages")
KEPT = 40
"""So many findings are kept word by word."""
LIMITATIONS = (
    "The arm of an episode does exactly what the planner's reference says; a joint that swings falls as the "
    "model has it. What physics makes of commands is the matter of `ftqp campaign physics`.",
    "Limits are judged where the planner promises them: with the bounds `viability`, and of a joint that a "
    "reset, or a failure before it was mended, has put outside, from when it is inside again.",
    "OK is held against forward kinematics eight times an episode, where samples are not late and no tool "
    "was changed.",
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
        counter = Counter(total[name])
        counter.update(outcome.get(name, {}))
        total[name] = dict(counter)
    total["failing"] += bool(outcome["wrong"])
    if outcome["wrong"] and len(total["findings"]) < KEPT:
        total["findings"].append(
            {"number": outcome["number"], "sentence": outcome.get("sentence", ""), "wrong": outcome["wrong"]}
        )


def nothing() -> dict[str, Any]:
    """Counters before the first episode."""
    return {
        "episodes": 0,
        "failing": 0,
        "findings": [],
        **dict.fromkeys(COUNTED, 0),
        **{name: {} for name in TABLES},
    }


def fuzzed(given: Any, total: dict[str, Any], path: Path | None) -> None:
    """Run episodes until enough were made, and keep the counters in a file all the time.

    Args:
        given: The options.
        total: The counters, which grow.
        path: Where they are kept; None is nowhere.
    """
    paths = os.pathsep.join([str(Path(__file__).parent), *filter(None, [os.environ.get("PYTHONPATH")])])
    first = given.first + total["episodes"]
    most = given.episodes if given.steps is None else 10**9
    wanted = None if given.steps is None else total["corrupted"] + given.steps
    coming = workers.outcomes(given.seed, first, most, given.ticks, paths, given.plain)
    for outcome in coming:
        added(total, outcome)
        for sentence in outcome["wrong"]:
            sys.stderr.write(f"{outcome['number']}: {sentence[:300]}\n")
        if path is not None and total["episodes"] % 20 == 0:
            path.write_text(json.dumps(total), encoding="utf-8")
        if wanted is not None and total["corrupted"] >= wanted:
            break
    coming.close()


def markdown(result: dict[str, Any]) -> str:
    """The report."""
    total = result["total"]
    lines = [
        *results.preamble("Corrupted steps", result),
        "| what | how often |",
        "|---|---:|",
        f"| episodes | {total['episodes']:,} |",
        f"| steps | {total['steps']:,} |",
        f"| corrupted steps: numbers or form of an input, or a call just before | {total['corrupted']:,} |",
        f"| mistakes of `step` in between, to be refused | {total['mistakes']:,} |",
        f"| calls around a step | {sum(total['done'].values()):,} |",
        f"| crashes or hangs of the process | {total['crashed']:,} |",
        f"| episodes that broke a promise | {total['failing']:,} |",
        "",
        "## What was found",
        "",
        *(
            f"- {found['number']} ({found['sentence']}): {'; '.join(found['wrong'])[:400]}"
            for found in total["findings"]
        ),
        *(["Nothing."] if not total["findings"] else []),
        "",
        *_table("Statuses", total["statuses"]),
        *_table("Calls", total["done"]),
        *_table("Damage by channel and kind", total["damages"]),
        *results.appendix(result),
    ]
    return "\n".join(lines)


def _table(title: str, counts: dict[str, int]) -> list[str]:
    rows = [f"| {name} | {count:,} |" for name, count in sorted(counts.items(), key=lambda pair: -pair[1])]
    return [f"## {title}", "", "| what | how often |", "|---|---:|", *rows, ""]


def main() -> int:
    """Fuzzes, prints, writes; 0 when every promise was kept, 1 when not, 2 for bad input, 130 for Ctrl-C."""
    parser = command_line.parser(__doc__)
    add = parser.add_argument
    add("--seed", type=int, default=SEED, help="draws everything")
    add("--first", type=int, default=0, help="number of the first episode")
    add("--episodes", type=int, default=100, help="how many there are")
    add("--steps", type=int, help="corrupted steps to be made, in the place of --episodes")
    add("--ticks", type=int, default=TICKS, help="how long an episode is")
    add("--replay", type=int, metavar="NUMBER", help="run one episode in this process and say what was wrong")
    add("--go-on", action="store_true", help="add to the last result in --out of the same seed")
    add("--plain", action="store_true", help="without compilation, which is slow")
    results.add_out(parser, "fuzz_step")
    add("--json", action="store_true", help="print one JSON object and nothing else")
    add("--worker", action="store_true", help="for the script itself")
    given = parser.parse_args()
    if given.worker:
        workers.work(given.seed, given.first, given.episodes, given.ticks)
        return 0
    if given.replay is not None:
        outcome = run(given.seed, given.replay, ticks=given.ticks)
        sys.stdout.write("\n".join([outcome.sentence, *outcome.wrong, ""]))
        return 1 if outcome.wrong else 0
    total, kept = nothing(), given.out / "fuzz-counters.json"
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
        "left_out": {},
        "limitations": list(LIMITATIONS),
    }
    code = results.told(result, markdown(result), given.out, "fuzz", as_json=given.json)
    return code or (1 if total["failing"] else 0)


if __name__ == "__main__":
    sys.exit(main())
