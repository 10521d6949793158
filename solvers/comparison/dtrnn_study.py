"""The network's variants and how their iterations are counted: the base of study_dtrnn."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from bench.contenders import Contender
from comparison.recorded import Recorded

from ftqp.core.checks import FloatArray
from ftqp.kernel.entry.workspace import solve_networks
from ftqp.kernel.layout.flat_arrays import memory_size
from ftqp.qp import QP, Claim
from ftqp.qp.dtrnn import DtrnnSettings
from ftqp.qp.solving import loaded

PAPER: dict[str, Any] = {"name": "dtrnn", "mode": "paper"}
METHODS: dict[str, dict[str, Any]] = {
    "94lvi": PAPER | {"method": "94lvi"},
    "e47": PAPER | {"method": "e47"},
    "implicit": PAPER | {"method": "implicit"},
    "implicit + scaling": PAPER | {"method": "implicit", "scaling": True},
    "implicit + scaling + Newton": PAPER | {"method": "implicit", "scaling": True, "newton": True},
    "product": {"name": "dtrnn"},
}
"""Settings of each variant; the last one is the backend as it comes."""
EXPLICIT = ("94lvi", "e47")
"""The methods without a factorisation."""
SCALED, JUMPING, PRODUCT = "implicit + scaling", "implicit + scaling + Newton", "product"
SCALED_LVI = "94lvi + scaling"
"""94lvi under the rule that is made for ``implicit``: how much that harms."""

RIGHT = 1e-5
"""An answer is right when |x - x_ref| is below this times 1 + |x_ref|."""
TIGHT = 1e-15
"""Tolerance of |e| that ends nothing before its answer is right."""


def settings(method: str, **changes: Any) -> DtrnnSettings:
    """The settings of a variant, with changes."""
    given = PAPER | {"method": "94lvi", "scaling": True} if method == SCALED_LVI else METHODS[method]
    return DtrnnSettings(**{key: value for key, value in given.items() if key != "name"} | changes)


def contenders() -> list[Contender]:
    """The variants, as a result lists them."""
    return [Contender(name=name, settings=dict(given)) for name, given in METHODS.items()]


class Network:
    """The compiled network for QPs of one size, alone: no second attempt, no check of the answer.

    Attributes:
        claim: How the last solve ended.
        iterations: Iterations of the last solve.
    """

    def __init__(self, n: int, m: int, p: int, chosen: DtrnnSettings) -> None:
        self.claim, self.iterations = Claim.FAILED, 0
        self._variables = n
        self._numbers = chosen.numbers()
        self._solution = np.zeros(2 * n + m + p)
        self._sizes, self._memory = (n, m, p), np.zeros(memory_size(n, m, p))

    @property
    def x(self) -> FloatArray:
        """The answer of the last solve that had one, (n,)."""
        return self._solution[: self._variables]

    def solve(self, flat: FloatArray, *, warm: bool = False) -> Claim:
        """Solve a QP, as ``QPBuffers.flat`` has it; a warm solve starts from the last answer."""
        warm = warm and self.claim <= Claim.MAX_ITERATIONS
        ((code, iterations, _),) = solve_networks(
            flat[None], self._solution[None], self._sizes, self._numbers, self._memory, warm=warm
        )
        self.claim, self.iterations = Claim(int(code)), int(iterations)
        return self.claim


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Spent:
    """What one variant needed for K QPs.

    Attributes:
        iterations: Iterations of each, (K,).
        claims: How each ended, (K,).
        errors: Largest |x - x_ref| of each, (K,), NaN where there is no answer or no reference.
        cap: Most iterations.
    """

    iterations: list[int]
    claims: list[Claim]
    errors: list[float]
    cap: int

    def cell(self, **about: Any) -> dict[str, Any]:
        """One entry of a result: ``about`` and the iterations' median, 95 % value and maximum.

        A QP that ran into the cap counts with the cap.
        """
        middle, most = np.percentile(self.iterations, (50, 95))
        errors = [error for error in self.errors if np.isfinite(error)]
        return {
            **about,
            "count": len(self.iterations),
            "capped": self.claims.count(Claim.MAX_ITERATIONS),
            "cap": self.cap,
            "median": float(middle),
            "p95": float(most),
            "max": max(self.iterations),
            "error": [float(np.median(errors)), max(errors)] if errors else None,
        }


def each(problems: Iterable[tuple[QP, FloatArray]], chosen: DtrnnSettings) -> Spent:
    """Solve unrelated QPs, each cold; beside each stands its solution, (n,)."""
    iterations, claims, errors = [], [], []
    for problem, x in problems:
        network = Network(problem.n, problem.m, problem.p, chosen)
        claims.append(network.solve(loaded(problem).flat))
        iterations.append(network.iterations)
        errors.append(_error(network, x))
    return Spent(iterations=iterations, claims=claims, errors=errors, cap=chosen.cap)


def until_right(problem: QP, x: FloatArray, chosen: DtrnnSettings) -> int:
    """Iterations from zero until |x - x_ref| <= ``RIGHT`` (1 + |x_ref|), found by doubling and bisection.

    Args:
        problem: The QP.
        x: Its solution, or the first components of it.
        chosen: Settings; the cap is the answer when it takes more, and no tolerance ends it before.
    """
    flat, goal = loaded(problem).flat, RIGHT * (1.0 + np.abs(x).max())

    def right(iterations: int) -> bool:
        few = replace(chosen, max_iterations=iterations, tolerance=TIGHT)
        network = Network(problem.n, problem.m, problem.p, few)
        network.solve(flat)
        return bool(network.claim <= Claim.MAX_ITERATIONS and np.abs(network.x[: len(x)] - x).max() <= goal)

    high = 1
    while not right(high):
        if high >= chosen.cap:
            return chosen.cap
        high = min(2 * high, chosen.cap)
    low = high // 2
    while high - low > max(1, high // 50):
        middle = (low + high) // 2
        low, high = (low, middle) if right(middle) else (middle, high)
    return high


def along(sequence: Recorded, chosen: DtrnnSettings, *, warm: bool, breaks: Any, step: int = 1) -> Spent:
    """Solve every ``step``-th QP of a sequence in its order.

    Args:
        sequence: The QPs.
        chosen: Settings.
        warm: Whether each starts from the answer to the one before.
        breaks: Where the structure changes and even a warm run starts cold, (K,).
        step: Distance between two QPs.
    """
    network = Network(*sequence.size, chosen)
    iterations, claims, errors = [], [], []
    for k in range(0, len(sequence), step):
        fresh = k == 0 or bool(np.any(breaks[k - step + 1 : k + 1]))
        claims.append(network.solve(sequence.packed[k], warm=warm and not fresh))
        iterations.append(network.iterations)
        errors.append(_error(network, sequence.solutions[k][0]))
    return Spent(iterations=iterations, claims=claims, errors=errors, cap=chosen.cap)


def _error(network: Network, x: FloatArray) -> float:
    """Largest |x - x_ref|; NaN without an answer."""
    return float(np.abs(network.x - x).max()) if network.claim <= Claim.MAX_ITERATIONS else np.nan


def cells(result: Mapping[str, Any], part: str, **wanted: Any) -> list[dict[str, Any]]:
    """The entries of a part of a result that have these values."""
    return [
        cell
        for cell in result["cells"]
        if cell["part"] == part and all(cell[key] == value for key, value in wanted.items())
    ]
