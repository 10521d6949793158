"""Which failures a motion survives as a study: a row for every pair of failure and instant."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, final

import numpy as np

from ftqp import __version__
from ftqp.analysis.survival.coverage import CoverageCase
from ftqp.analysis.survival.coverage_report import CoverageReport
from ftqp.analysis.survival.failure_instants import Pairs
from ftqp.analysis.survival.tolerable_joints import Bound
from ftqp.app.study.results_file import ResultsFile
from ftqp.app.study.runner import run_study
from ftqp.kernel.entry.continuation_study import Continuations
from ftqp.kernel.layout.enums import Survival

KIND, BOUND = "coverage", "coverage bound"
COLUMNS: Final = {
    "failure": "TEXT", "t": "REAL", "status": "TEXT", "last_sample": "INTEGER", "position": "REAL",
    "rotation": "REAL", "margin": "REAL", "hurry": "REAL", "clearance": "REAL",
}  # fmt: skip
BOUND_FOLDER: Final = "bound"


@final
@dataclass(frozen=True)
class PairWork:
    """Computes the rows of some of all pairs, a chunk by so many threads; None is one a core."""

    pairs: Pairs
    threads: int | None

    def __call__(self, items: Sequence[int]) -> list[tuple[Any, ...]]:
        """The rows of the pairs with these numbers."""
        pairs, found = self.pairs, self.pairs.runs(items, self.threads)
        joints, F = pairs.task.robot.joints, len(pairs.failures)
        names = ["+".join(joints[i] for i in failed) for failed in pairs.failures]
        values = zip(
            found.sample.tolist(), found.position.tolist(), found.rotation.tolist(), found.margin.tolist(),
            found.hurry.tolist(), found.clearance.tolist(), strict=True,
        )  # fmt: skip
        return [
            (
                names[item % F],
                float(pairs.task.t[pairs.samples[item // F]]),
                Survival(int(status)).name,
                *more,
            )
            for item, status, more in zip(items, found.status, values, strict=True)
        ]


@final
@dataclass(frozen=True)
class BoundWork:
    """Looks at any posture at some of all samples, a chunk by so many threads; None is one a core."""

    bound: Bound
    threads: int | None

    def __call__(self, items: Sequence[int]) -> list[tuple[Any, ...]]:
        """How many joints any posture can do without, at the samples with these numbers."""
        return [(int(count),) for count in self.bound.counts(items, self.threads)]


def report_of(
    case: CoverageCase,
    folder: Path,
    settings: Mapping[str, Any],
    *,
    name: str,
    jobs: int | None,
    dask: str | None,
) -> CoverageReport:
    """The report of a case, from its rows in a folder, those computed now that are missing."""
    pairs, bound = case.pairs, case.bound
    facts = {
        **settings, "path and robot": pairs.task.digest,
        "motion": hashlib.sha256(np.ascontiguousarray(pairs.q).tobytes()).hexdigest()[:32],
    }  # fmt: skip
    study = "\n".join(f"{key} = {value}" for key, value in facts.items())
    common: dict[str, Any] = {
        "key": hashlib.sha256(f"{__version__}\n{study}".encode()).hexdigest(),
        "about": {"study": study, "ftqp": __version__, "robot": pairs.task.robot.name},
        "onward": f"the same command with --out {folder} --resume",
    }
    threads = None if jobs is None and dask is None else 1
    share: dict[str, Any] = {"what": name, "jobs": 1 if jobs is None else jobs, "dask": dask}
    with ResultsFile(folder, kind=KIND, columns=COLUMNS, **common) as results:
        run_study(PairWork(pairs, threads), pairs.count, results, **share).refuse_gaps("items")
        found = _continuations(results.table())
    most = None
    if bound is not None:
        columns = {"joints": "INTEGER"}
        with ResultsFile(folder / BOUND_FOLDER, kind=BOUND, columns=columns, **common) as results:
            samples = BoundWork(bound, threads)
            run_study(samples, len(bound.samples), results, **share).refuse_gaps("items")
            most = np.array([row[1] for row in results.table()], dtype=np.int64)
    return case.report(found, most)


def _continuations(rows: Sequence[Sequence[Any]]) -> Continuations:
    """What became of all pairs, from their rows; what was no number is empty on file."""
    _, _, _, names, samples, *numbers = zip(*rows, strict=True)
    values = np.array(numbers, dtype=np.float64)  # which makes NaN of None
    status = np.array([Survival[name] for name in names], dtype=np.int64)
    position, rotation, margin, hurry, clearance = values
    return Continuations(
        status=status, sample=np.array(samples, dtype=np.int64), position=position, rotation=rotation,
        margin=margin, hurry=hurry, clearance=clearance,
    )  # fmt: skip
