"""Variants take turns, and one that fails is left out while the others go on."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench import cases
from bench.worker import SAMPLE, Variant, _Run
from steps.measure import Settings, Worker, WorkerFailed, measured

ARM = cases.chain30()
SETTINGS = Settings(steps=30, chunk=10, warm=SAMPLE)
WAY = "readme"


class Scripted(Worker):
    """A worker without a process that records what it is asked."""

    def __init__(
        self, name: str, variants: list[str], asked: list[str], fails: str = "", dies: str = ""
    ) -> None:
        self.name = name
        self.closed = False
        self._variants, self._asked, self._fails, self._dies = variants, asked, fails, dies

    def ask(self, **request: Any) -> dict[str, Any]:
        if "open" in request:
            said = {"versions": {self.name: "1"}, "settled": {"core": "0", "priority": "normal"}}
            return {"variants": self._variants, "declined": {}, **said}
        name = request.get("warm") or request["chunk"]
        if name == self._dies and "chunk" in request:
            raise WorkerFailed(f"{self.name} ended: segmentation fault")
        if name == self._fails and "chunk" in request:
            return {"error": "RuntimeError: infeasible"}
        if "warm" in request:
            return {"k": [0], "q": [list(ARM.neutral)], "counts": {"OK": request["steps"]}}
        self._asked.append(name)
        return {"ns": [1000] * request["steps"], "k": 0, "q": list(ARM.neutral)}

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def task() -> cases.Path:
    """A task whose pose does not matter."""
    poses = np.tile(np.eye(4), (4, 1, 1))
    return cases.Path(
        name="chain30", arm=ARM, urdf="", poses=poses, twists=np.zeros((4, 6)), pose=lambda q: np.eye(4)
    )


def test_variants_take_turns_and_each_goes_first(task: cases.Path, tmp_path: Path) -> None:
    asked: list[str] = []
    workers: list[Worker] = [Scripted("one", ["a", "b"], asked), Scripted("two", ["c"], asked)]
    rows, left_out, said = measured(
        task, task.case("velocity", locked=False), WAY, tmp_path / "c.npz", workers, SETTINGS
    )
    assert asked == ["a", "b", "c", "b", "c", "a", "c", "a", "b"]
    assert {name: row["steps"] for name, row in rows.items()} == {"a": 30, "b": 30, "c": 30}
    assert rows["a"]["p50"] == 1.0
    assert left_out == {}
    assert set(said) == {"one", "two"}


def test_a_variant_that_raises_is_left_out_with_its_reason(task: cases.Path, tmp_path: Path) -> None:
    workers: list[Worker] = [Scripted("one", ["a", "b"], [], fails="a")]
    case = task.case("velocity", locked=False)
    rows, left_out, _ = measured(task, case, WAY, tmp_path / "c.npz", workers, SETTINGS)
    assert set(rows) == {"b"}
    assert left_out == {"a": "RuntimeError: infeasible"}


def test_a_worker_that_dies_is_left_out_and_the_others_go_on(task: cases.Path, tmp_path: Path) -> None:
    dying = Scripted("one", ["a"], [], dies="a")
    workers: list[Worker] = [dying, Scripted("two", ["b"], [])]
    case = task.case("velocity", locked=False)
    rows, left_out, _ = measured(task, case, WAY, tmp_path / "c.npz", workers, SETTINGS)
    assert set(rows) == {"b"}
    assert left_out == {"a": "one ended: segmentation fault"}
    assert dying.closed
    assert [worker.name for worker in workers] == ["two"]


def test_a_process_that_ends_says_its_last_words(tmp_path: Path) -> None:
    worker = Worker(
        "nobody", Path(sys.executable), "bench.nobody", log=tmp_path / "log", core=None, realtime=False
    )
    with pytest.raises(WorkerFailed, match=r"nobody ended: .*No module named"):
        worker.ask(open="nothing")
    worker.close()


def test_chunks_go_on_along_the_targets_and_leave_out_the_first_steps() -> None:
    seen: list[int] = []
    run = _Run(Variant(step=seen.append, q=lambda: [0.0]), period=7, way="best")
    assert run.warm(3)["counts"] == {"done": 3}
    answer = run.chunk(4, 2)
    assert len(answer["ns"]) == 4
    assert seen == [0, 1, 2, 3, 4, 5, 6, 0, 1]
    assert answer["k"] == 1
