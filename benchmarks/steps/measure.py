"""Runs the workers in turn, a chunk at a time, and sums up what they read."""

import json
import os
import select
import subprocess
import sys
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from bench.cases import Path as TaskPath
from bench.worker import Case

ANSWER_SECONDS = 600
"""Longest wait for one answer of a worker; a peer that hangs is left out [s]."""

LIBRARIES = ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "NUMBA", "VECLIB_MAXIMUM")
ONE_THREAD = {f"{library}_NUM_THREADS": "1" for library in LIBRARIES}


class WorkerFailed(Exception):
    """A worker died, hung or could not start; the message says which and its last words."""


class Worker:
    """A program in a process of its own, asked over a pipe.

    Args:
        name: What it is called in messages.
        python: The interpreter.
        module: The worker's module.
        log: Where its last words go.
        core: The core that it runs on; None is any.
        realtime: Whether it asks for real-time priority.
        source: A folder that packages are looked for in first.
    """

    def __init__(
        self,
        name: str,
        python: Path,
        module: str,
        *,
        log: Path,
        core: int | None,
        realtime: bool = False,
        source: Path | None = None,
    ) -> None:
        self.name = name
        self._log = log
        arguments = ["--core", str(core)] if core is not None else []
        arguments += ["--realtime"] if realtime else []
        environment = {**os.environ, **ONE_THREAD}
        if python != Path(sys.executable):
            environment.pop("PYTHONPATH", None)
        if source is not None:
            environment["PYTHONPATH"] = str(source)
        with log.open("w") as errors:
            self._process = subprocess.Popen(
                [str(python), "-m", module, *arguments],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
                cwd=Path(__file__).resolve().parents[1],
                env=environment,
            )

    def ask(self, **request: Any) -> dict[str, Any]:
        """The worker's answer."""
        stdin, stdout = self._process.stdin, self._process.stdout
        if stdin is None or stdout is None:
            raise WorkerFailed(f"{self.name} has no pipe")
        try:
            stdin.write(json.dumps(request).encode() + b"\n")
            stdin.flush()
            ready, _, _ = select.select([stdout], [], [], ANSWER_SECONDS)
        except OSError as error:
            raise WorkerFailed(f"{self.name} ended: {self._last_words()}") from error
        if not ready:
            raise WorkerFailed(f"{self.name} gave no answer within {ANSWER_SECONDS} s")
        line = stdout.readline()
        if not line:
            raise WorkerFailed(f"{self.name} ended: {self._last_words()}")
        answer: dict[str, Any] = json.loads(line)
        return answer

    def close(self) -> None:
        """Ends the process."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                try:
                    pipe.close()
                except BrokenPipeError:
                    continue

    def _last_words(self) -> str:
        lines = self._log.read_text(errors="replace").strip().splitlines()
        return lines[-1] if lines else "it said nothing"


def last_core() -> int | None:
    """The last core that this process may run on; None where the system does not say."""
    return max(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """How much is measured.

    Attributes:
        steps: Timed steps of a leading variant.
        chunk: Its timed steps before the next variant has its turn.
        warm: Untimed steps of every variant before the first chunk.
        discard: Steps at the head of each chunk that bring the program back, not counted.
        share: The other variants make one step where the leading ones make so many.
    """

    steps: int
    chunk: int
    warm: int
    discard: int = 20
    share: int = 1


@dataclass(slots=True)
class Reading:
    """What one variant did in one case."""

    worker: str
    counts: dict[str, int] = field(default_factory=dict)
    ns: list[int] = field(default_factory=list)
    error: float = 0.0
    locked_motion: float = 0.0

    def judge(self, task: TaskPath, case: Case, k: int, q: list[float]) -> None:
        """Notes how far the tip is from target k, and how far the locked joint has moved."""
        reached = np.array(q)
        self.error = max(self.error, float(np.linalg.norm(task.pose(reached)[:3, 3] - task.poses[k][:3, 3])))
        if case.locked is not None:
            self.locked_motion = max(
                self.locked_motion, abs(float(reached[case.locked] - case.q[case.locked]))
            )

    def row(self) -> dict[str, Any]:
        """Times [us], largest distance from the target [m], motion of the locked joint [rad], statuses."""
        us = np.array(self.ns) / 1e3
        p50, p99, p999 = (float(np.percentile(us, p)) for p in (50.0, 99.0, 99.9))
        tail = p999 / p50 if p50 else 0.0
        times = {"p50": p50, "p99": p99, "p999": p999, "max": float(us.max()), "tail": tail}
        rounded = {name: round(value, 3) for name, value in times.items()}
        return {
            "program": self.worker,
            **rounded,
            "steps": len(self.ns),
            "position_error": round(self.error, 9),
            "locked_joint_motion": self.locked_motion,
            "statuses": self.counts,
        }


def measured(
    task: TaskPath,
    case: Case,
    way: str,
    file: Path,
    workers: list[Worker],
    settings: Settings,
    leading: Collection[str] = (),
) -> tuple[dict[str, dict[str, Any]], dict[str, str], dict[str, dict[str, Any]]]:
    """One case called in one way over all workers, their variants interleaved.

    Returns:
        Rows by variant, what was left out and why, and what each program says of itself.
    """
    case.save(file)
    readings: dict[str, Reading] = {}
    turns: list[tuple[Worker, str]] = []
    left_out: dict[str, str] = {}
    said: dict[str, dict[str, Any]] = {}
    for worker in list(workers):
        answer = _asked(worker, workers, left_out, worker.name, open=str(file), way=way)
        left_out.update(answer.get("declined", {}))
        if "versions" in answer:
            said[worker.name] = {"versions": answer["versions"], "settled": answer["settled"]}
        for name in answer.get("variants", []):
            warm = _asked(worker, workers, left_out, name, warm=name, steps=settings.warm)
            if "q" in warm:
                readings[name] = Reading(worker=worker.name, counts=warm["counts"])
                for k, q in zip(warm["k"], warm["q"], strict=True):
                    readings[name].judge(task, case, k, q)
                turns.append((worker, name))
    turns.sort(key=lambda turn: turn[1] not in leading)  # whose ratio counts go one right after the other
    for turn in range(-(-settings.steps // settings.chunk)):
        first = turn % max(len(turns), 1)
        for worker, name in turns[first:] + turns[:first]:
            if name in left_out or worker not in workers:
                continue
            steps = settings.chunk if name in leading else max(1, settings.chunk // settings.share)
            request = {"chunk": name, "steps": steps, "discard": settings.discard}
            answer = _asked(worker, workers, left_out, name, **request)
            if "ns" in answer:
                readings[name].ns += answer["ns"]
                readings[name].judge(task, case, answer["k"], answer["q"])
    return {name: reading.row() for name, reading in readings.items() if reading.ns}, left_out, said


def _asked(
    worker: Worker, workers: list[Worker], left_out: dict[str, str], name: str, **request: Any
) -> dict[str, Any]:
    """The answer, or an empty one with the reason in ``left_out``; a dead worker leaves the list."""
    try:
        answer = worker.ask(**request)
    except WorkerFailed as error:
        left_out[name] = str(error)
        workers.remove(worker)
        worker.close()
        return {}
    if "error" in answer:
        left_out[name] = answer["error"]
        return {}
    return answer
