"""One recorded QP, solved again: what the answer is, what holds it, and which backends see it otherwise."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.control.planner.planner_view import SCALE, SLACK
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError, MissingPackage
from ftqp.kernel.layout.rows import RowKind, kind_of
from ftqp.qp import (
    QP,
    Certificate,
    Claim,
    Recorder,
    Recording,
    Solution,
    SolveStatus,
    accepted,
    residuals,
    solve,
)
from ftqp.qp import backends as known_backends
from ftqp.qp.adapters.registry import PREFIX

TOUCHING = 1e-7
"""A value this near to a bound, relative to 1 + the bound, is at it."""
INVOLVED = 1e-6
"""A multiplier of a certificate above this share of the largest takes part in it."""
FIXED = "fixed"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Units:
    """Units of a planner's QP; empty strings when the recording does not say."""

    level: str
    dt: float
    length: float
    prismatic: Mapping[str, bool]

    @classmethod
    def of(cls, metadata: Mapping[str, Any]) -> "_Units":
        """Read what is there; a recording that is no planner's says nothing."""
        return cls(
            level=metadata.get("level", ""),
            dt=metadata.get("dt", 1.0),
            length=metadata.get("length", 1.0),
            prismatic=dict(zip(metadata.get("joints", ()), metadata.get("prismatic", ()), strict=False)),
        )

    @property
    def rate(self) -> str:
        """What follows ``rad`` or ``m``."""
        return {"velocity": "/s", "acceleration": "/s2"}.get(self.level, "")

    def joint(self, name: str) -> str:
        """Of a variable."""
        if name not in self.prismatic or not self.level:
            return ""
        return ("m" if self.prismatic[name] else "rad") + self.rate

    def row(self, name: str) -> tuple[str, float]:
        """Of a task row, and what its numbers are divided by."""
        if not self.level or name not in ("x", "y", "z", "rx", "ry", "rz"):
            return "", 1.0
        return ("rad" + self.rate, self.length) if name.startswith("r") else ("m" + self.rate, 1.0)

    def limited(self, kind: RowKind, joint: str) -> tuple[str, float]:
        """Of what a row of C limits, and what its numbers are divided by: dt at the velocity level."""
        if joint not in self.prismatic or not self.level:
            return "", 1.0
        unit = kind.sliding_unit if kind.most is None and self.prismatic[joint] else kind.unit
        return unit, (self.dt if self.level == "velocity" else 1.0)


class LabelledQP:
    """A QP with the names of its variables and rows; the metadata is that of its recording."""

    def __init__(
        self, problem: QP, variables: Sequence[str], rows: Sequence[str], metadata: Mapping[str, Any]
    ) -> None:
        self.problem = problem
        self._variables, self._rows = tuple(variables), tuple(rows)
        self._units = _Units.of(metadata)
        self._slack = np.array([name.startswith(SLACK) for name in variables])
        self._motion = ~self._slack & np.array([name != SCALE for name in variables])

    def distance(self, x: FloatArray, other: FloatArray) -> float:
        """Largest difference of the variables that are no slacks."""
        return float(np.abs(x - other)[~self._slack].max())

    def variables(self, solution: Solution) -> list[dict[str, Any]]:
        """Every variable that is no slack: value, interval, which side holds it, multiplier."""
        q = self.problem
        ends = zip(q.lb.tolist(), solution.x.tolist(), q.ub.tolist(), solution.z_box.tolist(), strict=True)
        return [
            _bounded(name, self._units.joint(name), one[:3], _side(*one[:3]), one[3])
            for name, slack, one in zip(self._variables, self._slack, ends, strict=True)
            if not slack
        ]

    def task(self, solution: Solution) -> list[dict[str, Any]]:
        """Every equality row: what it asks of the joints, what they do, what is lost, multiplier."""
        q, rows = self.problem, []
        for k, name in enumerate(self._rows[: q.m]):
            unit, divisor = self._units.row(name)
            scale = sum(q.A[k, i] for i, label in enumerate(self._variables) if label == SCALE)
            asked = float(q.b[k] - scale) / divisor
            done = float(q.A[k, self._motion] @ solution.x[self._motion]) / divisor
            told = {"name": name, "unit": unit, "asked": asked, "done": done, "lost": done - asked}
            rows.append(told | {"multiplier": float(solution.y[k])})
        return rows

    def two_sided(self, solution: Solution) -> list[dict[str, Any]]:
        """Every two-sided row that is closed on a side; of symmetric kinds less the middle of l, u."""
        q, rows = self.problem, []
        values = q.C @ solution.x
        for j, name in enumerate(self._rows[q.m :]):
            low, high, value = float(q.l[j]), float(q.u[j]), float(values[j])
            if low == -np.inf and high == np.inf:
                continue
            unit, kind = "", kind_of(name)
            side = _side(low, value, high)
            if kind is not None and (not kind.symmetric or np.isfinite(high - low)):
                unit, divisor = self._units.limited(kind, name.removeprefix(kind.prefix))
                shift = 0.5 * (low + high) if kind.symmetric else 0.0
                low, high, value = ((end - shift) / divisor for end in (low, high, value))
            rows.append(_bounded(name, unit, (low, value, high), side, float(solution.z[j])))
        return rows

    def contradiction(self, certificate: Certificate) -> dict[str, Any]:
        """Which rows and bounds exclude each other, by name and in a sentence."""
        q = self.problem
        violated = np.concatenate([certificate.y, certificate.z])
        involved = _involved(violated)
        rows = [self._rows[k] for k in involved if k < q.m]
        two_sided = [
            f"{self._rows[k]} ({_end(violated[k], q.l[k - q.m], q.u[k - q.m])})" for k in involved if k >= q.m
        ]
        bounds = [
            f"{self._variables[i]} ({_end(certificate.z_box[i], q.lb[i], q.ub[i])})"
            for i in _involved(certificate.z_box)
        ]
        named = [*(f"row {name}" for name in rows), *two_sided, *bounds]
        listed = f"{', '.join(named[:-1])} and {named[-1]}" if len(named) > 1 else "".join(named)
        return {
            "rows": rows,
            "two_sided_rows": two_sided,
            "bounds": bounds,
            "violation": certificate.violation,
            "sentence": f"{listed} exclude each other: the point closest to all of them misses a row by "
            f"{certificate.violation:.3g}",
        }


