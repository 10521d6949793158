"""Which branches of the kernel the tests take, its source run as plain Python.

The tests of each part run in a process of their own under coverage.py, with nothing compiled
(``NUMBA_DISABLE_JIT=1``). A tick then takes some hundred times as long, so that each test may take
``--seconds`` of CPU time and is skipped beyond them, and runs with eight of its sets of parameters at most;
those of ``tests/kernel/plain_python``, which are made for it, run whole. Hypothesis tries four examples, and
the reserve of braking is made of six samples instead of 400 (``studies/mutating/plain_python.py``). A branch
counts as taken where any test took it.

    python studies/kernel_branches.py [PART...] [--seconds 0.8] [--keep DIR] [--quick] [--out DIR] [--json]

It needs ``pip install coverage``. A PART is a file or a folder of tests; all that reach the kernel if left
out, some 20 minutes on one core. With ``--keep`` what was measured of a part stays in that folder and is used
again as long as the kernel is what it was. The exit code is 1 below 95 %.
"""

import hashlib
import importlib.util
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from bench import command_line, results

ROOT = Path(__file__).resolve().parents[1]
KERNEL = ROOT / "src" / "ftqp" / "kernel"
PARTS = (
    "tests/kernel/plain_python", "tests/kernel/judge", "tests/kernel/rows", "tests/kernel/arm",
    "tests/kernel/maths", "tests/kernel/calm", "tests/kernel/active_set", "tests/kernel/closed_forms",
    "tests/kernel/feedback", "tests/kernel/free", "tests/kernel/ticks", "tests/kernel/detection",
    "tests/kernel/dtrnn", "tests/kernel/layout", "tests/kernel/entry", "tests/kernel/study",
    "tests/control/planner", "tests/control/task",
    "tests/control/drive", "tests/control/moving_base", "tests/control/following",
    "tests/control/test_rates.py", "tests/control/test_unresponsive.py", "tests/faults", "tests/laws",
    "tests/robustness", "tests/qp/dtrnn", "tests/analysis", "tests/control/batch", "tests/sim",
)  # fmt: skip
"""Tests that reach the kernel."""
WITH_SLOW = PARTS[0]
"""Of these the slow ones, too: they are made for plain Python, and are slow beside the others there only."""
QUICK = ("tests/kernel/rows", "tests/kernel/maths")
ELSEWHERE = {
    "compiled": "makes and loads machine code; plain Python does without it",
}
"""Rooms of the kernel that do not run as plain Python, and why."""
REACH = 95.0
"""How many of a hundred branches shall be taken."""
LIMITATIONS = (
    "A test that takes too long as plain Python takes part up to its time only.",
    "A branch that was taken need not have been looked at: that is what studies/mutants.py measures.",
    "Compiled code is not measured; tests/kernel/test_jit.py compares its commands with plain Python's.",
)


