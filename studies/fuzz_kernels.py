"""Damages the built kernel, and looks at what a process makes of it.

A trial copies the built library with its manifest and damages one of the two: missing and flipped bytes, lost
pages, another hash, another owner, other permissions, a link. A process then makes a planner and steps it. It
has to leave the library alone, to say so in a sentence, and to command the same by plain Python.

    python studies/fuzz_kernels.py --trials 200
    python studies/fuzz_kernels.py --first 17 --trials 1    # one of them again
"""

import sys
import tempfile
from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from bench import command_line, results
from fuzz import kernels

SEED = 14
LIMITATIONS = (
    "Six ticks are compared, to 1e-9 where plain Python does them.",
    "Another owner is tried only where the script may give files away, as root.",
    "A manifest that still says the same of the library may be damaged elsewhere.",
)


def tried(seed: int, first: int, count: int) -> list[kernels.Found]:
    """Damage so many copies."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        good = kernels.prepared(Path(folder))
        for number in range(first, first + count):
            with tempfile.TemporaryDirectory(dir=folder) as place:
                rng = np.random.default_rng([seed, number])
                found.append(kernels.trial(number, good, rng, Path(place)))
            for sentence in found[-1].wrong:
                sys.stderr.write(f"{number}: {found[-1].what}: {sentence}\n")
    return found


def markdown(result: dict[str, Any]) -> str:
    """The report."""
    found = result["found"]
    kinds = Counter(one["what"] for one in found)
    refused = Counter(one["what"] for one in found if one["refused"])
    said = Counter(one["what"] for one in found if one["sentence"])
    failing = [one for one in found if one["wrong"]]
    lines = [
        *results.preamble("Damaged machine code", result),
        f"{len(found)} trials, {sum(refused.values())} files left alone, {sum(said.values())} of them with a "
        f"sentence; {len(failing)} broke a promise.",
        "",
        "| what was damaged, and how | trials | left alone | with a sentence |",
        "|---|---:|---:|---:|",
        *(f"| {what} | {count} | {refused[what]} | {said[what]} |" for what, count in sorted(kinds.items())),
        "",
        "## What was found",
        "",
        *(f"- {one['number']} ({one['what']}): {'; '.join(one['wrong'])[:400]}" for one in failing),
        *([] if failing else ["Nothing."]),
        "",
        *results.appendix(result),
    ]
    return "\n".join(lines)


def main() -> int:
    """Damages, prints, writes; 0: every promise was kept, 1: not, 2: bad input, 130: Ctrl-C."""
    parser = command_line.parser(__doc__)
    add = parser.add_argument
    add("--seed", type=int, default=SEED, help="draws everything")
    add("--first", type=int, default=0, help="number of the first trial")
    add("--trials", type=command_line.at_least_one, default=200, help="how many there are")
    results.add_out(parser, "fuzz_kernels")
    add("--json", action="store_true", help="print one JSON object and nothing else")
    given = parser.parse_args()
    try:
        found = [asdict(one) for one in tried(given.seed, given.first, given.trials)]
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        return 130
    except (OSError, RuntimeError) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    settings = {"seed": given.seed, "trials": given.trials}
    result = results.circumstances("fuzz_kernels", (), settings) | {
        "found": found,
        "limitations": list(LIMITATIONS),
    }
    code = results.told(result, markdown(result), given.out, "fuzz_kernels", as_json=given.json)
    return code or (1 if any(one["wrong"] for one in found) else 0)


if __name__ == "__main__":
    sys.exit(main())
