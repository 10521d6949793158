"""What study_dtrnn measures: one function a part, each returning its entries of the result."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from comparison.dtrnn_study import (
    EXPLICIT,
    JUMPING,
    METHODS,
    SCALED,
    SCALED_LVI,
    Network,
    Spent,
    along,
    each,
    settings,
    until_right,
)  # fmt: skip
from comparison.dtrnn_study_problems import (
    OBJECTIVES,
    ROWS,
    VARIABLES,
    expanded,
    random_qp,
    rule,
    scaled,
    square,
)
from comparison.recorded import recorded
from comparison.sequences import sequences
from comparison.truth import Fact, truth

from ftqp.core.checks import FloatArray
from ftqp.qp import QP, Claim
from ftqp.qp.solving import loaded

STARTS = ("cold", "warm")
EVERY = 10
"""Ticks between two QPs of the square that are solved cold."""
NEWTON_TOLERANCE = 1e-9
"""Of |e|, of the variant with jumps on the square."""
CONDITIONS = tuple(10.0**k for k in range(11))
CONDITION = 1e3
"""Of W, where something else varies."""
ACTIVE = 1
"""Active bounds, where something else varies."""
TOLERANCES = tuple(10.0**-k for k in range(2, 11))
SCALE_FACTORS = tuple(10.0 ** (k / 2) for k in range(-6, 7))
GAMMAS = (0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.4, 1.5, 1.6, 1.7, 1.8, 1.9, 1.95)
SWEPT = ("panda-healthy", "panda-degraded", "planar6-healthy", "planar6-moving-bounds", "planar6-mtn",
         "xarm7-iiwt")  # fmt: skip
"""Sequences of the sweeps: W from identity to ill-conditioned, none to four active bounds."""
TRACED = {"panda-too-fast": 12, "planar6-mtn": 20}
"""The sequence and position of the QPs whose convergence is drawn.

One is well-conditioned, the others are ill-conditioned; every variable is bounded, so that the gap is finite.
"""
SWEEP_CAP = 5000
"""Most iterations of a sweep, which finds out where there are fewer."""
QUICK_SEQUENCES = (
    "panda-degraded", "panda-healthy", "panda-infeasible", "panda-too-fast",
    "planar6-infeasible", "planar6-mtn", "planar6-moving-bounds",
)  # fmt: skip
QUICK_CAP = 4000
"""Most iterations of a quick run's variants of the paper, on the recorded sequences."""


def on_square(objective: str) -> Iterator[dict[str, Any]]:
    """Every variant on the square, cold on every tenth QP and warm on all of them.

    The explicit methods, of which most solves with MTN run into the cap, are warm on every tenth QP there.
    """
    sequence, breaks = square(objective)
    for method in METHODS:
        chosen = settings(method, **({"tolerance": NEWTON_TOLERANCE} if method == JUMPING else {}))
        for start in STARTS:
            rare = start == "cold" or (objective == "MTN" and method in EXPLICIT)
            spent = along(sequence, chosen, warm=start == "warm", breaks=breaks, step=EVERY if rare else 1)
            entry = spent.cell(part="square", objective=objective, method=method, start=start)
            if objective == "DLSM":
                thin = 1 if rare else EVERY
                entry["box"] = [float(v) for v in np.percentile(spent.iterations, (0, 25, 50, 75, 100))]
                entry["series"] = spent.iterations[::thin]
            yield entry


def objectives(quick: bool) -> tuple[str, ...]:
    """The objectives of the square; a quick run has the first two."""
    return OBJECTIVES[:2] if quick else OBJECTIVES


def random_set(count: int, condition: float, active: int) -> list[tuple[QP, FloatArray]]:
    """Random QPs with their solutions; the same ones in every run."""
    rng = np.random.default_rng([count, active, round(np.log10(condition))])
    return [random_qp(rng, condition, active) for _ in range(count)]


def conditions(quick: bool) -> Iterator[dict[str, Any]]:
    """Iterations against the condition of W."""
    for condition in CONDITIONS[::3] if quick else CONDITIONS:
        yield from _difficulty("condition", condition, random_set(_count(quick), condition, ACTIVE))


def active_bounds(quick: bool) -> Iterator[dict[str, Any]]:
    """Iterations against the number of active bounds."""
    for active in range(VARIABLES - ROWS + 1):
        yield from _difficulty("active", active, random_set(_count(quick), CONDITION, active))


def _count(quick: bool) -> int:
    """Random QPs a point."""
    return 8 if quick else 20


def _difficulty(part: str, at: float, problems: list[tuple[QP, FloatArray]]) -> Iterator[dict[str, Any]]:
    """Every variant: iterations by its own stopping rule, and until x is right, [median, largest]."""
    for method in METHODS:
        chosen = settings(method)
        right = [until_right(problem, x, chosen) for problem, x in problems]
        entry = each(problems, chosen).cell(part=part, at=at, method=method)
        yield entry | {"right": [float(np.median(right)), max(right)]}


def tolerances(quick: bool) -> Iterator[dict[str, Any]]:
    """Iterations, and the error that is left, against the tolerance of |e|."""
    problems = random_set(_count(quick), CONDITION, ACTIVE)
    for tolerance in TOLERANCES[::2] if quick else TOLERANCES:
        for method in METHODS:
            if settings(method).paper:
                spent = each(problems, settings(method, tolerance=tolerance))
                yield spent.cell(part="tolerance", at=tolerance, method=method)


