"""The parts of a plan on file: each stage of the work has a results file, and goes on from what it holds."""

import hashlib
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Self, final

from ftqp import __version__
from ftqp.analysis.planning.plan_case import Portion
from ftqp.app.study.results_file import FILE_NAME, ResultsFile
from ftqp.app.study.runner import run_study

KIND = "plan"
COLUMNS = {"value": "TEXT"}
REMEDY = "plan into another file by -o, or remove that folder"


@final
class KeptPortions:
    """Keeps what is done of a plan in a folder, and has processes or a cluster do what can be shared.

    ``study`` tells the plan from every other one, a line for each fact: with another text, or another version
    of ftqp, what the folder holds is refused. ``told`` hears of what is done, of how much, and of what stage.
    """

    def __init__(
        self,
        folder: Path,
        study: str,
        *,
        jobs: int | None,
        dask: str | None,
        told: Callable[[int, int, str], None],
    ) -> None:
        self.folder, self._study, self._told = folder, study, told
        self._jobs, self._dask = jobs, dask
        self._open: dict[str, ResultsFile] = {}
        self._known: dict[str, dict[int, str]] = {}

    @property
    def keeps(self) -> bool:
        """That an interrupted plan is kept."""
        return True

    @property
    def threads(self) -> int | None:
        """One for each worker; all cores where this process is the only one."""
        return None if self._jobs is None and self._dask is None else 1

    def each(self, stage: str, work: Portion, count: int) -> Iterator[str]:
        """The texts of all items of a stage, in order, after those that are missing have been computed."""
        results, jobs = self._file(stage), 1 if self._jobs is None else self._jobs
        done = run_study(
            work, count, results, what=stage, jobs=jobs, dask=self._dask,
            heard=lambda done: self._told(round(done), count, stage),
        )  # fmt: skip
        done.refuse_gaps(f"parts of the stage {stage!r}")
        return iter([text for _, text in results.table()])

    def one(self, stage: str, item: int, work: Callable[[], str]) -> str:
        """The text of one item, from the file where it is there."""
        results = self._file(stage)
        if stage not in self._known:
            self._known[stage] = dict(results.table())
        known = self._known[stage]
        if item not in known:
            known[item] = work()
            results.write([item], [(known[item],)], 0.0, "")
        return known[item]

    def _file(self, stage: str) -> ResultsFile:
        if stage not in self._open:
            key = hashlib.sha256(f"{__version__}\n{self._study}\n{stage}".encode()).hexdigest()
            about: Mapping[str, Any] = {"ftqp": __version__, "study": self._study}
            self._open[stage] = ResultsFile(
                self.folder / stage, kind=KIND, key=key, columns=COLUMNS, about=about, remedy=REMEDY,
                onward="the same command with --resume",
            )  # fmt: skip
        return self._open[stage]

    def forget(self) -> None:
        """Take what is kept away, once the plan is made."""
        self.close()
        for file in self.folder.glob(f"*/{FILE_NAME}"):
            shutil.rmtree(file.parent, ignore_errors=True)
        with suppress(OSError):
            self.folder.rmdir()

    def close(self) -> None:
        """Let go of all files."""
        for results in self._open.values():
            results.close()
        self._open.clear()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