def _bounded(
    name: str, unit: str, ends: tuple[float, float, float], side: str | None, multiplier: float
) -> dict[str, Any]:
    lower, value, upper = ends
    return {
        "name": name, "unit": unit, "lower": lower, "value": value, "upper": upper, "active": side,
        "multiplier": multiplier,
    }  # fmt: skip


def _side(low: float, value: float, high: float) -> str | None:
    if low == high:
        return FIXED
    if np.isfinite(low) and value - low <= TOUCHING * (1.0 + abs(low)):
        return "lower"
    if np.isfinite(high) and high - value <= TOUCHING * (1.0 + abs(high)):
        return "upper"
    return None


def _involved(multipliers: FloatArray) -> list[int]:
    size = np.abs(multipliers)
    return [int(i) for i in np.flatnonzero(size > INVOLVED * size.max(initial=0.0))]


def _end(multiplier: float, low: float, high: float) -> str:
    """The end of [low, high] that stands in the way."""
    if low == high:
        return f"{FIXED} at {low:.4g}"
    return "upper" if multiplier > 0.0 else "lower"


AGREEMENT = 1e-6
"""Answers whose variables differ by less than this, relative to 1 + the largest one, agree."""
AGREES, GAVE_UP, WRONG = "agrees", "gave up", "wrong: "
"""Beginnings of a verdict; others say why a backend takes no part."""
CLAIMS = {
    Claim.SOLVED: "solved",
    Claim.MAX_ITERATIONS: "max_iter",
    Claim.INFEASIBLE: "infeasible",
    Claim.FAILED: "failed",
}


def overview(file: Path, recording: Recording) -> dict[str, Any]:
    """What a recording holds: its run, its ticks, what the solver claimed."""
    others = [int(tick) for tick in recording.tick[recording.claim != Claim.SOLVED]]
    return {
        "file": str(file),
        "qps": len(recording),
        "ticks": [int(recording.tick[0]), int(recording.tick[-1])],
        "time": [float(recording.time[0]), float(recording.time[-1])],
        "variables": list(recording.variables),
        "rows": list(recording.rows),
        "claims": {
            word: int(np.count_nonzero(recording.claim == claim))
            for claim, word in CLAIMS.items()
            if (recording.claim == claim).any()
        },
        "ticks_not_solved": others,
        "metadata": dict(recording.metadata),
    }


def replay(
    file: Path, recording: Recording, tick: int, backend: str | None, others: Sequence[str] | None
) -> dict[str, Any]:
    """Solve the QP of a tick again, cold, and say what there is to say."""
    k = recording.position(tick)
    problem = recording.problem(k)
    labelled = LabelledQP(problem, recording.variables, recording.rows, recording.metadata)
    chosen = backend or str(recording.metadata.get("backend") or "active_set")
    solution, claim = _solved(problem, chosen)
    answers: dict[str, tuple[Solution, Claim | None] | str] = {chosen: (solution, claim)}
    for name in _at_hand() if others is None else others:
        if name not in answers:
            answers[name] = _tried(problem, name)
    x_ref, source = _reference(recording, k, problem, answers)
    infeasible = x_ref is None and solution.certificate is not None
    rows = [_compared(name, answer, labelled, x_ref, infeasible) for name, answer in answers.items()]
    return {
        "file": str(file),
        "tick": tick,
        "time": float(recording.time[k]),
        "ticks": [int(recording.tick[0]), int(recording.tick[-1])],
        "metadata": dict(recording.metadata),
        "size": {"variables": problem.n, "equality_rows": problem.m, "two_sided_rows": problem.p},
        "recorded": {
            "backend": recording.metadata.get("backend"),
            "claim": CLAIMS[Claim(int(recording.claim[k]))],
            "iterations": int(recording.iterations[k]),
            "start": "cold" if recording.cold[k] else "warm",
        },
        "solution": _explained(labelled, solution, claim),
        "reference": source,
        "backends": rows,
        "disagree": [row["backend"] for row in rows if row["verdict"].startswith(WRONG)],
        "gave_up": [row["backend"] for row in rows if row["verdict"] == GAVE_UP],
    }


