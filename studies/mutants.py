"""Which changes of the safety modules their tests notice: limits, faults, cascade, stop and samples.

A mutant is a module with one operator, comparison, number, condition or loop changed (the operators of
cosmic-ray that keep the types, ``studies/mutating/mutation.py``). A sample of them, drawn at random in each
module, takes the module's place one by one, and the tests of its group that reach the changed line run until
one fails. The score is the share of mutants that are found, a module weighted by how many mutants it has.

    python studies/mutants.py [GROUP...] [--count 6] [--seed 3] [--budget 4] [--keep DIR] [--json]

It needs ``pip install cosmic-ray coverage``. Groups: limits, faults, cascade, stop, samples. Everything runs
as plain Python (``studies/mutating/plain_python.py``) and each mutant in a process forked from one that has
imported and collected already: cosmic-ray's own runs start Python and import everything anew for each mutant,
some five seconds, and change the source of the kernel, by whose hash compiled code is kept. With ``--keep``
what was found of a group stays in that folder and is used again as long as modules and tests are what they
were. The exit code is 1 where the score is below 85 %.
"""

import hashlib
import importlib.util
import json
import os
import subprocess
import sys
import tempfile
from math import sqrt
from pathlib import Path
from typing import Any

from bench import command_line, results
from mutating.mutation_run import FOUND, JOB

ROOT = Path(__file__).resolve().parents[1]
PLANNER = "tests/control/planner"
GROUPS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "limits": (
        (
            "ftqp.kernel.rows.joint_intervals",
            "ftqp.kernel.judge.solution_check",
            "ftqp.control.task.bounds",
            "ftqp.control.planner.braking_reserve",
        ),
        (
            "tests/kernel/rows/test_joint_intervals.py",
            "tests/kernel/judge/test_solution_check.py",
            "tests/control/task/test_task.py",
            f"{PLANNER}/test_braking_reserve.py",
            "tests/robustness/test_stop_at_a_limit.py",
        ),
    ),
    "faults": (
        ("ftqp.kernel.rows.failed_joints", "ftqp.faults.belief", "ftqp.faults.kinds"),
        (
            "tests/kernel/rows/test_failed_joints.py",
            "tests/faults/test_belief.py",
            "tests/faults/test_kinds.py",
            f"{PLANNER}/test_planner_faults.py",
        ),
    ),
    "cascade": (
        (
            "ftqp.kernel.judge.fallback_cascade",
            "ftqp.kernel.judge.stage_problems",
            "ftqp.kernel.judge.solution_check",
        ),
        (
            "tests/kernel/judge",
            "tests/kernel/plain_python/test_least_excess.py",
            "tests/kernel/plain_python/test_stages_one_by_one.py",
            "tests/kernel/plain_python/test_brought_to_rest.py",
        ),
    ),
    "stop": (
        ("ftqp.kernel.judge.stage_problems", "ftqp.kernel.ticks.tick", "ftqp.control.task.task"),
        (
            "tests/kernel/judge/test_stage_problems.py",
            "tests/control/task/test_task.py",
            "tests/kernel/judge/test_fallback_cascade.py",
            "tests/kernel/plain_python/test_stages_one_by_one.py",
            "tests/kernel/plain_python/test_brought_to_rest.py",
            "tests/control/moving_base",
            f"{PLANNER}/test_planner_stop.py",
            f"{PLANNER}/test_planner_tasks.py",
        ),
    ),
    "samples": (
        (
            "ftqp.kernel.ticks.accepted_inputs",
            "ftqp.kernel.feedback.samples",
            "ftqp.kernel.feedback.error_band",
        ),
        (
            "tests/kernel/ticks/test_accepted_inputs.py",
            "tests/kernel/feedback",
            "tests/kernel/plain_python/test_accepted_inputs.py",
            "tests/kernel/plain_python/test_error_band.py",
        ),
    ),
}
"""By name: the modules, and the tests that are to notice changes of them."""
EQUIVALENT: dict[tuple[str, str], str] = {
    (
        "ftqp.kernel.rows.joint_intervals",
        "if bound < -1.0 and d >= 0.0:",
    ): "a short cut: what follows gives the same bound, as braking_velocity(d) >= 0 > bound",
    (
        "ftqp.kernel.judge.solution_check",
        "beyond = (q < several(limits.q_min, at) + OUTSIDE_FROM) | (",
    ): "asks for the exact look, joint by joint, more often",
    (
        "ftqp.kernel.judge.solution_check",
        "worst, min(abs(z), qp.ub[i] - qp.x[i]) if z >= 0.0 else min(abs(z), qp.x[i] - qp.lb[i])",
    ): "z is not 0 there",
    (
        "ftqp.kernel.feedback.samples",
        "feedback.known_failed[i] = 0 if K.faults.code[i] == HEALTHY else 2",
    ): "a flag that is read as zero or not",
    ("ftqp.kernel.feedback.error_band", "feedback.asks[i] = 2"): "a flag that is read as zero or not",
    ("ftqp.faults.kinds", "@dataclass(frozen=True, slots=False)"): "takes more memory, and is frozen as well",
}
"""By module and changed line: why a mutant does what the module does, so that it is not counted."""
REACH = 85.0
"""How many of a hundred mutants shall be found."""
NORMAL = 1.96
"""Standard deviations on either side of a 95 % interval."""
LIMITATIONS = (
    "Tests were written after what seeds 1 and 2 had shown; the score is that of another sample.",
    "Mutants run as plain Python, so only tests that are quick there take part.",
    "A mutant that does what the module does (an equivalent one) counts as not found unless it is listed.",
)


