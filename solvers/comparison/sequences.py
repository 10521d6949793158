"""The recorded sequences of ``solvers/problems``: consecutive QPs of ftqp's planner, by name."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ftqp.core.checks import BoolArray
from ftqp.core.errors import InputError, unknown
from ftqp.qp.recording.recorded_qps import Recording

FOLDER = Path(__file__).resolve().parents[1] / "problems"
QUICK = 12
"""QPs of each sequence in a quick run: the first ones, still consecutive."""


def sequences(
    wanted: Iterable[str] | None = None, quick: bool = False, *, folder: Path = FOLDER
) -> dict[str, Recording]:
    """Sequences by name.

    Args:
        wanted: Which; None is all.
        quick: Cut each to its first QPs.
        folder: Where the ``.npz`` files are.
    """
    known = sorted(file.stem for file in folder.glob("*.npz"))
    if not known:
        raise InputError(f"{folder} holds no .npz file; run solvers/problems/record.py")
    chosen = known if wanted is None else list(wanted)
    for name in chosen:
        if name not in known:
            raise unknown("sequence", name, str(folder), known)
    loaded = {name: Recording.load(folder / f"{name}.npz") for name in chosen}
    return {name: found.part(0, QUICK) for name, found in loaded.items()} if quick else loaded


def feasible(recording: Recording) -> BoolArray:
    """Whether each QP of a sequence has a feasible point, (K,), as an LP solver found it."""
    infeasible = recording.metadata.get("infeasible_ticks")
    if not isinstance(infeasible, list):
        raise InputError("the recording does not say which QPs are feasible; see solvers/problems/README.md")
    return ~np.isin(recording.tick, infeasible)