def sweeps(quick: bool) -> Iterator[dict[str, Any]]:
    """Iterations of ``implicit`` until x is right, as each of s, q and gamma leaves the rule.

    The goal is an error of x because |e| depends on the scales.
    """
    for name, recording in sequences(SWEPT[::2] if quick else SWEPT).items():
        picked = []
        for k in range(0, len(recording), 20 if quick else 8):
            problem = recording.problem(k)
            picked.append((expanded(problem), recording.x[k][problem.lb < problem.ub]))
        factors = SCALE_FACTORS[::2] if quick else SCALE_FACTORS
        for what, values in (("s", factors), ("q", factors), ("gamma", GAMMAS[::2] if quick else GAMMAS)):
            for value in values:
                iterations = [under_rule(problem, x, **{what: value}) for problem, x in picked]
                claims = [Claim.MAX_ITERATIONS if k >= SWEEP_CAP else Claim.SOLVED for k in iterations]
                spent = Spent(iterations=iterations, claims=claims, errors=[], cap=SWEEP_CAP)
                yield spent.cell(part="sweep", sequence=name, what=what, at=value)


def under_rule(problem: QP, x: FloatArray, s: float = 1.0, q: float = 1.0, gamma: float | None = None) -> int:
    """Iterations of ``implicit`` from zero until x is right.

    Args:
        problem: An expanded QP.
        x: The solution's first components, those that are no slacks.
        s: Factor on the objective's scale by the rule.
        q: Factor on the rows' scale by the rule.
        gamma: Step size; None is that of the rule.
    """
    by_rule = rule(problem)
    gamma = settings(SCALED).step_size if gamma is None else gamma
    chosen = settings("implicit", gamma=gamma, max_iterations=SWEEP_CAP)
    return until_right(scaled(problem, s * by_rule[0], q * by_rule[1]), x, chosen)


def traces() -> list[dict[str, Any]]:
    """How every variant converges on two recorded QPs, thinned out towards the end."""
    found = []
    for name, recording in sequences(TRACED).items():
        k = TRACED[name]
        problem = recording.problem(k)
        W, bounds = np.linalg.cond(problem.H), np.count_nonzero(recording.z_box[k])
        plural = "bound" if bounds == 1 else "bounds"
        about = {"tick": int(recording.tick[k]), "text": f"condition of W {W:.0e}, {bounds} active {plural}"}
        for method in METHODS:
            network = Network(problem.n, problem.m, problem.p, settings(method), trace=True)
            network.solve(loaded(problem).flat)
            last = network.iterations
            trace = network.trace[: last + 1]
            thin = np.round(np.geomspace(1, last, 150)) if last else []
            kept = np.concatenate([np.arange(min(30, last + 1)), thin])
            kept = np.union1d(kept, np.flatnonzero(trace[:, 3])).astype(int)
            found.append(
                {
                    "sequence": name,
                    "about": about,
                    "method": method,
                    "iteration": kept.tolist(),
                    "residual": trace[kept, 0].tolist(),
                    "r_eq": trace[kept, 1].tolist(),
                    "gap": [gap if np.isfinite(gap) else None for gap in trace[kept, 2].tolist()],
                    "jumps": np.flatnonzero(trace[:, 3]).tolist(),
                }
            )
    return found


def traced(trace: dict[str, Any]) -> dict[str, Any]:
    """The entry of a trace: where it ended."""
    end = {measure: trace[measure][-1] for measure in ("residual", "r_eq", "gap")}
    return {
        "part": "traces",
        "sequence": trace["sequence"],
        "method": trace["method"],
        "iterations": trace["iteration"][-1],
        "jumps": len(trace["jumps"]),
        **end,
    }


def recorded_sequences(quick: bool) -> Iterator[dict[str, Any]]:
    """Every variant on every recorded sequence: iterations, and claims of infeasibility against the truth."""
    for name, recording in sequences(QUICK_SEQUENCES if quick else None, quick=quick).items():
        sequence = recorded(name, recording)
        facts = truth(sequence.problems, sequence.solutions, sequence.feasible).facts
        for method in (*METHODS, SCALED_LVI):
            paper = quick and settings(method).paper
            chosen = settings(method, **({"max_iterations": QUICK_CAP} if paper else {}))
            for start in STARTS:
                spent = along(sequence, chosen, warm=start == "warm", breaks=recording.cold)
                entry = spent.cell(part="recorded", sequence=name, method=method, start=start)
                yield entry | _against(spent, facts)


def _against(spent: Spent, facts: list[Fact]) -> dict[str, int]:
    """Claims against facts: how many QPs of each combination."""
    pairs = list(zip(spent.claims, facts, strict=True))
    return {
        "solvable": facts.count(Fact.SOLVABLE),
        "false_alarms": pairs.count((Claim.INFEASIBLE, Fact.SOLVABLE)),
        "solved": pairs.count((Claim.SOLVED, Fact.SOLVABLE)),
        "infeasible": facts.count(Fact.INFEASIBLE),
        "found": pairs.count((Claim.INFEASIBLE, Fact.INFEASIBLE)),
        "called_solved": pairs.count((Claim.SOLVED, Fact.INFEASIBLE)),
    }