def key_of(group: str, settings: dict[str, Any]) -> str:
    """What was found of a group belongs to this hash of its modules, its tests and the settings."""
    modules, tests = GROUPS[group]
    digest = hashlib.sha256(json.dumps([modules, tests, settings]).encode())
    sources = [ROOT / "src" / f"{module.replace('.', '/')}.py" for module in modules]
    for place in (*sources, *(ROOT / test for test in tests)):
        for file in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
            digest.update(file.read_bytes() if file.is_file() else b"")
    return digest.hexdigest()[:16]


def run(
    group: str, settings: dict[str, Any], seconds: float, folder: Path
) -> tuple[dict[str, Any], list[Any]]:
    """What the tests of a group are like without a mutant, and a row a mutant."""
    modules, tests = GROUPS[group]
    out = folder / f"{group}.{key_of(group, settings | {'seconds': seconds})}.jsonl"
    if not out.is_file():
        job, unfinished = folder / f"{group}.json", folder / f"{group}.unfinished"
        told = {"modules": modules, **settings, "out": str(unfinished)}
        job.write_text(json.dumps(told), encoding="utf-8")
        path = os.pathsep.join([str(ROOT / "src"), str(ROOT / "studies"), os.environ.get("PYTHONPATH", "")])
        plain = {"NUMBA_DISABLE_JIT": "1", "FTQP_PLAIN_SECONDS": f"{seconds:g}", "PYTHONPATH": path}
        threads = {name: "1" for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")}
        done = subprocess.run(
            [
                sys.executable, "-m", "pytest", "-p", "mutating.plain_python", "-p", "mutating.mutation_run",
                "-q", "-s", "-p", "no:cacheprovider", "-W", "ignore::RuntimeWarning", "-m", "not slow",
                *(test for test in tests if (ROOT / test).exists()),
            ],
            cwd=ROOT, env={**os.environ, **plain, **threads, JOB: str(job)}, stdout=subprocess.DEVNULL,
            check=False,
        )  # fmt: skip
        if done.returncode != 0 or not unfinished.is_file():
            raise SystemExit(f"the tests of {group} could not run: pytest ended with {done.returncode}")
        unfinished.rename(out)
    first, *rows = [json.loads(line) for line in out.read_text(encoding="utf-8").splitlines()]
    return first, rows


def reason(row: dict[str, Any]) -> str:
    """Why a mutant that was not found is equivalent; nothing for one that is not known to be."""
    return "" if row["outcome"] == FOUND else EQUIVALENT.get((row["module"], row["after"].strip()), "")


def wilson(found: int, count: int) -> tuple[float, float]:
    """The 95 % interval of a share (Wilson), in per cent."""
    share, z = found / count, NORMAL * NORMAL / count
    centre, half = share + 0.5 * z, NORMAL * sqrt(share * (1.0 - share) / count + 0.25 * z / count)
    return 100.0 * (centre - half) / (1.0 + z), 100.0 * (centre + half) / (1.0 + z)


def scores(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """A row a module: mutants, those tried, those found, and the interval of the share."""
    told = []
    for module in dict.fromkeys(row["module"] for row in rows):
        own = [row for row in rows if row["module"] == module]
        found = sum(row["outcome"] == FOUND for row in own)
        low, high = wilson(found, len(own))
        told.append(
            {
                "module": module,
                "of": own[0]["of"],
                "tried": len(own),
                "found": found,
                "low": low,
                "high": high,
            }
        )
    return told


def whole(modules: list[dict[str, Any]]) -> tuple[float, float, float]:
    """The share of all mutants that would be found, with its 95 % interval, in per cent.

    sum_m N_m p_m / N of a stratified sample; its variance is sum_m (N_m/N)^2 p_m (1 - p_m)/(n_m - 1)
    (1 - n_m/N_m), with p_m of one mutant more found and one more missed, so that no module counts as certain.
    """
    every = sum(row["of"] for row in modules)
    score = sum(row["of"] * row["found"] / row["tried"] for row in modules) / every
    variance = 0.0
    for row in modules:
        p = (row["found"] + 1.0) / (row["tried"] + 2.0)
        left = 1.0 - row["tried"] / row["of"]
        variance += (row["of"] / every) ** 2 * p * (1.0 - p) / max(row["tried"] - 1.0, 1.0) * left
    half = NORMAL * sqrt(variance)
    return 100.0 * score, 100.0 * max(score - half, 0.0), 100.0 * min(score + half, 1.0)


def markdown(result: dict[str, Any]) -> str:
    """The tables for a reader."""
    score, low, high = result["score"]
    strict = result["strict"][0]
    lines = [
        *results.preamble("Mutants of the safety modules", result),
        f"{score:.1f} % of the mutants are found (95 % interval {low:.1f} to {high:.1f} %; reach: "
        f"{REACH:g} %); {strict:.1f} % where those that are listed as equivalent count as not found.",
        "",
        "| module | mutants | tried | found | % (95 % interval) |",
        "|---|---:|---:|---:|---|",
    ]
    for row in result["modules"]:
        share = 100.0 * row["found"] / row["tried"]
        lines.append(
            f"| {row['module'].removeprefix('ftqp.')} | {row['of']} | {row['tried']} | {row['found']} "
            f"| {share:.0f} ({row['low']:.0f} to {row['high']:.0f}) |"
        )
    lines += ["", "## Not found", "", "| where | was | became | tests |", "|---|---|---|---:|"]
    for row in result["rows"]:
        if row["outcome"] != FOUND and not reason(row):
            was, became = (f"`{row[key]}`".replace("|", "\\|") for key in ("before", "after"))
            where = f"{row['module'].rsplit('.', 1)[1]}:{row['line']}"
            lines.append(f"| {where} | {was} | {became} | {row['tests']} |")
    lines += ["", "## Equivalent, not counted", "", "| where | became | why |", "|---|---|---|"]
    for row in result["rows"]:
        if reason(row):
            where, became = (
                f"{row['module'].rsplit('.', 1)[1]}:{row['line']}",
                row["after"].replace("|", "\\|"),
            )
            lines.append(f"| {where} | `{became}` | {reason(row)} |")
    lines += ["", "## Tests", "", "| group | tests | CPU seconds | left out |", "|---|---:|---:|---:|"]
    for group, told in result["groups"].items():
        lines.append(f"| {group} | {told['tests']} | {told['seconds']:.0f} | {told['left_out']} |")
    return "\n".join([*lines, "", *results.appendix(result)])


def main() -> int:
    """Tries, prints, writes; 1 below the reach, 2 for bad input."""
    parser = command_line.parser(__doc__)
    parser.add_argument("groups", nargs="*", metavar="GROUP", help="all if left out")
    parser.add_argument("--count", type=int, default=6, help="mutants of each module, at most")
    parser.add_argument("--seed", type=int, default=3, help="of the sample")
    parser.add_argument("--budget", type=float, default=4.0, help="CPU seconds of tests for a mutant")
    parser.add_argument("--seconds", type=float, default=1.0, help="CPU seconds of a test")
    parser.add_argument("--keep", type=Path, help="folder of what was found, used again")
    results.add_out(parser, "mutants")
    parser.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    given = parser.parse_args()
    for package in ("cosmic_ray", "coverage"):
        if importlib.util.find_spec(package) is None:
            parser.error(f"{package} is not installed; pip install cosmic-ray coverage")
    unknown = sorted(set(given.groups) - set(GROUPS))
    if unknown:
        parser.error(f"{unknown[0]!r} is not a group of modules; there are {', '.join(GROUPS)}")
    if given.count < 1:
        parser.error(f"--count is {given.count}, expected a whole number >= 1")
    groups, rows = {}, []
    told = {"count": given.count, "seed": given.seed, "budget": given.budget}
    with tempfile.TemporaryDirectory() as temporary:
        folder = (given.keep or Path(temporary)).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        for group in given.groups or GROUPS:
            groups[group], found = run(group, told, given.seconds, folder)
            rows += found
    modules = scores([row for row in rows if not reason(row)])
    settings = {"mutants a module": given.count, "seed": given.seed, "budget": given.budget}
    result = results.circumstances("mutants", (), settings)
    result |= {
        "score": whole(modules),
        "strict": whole(scores(rows)),
        "modules": modules,
        "rows": rows,
        "groups": groups,
    }
    result |= {"left_out": {name: "not asked for" for name in GROUPS if name not in groups}}
    result |= {"limitations": list(LIMITATIONS)}
    stem = results.stem("mutants", name=None, quick=bool(given.groups))
    wrong = results.told(result, markdown(result), given.out, stem, as_json=given.json)
    return wrong or int(whole(modules)[0] < REACH)


if __name__ == "__main__":
    sys.exit(main())
