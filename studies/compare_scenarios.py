"""Every number that every bundled scenario logs, in this checkout and in an earlier commit.

    python studies/compare_scenarios.py --against HEAD~1         all of them
    python studies/compare_scenarios.py --against v0 --names panda-circle,planar6-square

Each checkout runs its scenarios in a process of its own. What differs by more than 1e-12 (of a number above
1: by more than this share of it) is an error. A scenario that needs a package which is not installed is left
out, and said.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from bench import command_line, results

from ftqp.core.errors import InputError

ROOT = Path(__file__).resolve().parents[1]
SCENARIOS = Path("src/ftqp/app/scenarios")
LARGEST = 1e-12
"""Two runs that agree differ by no more than this, or this share of a number above 1."""
CLOCK = ("step_time",)
"""Signals that a clock measures, which no two runs have in common."""
WORKER = """
import json, sys
from pathlib import Path
import numpy as np
import ftqp
from ftqp.app.run import runs
out, left_out = Path(sys.argv[1]), {}
for name in sys.argv[2:]:
    try:
        setup = ftqp.load_scenario(name)
    except ftqp.MissingPackage as error:
        left_out[name] = str(error)
        continue
    runs.run(setup, out / name, drawn=False)
    log = ftqp.load_log(out / name)
    np.savez(out / (name + ".npz"), **{signal: log[signal] for signal in log.names})
(out / "left_out.json").write_text(json.dumps(left_out))
"""


def scenarios_of(tree: Path) -> set[str]:
    """Names of the scenarios that a checkout bundles."""
    return {path.stem for path in (tree / SCENARIOS).glob("*.toml")}


def run_all(tree: Path, names: list[str], out: Path) -> subprocess.Popen[str]:
    """A process that runs scenarios of a checkout and leaves an archive of each log."""
    out.mkdir()
    command = [sys.executable, "-c", WORKER, str(out), *names]
    environment = {**os.environ, "PYTHONPATH": str(tree / "src")}
    return subprocess.Popen(command, cwd=out, env=environment, stderr=subprocess.PIPE, text=True)


def difference(ours: Any, theirs: Any) -> float:
    """The largest difference of signals: of numbers above 1 as a share; inf where only one is a number."""
    if ours.shape != theirs.shape:
        return float("inf")
    with np.errstate(invalid="ignore"):
        apart = np.abs(ours - theirs) / np.maximum(1.0, np.maximum(np.abs(ours), np.abs(theirs)))
    same = (ours == theirs) | (np.isnan(ours) & np.isnan(theirs))
    apart = np.where(same, 0.0, np.where(np.isfinite(apart), apart, np.inf))
    return float(apart.max(initial=0.0))


def compared(name: str, ours: Any, theirs: Any) -> dict[str, Any]:
    """What differs between two logs of a scenario."""
    common = [signal for signal in ours if signal in theirs and signal not in CLOCK]
    apart = {signal: difference(np.asarray(ours[signal], float), np.asarray(theirs[signal], float))
             for signal in common}  # fmt: skip
    worst = max(common, key=lambda signal: apart[signal], default="t")
    rows = np.asarray(ours["t"]).shape[0]
    return {
        "scenario": name,
        "signals": len(common),
        "rows": rows,
        "only_in_one": sorted(set(ours) ^ set(theirs)),
        "worst": worst,
        "difference": apart.get(worst, 0.0),
        "differing": sorted(signal for signal in common if apart[signal] > LARGEST),
    }


def table(found: list[dict[str, Any]], left_out: dict[str, str]) -> str:
    """The rows that are printed."""
    lines = [f"{'scenario':32}{'signals':>8}{'ticks':>9}{'largest difference':>20}  of"]
    for one in found:
        worst = one["worst"] if one["difference"] > 0.0 else ""
        lines.append(
            f"{one['scenario']:32}{one['signals']:8}{one['rows']:9,}{one['difference']:20.3g}  {worst}"
        )
        if one["only_in_one"]:
            lines.append(f"    in one of the logs only: {', '.join(one['only_in_one'])}")
    return "\n".join([*lines, *(f"{name:32} left out: {why}" for name, why in left_out.items())])


def measured(other: Path, given: argparse.Namespace) -> tuple[list[dict[str, Any]], dict[str, str]]:
    """Run the scenarios of both checkouts: what differs of each, and which were left out, with the reason."""
    names = scenarios_of(ROOT)
    left_out = dict.fromkeys(sorted(names ^ scenarios_of(other)), "bundled by one of the commits only")
    names -= set(left_out)
    if given.names:
        if strange := set(given.names.split(",")) - names:
            raise SystemExit(f"--names has {', '.join(sorted(strange))}, expected some of {sorted(names)}")
        names = set(given.names.split(","))
    with tempfile.TemporaryDirectory() as folder:
        places = [Path(folder) / "ours", Path(folder) / "theirs"]
        for tree, place in zip((ROOT, other), places, strict=True):
            process = run_all(tree, sorted(names), place)
            _, said = process.communicate()
            if process.returncode != 0:
                raise SystemExit(f"scenarios of {tree} cannot be run: {said.strip()[-2000:]}")
            left_out |= json.loads((place / "left_out.json").read_text(encoding="utf-8"))
        found = []
        for name in sorted(names - set(left_out)):
            with np.load(places[0] / f"{name}.npz") as ours, np.load(places[1] / f"{name}.npz") as theirs:
                found.append(compared(name, dict(ours), dict(theirs)))
    return found, left_out


def main() -> int:
    """Runs both, prints a table: 0 where all agree, 1 where something differs, 2 where there is no commit."""
    parser = command_line.parser(__doc__)
    parser.add_argument("--against", required=True, metavar="COMMIT", help="the earlier commit")
    parser.add_argument("--names", metavar="A,B,...", help="only these scenarios")
    parser.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    given = parser.parse_args()
    try:
        with results.checkout(given.against) as other:
            found, left_out = measured(other, given)
    except InputError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    differs = [one for one in found if one["differing"]]
    if given.json:
        sys.stdout.write(
            json.dumps({"against": given.against, "scenarios": found, "left_out": left_out}) + "\n"
        )
    else:
        sys.stdout.write(table(found, left_out) + "\n")
    return 1 if differs else 0


if __name__ == "__main__":
    sys.exit(main())
