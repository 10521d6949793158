"""One recorded QP, solved again: what the answer is, what holds it, and which backends see it otherwise."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.app.replay.labelled import LabelledQP
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError, MissingPackage
from ftqp.qp import QP, Claim, Recorder, Recording, Solution, SolveStatus, accepted, residuals, solve
from ftqp.qp import backends as known_backends
from ftqp.qp.adapters.registry import PREFIX

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
    recording: Recording,
    k: int,
    problem: QP,
    answers: Mapping[str, tuple[Solution, Claim | None] | str],
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
    found = solution.residuals
    usable = bool(np.isfinite(solution.x).all())
    return {
        "backend": solution.backend.removeprefix("recorder:"),
        "claim": None if claim is None else CLAIMS[claim],
        "status": solution.status.name,
        "sentence": solution.status.value,
        "iterations": solution.iterations,
        "objective": labelled.problem.objective(solution.x) if usable else None,
        "residuals": {
            "primal": found.primal,
            "dual": found.dual,
            "complementarity": found.complementarity,
            "gap": found.gap,
        }
        if usable
        else None,
        "variables": labelled.variables(solution) if usable else [],
        "task": labelled.task(solution) if usable else [],
        "torques": labelled.two_sided(solution) if usable else [],
        "certificate": None if solution.certificate is None else labelled.contradiction(solution.certificate),
    }
