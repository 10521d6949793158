"""Resident memory of ftqp, stage by stage: the import, a robot, a first planner, a further one.

    python benchmarks/bench_memory.py          each stage of five new processes, medians
    python benchmarks/bench_memory.py --json   one JSON object on stdout, nothing else

The arm is a Panda, and every planner makes a step. The compiled kernel is on disk before.
"""

import json
import statistics
import subprocess
import sys
from itertools import pairwise

from bench import docs
from bench.tables import Table, quantity

LEVELS = ("velocity", "acceleration")
AT_MOST = 150.0
"""What a first planner shall add at most [MiB]."""
FURTHER = 10
"""Further planners, of which the mean counts."""
STAGES = {
    "start": "Python",
    "import": "`import ftqp`",
    "robot": "a robot",
    "first": "a first planner and its first step",
    "further": "a further planner and its first step",
}
LIMITATIONS = (
    "Resident memory is what the system counts for the process, pages shared with others included.",
    "Where there is no /proc, it is the largest so far.",
)

CHILD = """
import json, sys

def resident():
    try:
        with open("/proc/self/status") as file:
            return next(int(line.split()[1]) for line in file if line.startswith("VmRSS")) / 1024
    except FileNotFoundError:
        import resource
        unit = 2**20 if sys.platform == "darwin" else 2**10
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit

def planned():
    planner = ftqp.Planner(robot, dt=0.001, level=sys.argv[1])
    planner.reset(q)
    planner.step(q, 0.0 * q, ftqp.Target(robot.pose(q)))
    return planner

at = [resident()]
import ftqp
at.append(resident())
robot = ftqp.robots.load("panda")
q = robot.neutral.copy()
at.append(resident())
planners = [planned()]
at.append(resident())
planners += [planned() for _ in range(int(sys.argv[2]))]
at.append(resident())
print(json.dumps({"resident": at, "loaded": [name for name in ("numba", "llvmlite") if name in sys.modules]}))
"""


def measured(level: str, runs: int) -> dict[str, object]:
    """What each stage adds at a level [MiB], medians over new processes, and what was loaded."""
    found = []
    for _ in range(runs + 1):  # the first compiles, or loads from disk what others share then
        done = subprocess.run(
            [sys.executable, "-c", CHILD, level, str(FURTHER)], capture_output=True, text=True, check=False
        )
        if done.returncode != 0:
            raise SystemExit(f"a planner at the {level} level could not be made: {done.stderr[-2000:]}")
        found.append(json.loads(done.stdout))
    del found[0]
    added = []
    for one in found:
        at = one["resident"]
        steps = [at[0], *(after - before for before, after in pairwise(at))]
        added.append([*steps[:-1], steps[-1] / FURTHER])
    stages = {
        name: statistics.median(values) for name, values in zip(STAGES, zip(*added, strict=True), strict=True)
    }
    total = statistics.median(one["resident"][3] for one in found)
    return {"level": level, "added": stages, "one_planner": total, "loaded": found[-1]["loaded"]}


def main() -> int:
    """Measure both levels, print, write; 0 when done, 2 for bad input."""
    options = docs.asked(__doc__, runs=(5, "processes a level"))
    rows = [measured(level, options.runs) for level in LEVELS]
    result = docs.measured(
        "bench_memory",
        {"runs": options.runs, "further": FURTHER},
        rows,
        LIMITATIONS,
        first_planner_at_most=AT_MOST,
    )
    lines = [
        (
            title,
            *(quantity(row["added"][stage]) for row in rows),
            f"{AT_MOST:.0f}" if stage == "first" else "",
        )
        for stage, title in STAGES.items()
    ]
    lines.append(("a process with one planner", *(quantity(row["one_planner"]) for row in rows), ""))
    lines.append(("loaded of numba and llvmlite", *(", ".join(row["loaded"]) or "none" for row in rows), ""))
    headings = ("", *LEVELS, "at most")
    docs.publish(
        result, "Memory", [Table(title="Resident memory [MiB]", headings=headings, rows=lines)], options
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
