"""The side of the benchmark that steps: one loop for every program measured, driven over a pipe.

Needs numpy and the standard library only, so that it runs in each peer's own environment. One JSON object
a line:

    {"open": FILE, "way": WAY}         -> {"variants": [...], "declined": {name: why}, "versions": {...}}
    {..., "only": [NAME, ...]}         the same with these variants alone
    {"warm": NAME, "steps": n}         -> {"k": [...], "q": [[...]], "counts": {...}}
    {"chunk": NAME, "steps": n, ...}   -> {"ns": [...], "k": last, "q": [...]}
    {"close": true}                    ends

A way is one of ``bench.ways.WAYS``; every program gets its targets and is timed accordingly.
"""

import json
import os
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self, TextIO

import numpy as np
from numpy.typing import NDArray

from bench.ways import nothing, took

Array = NDArray[np.float64]

SAMPLE = 20
"""A warm-up reports the configuration once in this many steps."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One task on one robot, the same for every program.

    Attributes:
        robot: ``panda`` or ``chain30``.
        level: ``velocity`` or ``torque`` (acceleration with torque limits).
        locked: Index of the joint that does not move, or None.
        dt: Step [s].
        urdf: The robot, as URDF text.
        tip: The frame that follows the target.
        joints: Joint names from base to tip, (nv,).
        kp: Task gain at torque level [1/s2].
        kv: Task damping at torque level [1/s].
        gain: Task gain at velocity level of programs that take one [1/s].
        q: Start, at rest, (nv,).
        poses: Targets, one a step and periodic, (N, 4, 4).
        twists: Their velocities, linear then angular along W, (N, 6).
        q_min: Lowest positions, (nv,).
        q_max: Highest positions, (nv,).
        v_max: Largest speeds, (nv,).
        a_max: Largest accelerations, (nv,).
        tau_max: Largest torques, (nv,).
    """

    robot: str
    level: str
    locked: int | None
    dt: float
    urdf: str
    tip: str
    joints: tuple[str, ...]
    kp: float
    kv: float
    gain: float
    q: Array
    poses: Array
    twists: Array
    q_min: Array
    q_max: Array
    v_max: Array
    a_max: Array
    tau_max: Array

    def save(self, path: Path) -> None:
        """Writes the case to ``path`` (.npz)."""
        fields = asdict(self)
        arrays: dict[str, Any] = {k: v for k, v in fields.items() if isinstance(v, np.ndarray)}
        plain = {k: v for k, v in fields.items() if k not in arrays}
        np.savez(path, plain=np.array(json.dumps(plain)), **arrays)

    @classmethod
    def load(cls, path: str) -> Self:
        """Reads what ``save`` wrote."""
        with np.load(path) as file:
            plain = json.loads(str(file["plain"]))
            arrays = {k: file[k] for k in file.files if k != "plain"}
        plain["joints"] = tuple(plain["joints"])
        return cls(**plain, **arrays)

    def targets(self, way: str) -> list[Array] | Array:
        """Target k is the k-th of these: arrays made ahead, or rows taken anew in every tick."""
        return [np.ascontiguousarray(pose) for pose in self.poses] if way == "best" else self.poses


@dataclass(frozen=True, slots=True, kw_only=True)
class Variant:
    """One way to do the whole user step.

    Attributes:
        step: Takes target k, solves and moves on; this call is what is timed.
        q: The configuration reached, (nv,) in the case's joint order.
        status: What the program says of the last step, read outside the timed call.
        between: What follows each step untimed.
    """

    step: Callable[[int], None]
    q: Callable[[], Any]
    status: Callable[[], str] = lambda: "done"
    between: Callable[[], None] = nothing


Builder = Callable[[Case, str], dict[str, Callable[[], Variant]]]
"""From a case and a way to the variants' makers by name; a maker that cannot raises with the reason."""


class _Run:
    """A variant and how far along the targets it is."""

    def __init__(self, variant: Variant, period: int, way: str) -> None:
        self._variant = variant
        self._way = way
        self._period = period
        self._k = 0

    def warm(self, steps: int) -> dict[str, Any]:
        """Untimed steps, each with its status; also the check that the task is followed."""
        counts: Counter[str] = Counter()
        samples = []
        for i in range(steps):
            k = (self._k + i) % self._period
            self._variant.step(k)
            counts[self._variant.status()] += 1
            self._variant.between()
            if i % SAMPLE == SAMPLE - 1:
                samples.append((k, _listed(self._variant.q())))
        self._k = (self._k + steps) % self._period
        return {"k": [k for k, _ in samples], "q": [q for _, q in samples], "counts": counts}

    def chunk(self, steps: int, discard: int) -> dict[str, Any]:
        """Timed steps; the first ``discard`` bring the program back into the caches and are left out."""
        variant, period, start = self._variant, self._period, self._k
        ticks = [(start + i) % period for i in range(discard + steps)]
        ns = took(self._way, variant.step, variant.between, ticks)
        self._k = (ticks[-1] + 1) % period
        return {"ns": ns[discard:], "k": ticks[-1], "q": _listed(variant.q())}


def _listed(q: Any) -> list[float]:
    return [float(value) for value in q]


def serve(build: Builder, versions: Callable[[], dict[str, str]]) -> None:
    """Answers requests on standard input until told to close."""
    answers = _private_stdout()
    settled = _settle(sys.argv[1:])
    runs: dict[str, _Run] = {}
    for line in sys.stdin:
        request = json.loads(line)
        if "close" in request:
            return
        if "open" in request:
            runs, answer = _opened(build, request)
            answer |= {"versions": versions(), "settled": settled}
        else:
            answer = _answer(runs, request)
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


def _opened(build: Builder, request: dict[str, Any]) -> tuple[dict[str, _Run], dict[str, Any]]:
    runs: dict[str, _Run] = {}
    declined: dict[str, str] = {}
    case, way, only = Case.load(request["open"]), request["way"], request.get("only")
    for name, make in build(case, way).items():
        if only is not None and name not in only:
            continue
        try:
            runs[name] = _Run(make(), len(case.poses), way)
        except Exception as error:
            # A foreign program may fail in any way; the run goes on without it and says why.
            declined[name] = f"{type(error).__name__}: {error}"
    return runs, {"variants": list(runs), "declined": declined}


def _answer(runs: dict[str, _Run], request: dict[str, Any]) -> dict[str, Any]:
    try:
        if "warm" in request:
            return runs[request["warm"]].warm(request["steps"])
        return runs[request["chunk"]].chunk(request["steps"], request["discard"])
    except Exception as error:
        # As above: a peer that raises in the middle is reported, not fatal.
        return {"error": f"{type(error).__name__}: {error}"}


def _private_stdout() -> TextIO:
    """Keeps the pipe for answers and sends whatever a library writes to standard output to standard error."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    return answers


def _settle(arguments: list[str]) -> dict[str, str]:
    """One core and, where permitted, real-time priority; says what was granted."""
    granted = {"core": "any", "priority": "normal"}
    if "--core" in arguments:
        core = int(arguments[arguments.index("--core") + 1])
        try:
            os.sched_setaffinity(0, {core})
            granted["core"] = str(core)
        except (AttributeError, OSError) as error:
            granted["core"] = f"any ({error})"
    if "--realtime" in arguments:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(10))
            granted["priority"] = "SCHED_FIFO 10"
        except (AttributeError, OSError) as error:
            granted["priority"] = f"normal ({error})"
    return granted