def _solved(problem: QP, backend: str) -> tuple[Solution, Claim | None]:
    """The judged answer, and what the solver itself said; None when it was not asked."""
    witness = Recorder(backend)
    solution = solve(problem, witness)
    claim = Claim(int(witness.recording(dt=1.0).claim[0])) if len(witness) else None
    return solution, claim


def _tried(problem: QP, name: str) -> tuple[Solution, Claim | None] | str:
    """The same, or why this backend takes no part."""
    try:
        return _solved(problem, name)
    except MissingPackage as error:
        return f"package {error.package!r} is not installed; {error.remedy}"
    except InputError as error:
        if name in {info.name for info in known_backends()}:
            return str(error)  # the QP is beyond what this solver takes
        raise


def _at_hand() -> list[str]:
    """Every backend, those that are not installed included, so that the table says how to get them."""
    return [info.name for info in known_backends() if info.name != f"{PREFIX}<name>"]


def _reference(
    recording: Recording, k: int, problem: QP, answers: Mapping[str, tuple[Solution, Claim | None] | str]
) -> tuple[FloatArray | None, str | None]:
    """The point that answers are measured against, and whose it is: the recorded one if it solves the QP."""
    x, y, z, z_box = (getattr(recording, name)[k] for name in ("x", "y", "z", "z_box"))
    if accepted(problem, residuals(problem, x, y, z, z_box), x, y):
        return x, "the recorded answer"
    good = [a[0] for a in answers.values() if not isinstance(a, str) and a[0].status is SolveStatus.SOLVED]
    if not good:
        return None, None
    best = min(good, key=lambda answer: answer.residuals.largest)
    return best.x, f"the answer of {best.backend.removeprefix('recorder:')}, the recorded one is none"


def _compared(
    name: str,
    answer: tuple[Solution, Claim | None] | str,
    labelled: LabelledQP,
    x_ref: FloatArray | None,
    infeasible: bool,
) -> dict[str, Any]:
    """A row of the table of backends."""
    row: dict[str, Any] = {"backend": name, "claim": None, "status": None, "iterations": None}
    row |= {"difference": None, "residual": None}
    if isinstance(answer, str):
        return row | {"verdict": answer}
    solution, claim = answer
    answered = bool(np.isfinite(solution.x).all())
    distance = None if x_ref is None or not answered else labelled.distance(solution.x, x_ref)
    size = 1.0 if x_ref is None else 1.0 + float(np.abs(x_ref).max())
    far = distance is not None and distance > AGREEMENT * size
    return row | {
        "claim": None if claim is None else CLAIMS[claim],
        "status": solution.status.name,
        "iterations": solution.iterations,
        "difference": distance,
        "residual": solution.residuals.largest if answered else None,
        "verdict": _verdict(solution, claim, infeasible, far),
    }


def _verdict(solution: Solution, claim: Claim | None, infeasible: bool, far: bool) -> str:
    """What the claim and the answer are worth."""
    if infeasible:
        if claim is Claim.SOLVED:
            return f"{WRONG}claims a solution"
        return AGREES if claim is Claim.INFEASIBLE else GAVE_UP
    if claim is Claim.INFEASIBLE:
        return f"{WRONG}says infeasible"
    if solution.status is not SolveStatus.SOLVED:
        return f"{WRONG}large residuals" if claim is Claim.SOLVED else GAVE_UP
    return f"{WRONG}another point" if far else AGREES


def _explained(labelled: LabelledQP, solution: Solution, claim: Claim | None) -> dict[str, Any]:
    """The answer of the chosen backend by names."""
    usable = bool(np.isfinite(solution.x).all())
    return {
        "backend": solution.backend.removeprefix("recorder:"),
        "claim": None if claim is None else CLAIMS[claim],
        "status": solution.status.name,
        "sentence": solution.status.value,
        "iterations": solution.iterations,
        "objective": labelled.problem.objective(solution.x) if usable else None,
        "residuals": asdict(solution.residuals) if usable else None,
        "variables": labelled.variables(solution) if usable else [],
        "task": labelled.task(solution) if usable else [],
        "torques": labelled.two_sided(solution) if usable else [],
        "certificate": None if solution.certificate is None else labelled.contradiction(solution.certificate),
    }
