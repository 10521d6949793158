"""Records the sequences of this folder anew, by ftqp's own planner.

    python solvers/problems/record.py
    python solvers/problems/record.py --quick --out /path/to/a/folder

It replaces the ``.npz`` files of the folder and, beside a README.md, the table in it. No clock and no random
number takes part: the same versions on the same machine give the same files.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from comparison.making import Recipe, made  # noqa: E402  the bench is no package
from comparison.recipes import RECIPES  # noqa: E402

from ftqp.qp import Recording  # noqa: E402

QUICK = 5
"""QPs of each sequence in a quick run."""
BEGIN, END = "<!-- sequences: written by record.py -->\n", "<!-- end of sequences -->\n"


def save(recipe: Recipe, folder: Path, *, quick: bool) -> Recording:
    """Record one sequence into ``folder``, in place of what is there."""
    recording = made(recipe, count=QUICK if quick else None)
    file = folder / f"{recipe.name}.npz"
    fresh = folder / f"{recipe.name}-fresh.npz"
    fresh.unlink(missing_ok=True)
    recording.save(fresh)
    fresh.replace(file)
    return recording


def row(name: str, recording: Recording) -> str:
    """A line of the README's table."""
    about = recording.metadata
    n, m, p = recording.g.shape[1], recording.b.shape[1], recording.l.shape[1]
    infeasible, unresolved = len(about["infeasible_ticks"]), len(about["unresolved_ticks"])
    facts = (
        f"`{name}`",
        about["what"],
        f"{about['scheme']}, {about['level']}, {about['task_mode']}",
        f"{len(recording)}",
        f"{n}, {m}, {p}",
        f"{infeasible or ''}",
        f"{len(about['hard_infeasible_ticks']) or ''}",
        f"{active_bounds(recording):.1f}",
        f"{condition(recording):.0e}",
        f"{unresolved or ''}",
    )
    return f"| {' | '.join(facts)} |\n"


def active_bounds(recording: Recording) -> float:
    """Mean number of bounds and rows with a multiplier, fixed variables left out, over the solved QPs."""
    z = np.hstack([recording.z_box, recording.z])
    low, high = np.hstack([recording.lb, recording.l]), np.hstack([recording.ub, recording.u])
    largest = np.abs(z).max(axis=1, keepdims=True)
    active = (np.abs(z) > 1e-9 * largest) & (low < high)
    solved = np.isfinite(recording.x).all(axis=1)
    return float(active[solved].sum(axis=1).mean()) if solved.any() else 0.0


def condition(recording: Recording) -> float:
    """Largest condition number of H over the joints and the path scale."""
    keep = [i for i, name in enumerate(recording.variables) if not name.startswith("slack ")]
    return float(max(np.linalg.cond(H[np.ix_(keep, keep)]) for H in recording.H))


HEAD = (
    "| sequence | what | scheme, level, mode | QPs | n, m, p | infeasible | infeasible if hard | active | "
    "cond H | unresolved |\n|---|---|---|---:|---|---:|---:|---:|---:|---:|\n"
)


def main() -> None:
    """Record what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--quick", action="store_true", help=f"{QUICK} QPs of each sequence")
    parser.add_argument("--out", type=Path, default=HERE, help="folder for the files; this one if left out")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="these sequences; no table is written")
    arguments = parser.parse_args()
    known = {recipe.name: recipe for recipe in RECIPES}
    for name in arguments.only or ():
        if name not in known:
            parser.error(f"{name!r} is not a sequence; there are {', '.join(known)}")
    if arguments.quick and arguments.out.resolve() == HERE:
        parser.error("--quick would cut the recorded sequences short; name another folder by --out")
    arguments.out.mkdir(parents=True, exist_ok=True)
    lines = []
    for name in arguments.only or known:
        recording = save(known[name], arguments.out, quick=arguments.quick)
        lines.append(row(name, recording))
        sys.stdout.write(lines[-1])
        sys.stdout.flush()
    readme = arguments.out / "README.md"
    if not arguments.only and readme.is_file():
        before, rest = readme.read_text(encoding="utf-8").split(BEGIN)
        after = rest.split(END)[1]
        readme.write_text(f"{before}{BEGIN}{HEAD}{''.join(lines)}{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