def key_of(part: str, seconds: float) -> str:
    """What was measured of a part belongs to this hash of the kernel, the part's name and the time."""
    digest = hashlib.sha256(f"{part} {seconds}".encode())
    for file in sorted(KERNEL.rglob("*.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def measured(part: str, seconds: float, folder: Path) -> tuple[Path, str]:
    """The data file of a part, and the last line that pytest said."""
    data = folder / f"{part.replace('/', '-')}.{key_of(part, seconds)}"
    said = data.with_suffix(data.suffix + ".txt")
    if not (data.is_file() and said.is_file()):
        settings = folder / "coverage.ini"
        settings.write_text(f"[run]\nbranch = true\nsource = {KERNEL}\n", encoding="utf-8")
        path = os.pathsep.join([str(ROOT / "src"), str(ROOT / "studies"), os.environ.get("PYTHONPATH", "")])
        plain = {"NUMBA_DISABLE_JIT": "1", "FTQP_PLAIN_SECONDS": f"{seconds:g}", "PYTHONPATH": path}
        marks = [] if part.startswith(WITH_SLOW) else ["-m", "not slow"]
        done = subprocess.run(
            [
                sys.executable, "-m", "coverage", "run", f"--rcfile={settings}", f"--data-file={data}",
                "-m", "pytest", "-p", "mutating.plain_python", "-p", "no:cacheprovider", "-q", "--no-header",
                "-W", "ignore::RuntimeWarning", *marks, part,
            ],
            cwd=ROOT, env={**os.environ, **plain}, capture_output=True, text=True, check=False,
        )  # fmt: skip
        lines = done.stdout.strip().splitlines() or [done.stderr.strip()[-300:]]
        said.write_text(done.stdout if done.stdout else done.stderr, encoding="utf-8")
        sys.stderr.write(f"{part}: {lines[-1]}\n")
    return data, (said.read_text(encoding="utf-8").strip().splitlines() or [""])[-1]


def branches(files: list[Path], folder: Path) -> list[dict[str, Any]]:
    """Branches and those taken, a row a file of the kernel, and the lines that were not left both ways."""
    combined, told = folder / "combined", folder / "branches.json"
    run = [sys.executable, "-m", "coverage"]
    settings = f"--rcfile={folder / 'coverage.ini'}"
    subprocess.run(
        [*run, "combine", "--keep", "--quiet", settings, f"--data-file={combined}", *map(str, files)],
        check=True,
    )
    subprocess.run(
        [*run, "json", "--quiet", settings, f"--data-file={combined}", "-o", str(told)], check=True, cwd=ROOT
    )
    rows = []
    for name, found in json.loads(told.read_text(encoding="utf-8"))["files"].items():
        file = (ROOT / name).resolve().relative_to(KERNEL).as_posix()
        summary = found["summary"]
        rows.append(
            {
                "file": file,
                "branches": summary["num_branches"],
                "taken": summary["covered_branches"],
                "missing": found["missing_branches"],
            }
        )
    return sorted(rows, key=lambda row: row["file"])


def share(rows: list[dict[str, Any]]) -> float:
    """How many of a hundred branches were taken."""
    every = sum(row["branches"] for row in rows)
    return 100.0 * sum(row["taken"] for row in rows) / every if every else 100.0


def markdown(result: dict[str, Any]) -> str:
    """The tables for a reader."""
    rows = result["rows"]
    lines = [
        *results.preamble("Branches of the kernel", result),
        f"{sum(row['taken'] for row in rows)} of {sum(row['branches'] for row in rows)} branches of the "
        f"kernel's formulas are taken: {share(rows):.1f} % (reach: {REACH:g} %).",
        "",
        "| room | branches | taken | % |",
        "|---|---:|---:|---:|",
    ]
    for room in sorted({row["file"].split("/")[0] for row in rows}):
        own = [row for row in rows if row["file"].split("/")[0] == room and row["branches"]]
        if own:
            every, taken = sum(row["branches"] for row in own), sum(row["taken"] for row in own)
            lines.append(f"| {room} | {every} | {taken} | {share(own):.1f} |")
    lines += ["", "Not taken, as line -> next line (0 or less: the function ends):", ""]
    lines += ["| file | branches | not taken | which |", "|---|---:|---:|---|"]
    for row in rows:
        if row["missing"]:
            which = ", ".join(f"{a} → {max(b, 0)}" for a, b in row["missing"])
            lines.append(f"| {row['file']} | {row['branches']} | {len(row['missing'])} | {which} |")
    lines += ["", "| part | pytest |", "|---|---|"]
    lines += [f"| {part} | {said.strip('= ')} |" for part, said in result["parts"].items()]
    lines += ["", "Not counted: " + "; ".join(f"`{room}` {why}" for room, why in ELSEWHERE.items()) + ".", ""]
    return "\n".join([*lines, *results.appendix(result)])


def main() -> int:
    """Measures, prints, writes; 1 below the reach, 2 for bad input."""
    parser = command_line.parser(__doc__)
    parser.add_argument("parts", nargs="*", metavar="PART", help="files or folders of tests")
    parser.add_argument("--seconds", type=float, default=0.8, help="CPU seconds that a test may take")
    parser.add_argument("--keep", type=Path, help="folder of what was measured, used again")
    parser.add_argument("--quick", action="store_true", help=f"only {' and '.join(QUICK)}")
    results.add_out(parser, "kernel_branches")
    parser.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    given = parser.parse_args()
    if importlib.util.find_spec("coverage") is None:
        parser.error("coverage is not installed; pip install coverage")
    parts = given.parts or [part for part in (QUICK if given.quick else PARTS) if (ROOT / part).exists()]
    unknown = [part for part in parts if not (ROOT / part).exists()]
    if unknown:
        parser.error(f"{unknown[0]!r} is not there, expected a file or folder of tests as tests/kernel/rows")
    with tempfile.TemporaryDirectory() as temporary:
        folder = (given.keep or Path(temporary)).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        told = {part: measured(part, given.seconds, folder) for part in parts}
        rows = branches([data for data, _ in told.values()], folder)
    rows = [row for row in rows if row["file"].split("/")[0] not in ELSEWHERE]
    settings = {"seconds": given.seconds, "hash of the kernel": key_of("", given.seconds)}
    result = results.circumstances("kernel_branches", (), settings)
    result |= {"rows": rows, "parts": {part: said for part, (_, said) in told.items()}, "share": share(rows)}
    result |= {"left_out": {}, "limitations": list(LIMITATIONS)}
    stem = results.stem("kernel_branches", name=None, quick=bool(given.parts) or given.quick)
    wrong = results.told(result, markdown(result), given.out, stem, as_json=given.json)
    return wrong or int(share(rows) < REACH)


if __name__ == "__main__":
    sys.exit(main())
