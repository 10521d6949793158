"""The recorded problems as a test set of qpbenchmark, whose own command line runs them.

    qpbenchmark solvers/qpbenchmark_set.py --results-path mine.csv run --solver daqp --author you
    python solvers/qpbenchmark_set.py --results-path mine.csv run --solver ftqp_active_set --author you

The two are the same, but for the names after ``--solver``: ours are known only to the second, because
qpbenchmark reads the names before it reads this file. Without ``--solver`` both run every solver, ours too.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import qpbenchmark
import qpbenchmark.benchmark
import qpsolvers
import qpsolvers.solvers
from bench.contenders import Contender, split
from comparison.recorded import Recorded, recorded
from comparison.sequences import sequences
from comparison.truth import Fact, truth
from qpbenchmark.solver_settings import SolverSettings

from ftqp.core.checks import FloatArray
from ftqp.qp import QP, Claim, QPBuffers

EACH = 6
"""Problems of each sequence, spread over it: qpbenchmark's tables slow down with thousands of them."""
OURS = {f"ftqp_{name}": Contender(name=name, settings={"name": name}) for name in ("active_set", "dtrnn")}
"""Our own solvers, under the names that qpbenchmark gets."""


class QpbenchmarkSet(qpbenchmark.TestSet):
    """QPs of ftqp's planner, solvable ones only: qpbenchmark knows no right answer to the others."""

    def __init__(self) -> None:
        register()
        self._problems = [
            problem for name, found in sequences().items() for problem in _chosen(recorded(name, found))
        ]
        super().__init__()

    @property
    def title(self) -> str:
        """Title of the report."""
        return "QPs of a fault-tolerant robot arm"

    @property
    def description(self) -> str:
        """Section of the report."""
        return (
            "Recorded in closed loop by ftqp's planner: 6 to 30 joints, velocity and acceleration level, "
            "healthy and failed joints. Dense, strictly convex but for rounding, with bounds on the joints, "
            "infeasible ones left out. qpbenchmark solves each cold, through qpsolvers: its times hold "
            "conversions and the set-up, which are most of them for QPs that take microseconds, and a mean "
            "shifted by 10 s is an arithmetic one here."
        )

    @property
    def sparse_only(self) -> bool:
        """False: dense solvers are welcome."""
        return False

    def define_solver_settings(self) -> None:
        """qpbenchmark's own settings; the same tolerances for our DTRNN. Our active set has no settings."""
        super().define_solver_settings()
        if "ftqp_dtrnn" in self.solvers:
            for name in ("high_accuracy", "mid_accuracy", "low_accuracy"):
                self.solver_settings[name].set_param("ftqp_dtrnn", "tolerance", self.tolerances[name].dual)

    def __iter__(self) -> Iterator[qpbenchmark.Problem]:
        """The problems, each with the name of its sequence and its position there."""
        return iter(self._problems)


def register() -> None:
    """Enter our solvers into the tables of qpsolvers and qpbenchmark, which have no function for that."""
    for contender in split(list(OURS.values()))[0]:
        name = f"ftqp_{contender.name}"
        if name not in qpsolvers.available_solvers:
            qpsolvers.available_solvers.append(name)
            qpsolvers.dense_solvers.append(name)
        qpsolvers.solvers.solve_function[name] = _solver(contender)
        SolverSettings.IMPLEMENTED_SOLVERS.add(name)


def _solver(contender: Contender) -> Callable[..., qpsolvers.Solution]:
    """One of ours as qpsolvers calls a solver."""

    def solve(
        problem: qpsolvers.Problem, initvals: Any = None, verbose: bool = False, **settings: Any
    ) -> qpsolvers.Solution:
        P, q, G, h, A, b, lb, ub = problem.unpack()
        m, p = (0 if side is None else len(side) for side in (b, h))
        qp = QPBuffers.zeros(len(q), m, p)
        qp.H[:], qp.g[:] = P, q
        for part, given in (("A", A), ("b", b), ("C", G), ("u", h), ("lb", lb), ("ub", ub)):
            if given is not None:
                getattr(qp, part)[...] = given
        qp.l[:] = -np.inf
        solver = Contender(name=contender.name, settings={**contender.settings, **settings}).made()
        solver.setup(qp)
        solution = qpsolvers.Solution(problem)
        solution.found = solver.solve(cold=True) is Claim.SOLVED
        if solution.found:
            solution.x, solution.y, solution.z, solution.z_box = qp.x, qp.y, qp.z, qp.z_box
        return solution

    solve(qpsolvers.Problem(np.eye(1), np.ones(1)))  # what has to be compiled is not timed
    return solve


def _chosen(sequence: Recorded) -> list[qpbenchmark.Problem]:
    """Solvable problems spread evenly over a sequence."""
    places = np.unique(np.linspace(0, len(sequence) - 1, EACH).round().astype(int))
    problems = [sequence.problems[k] for k in places]
    said = None if sequence.feasible is None else sequence.feasible[places]
    facts = truth(problems, [sequence.solutions[k] for k in places], said).facts
    return [
        translated(problem, f"{sequence.name}-{k:04d}")
        for k, problem, fact in zip(places, problems, facts, strict=True)
        if fact is Fact.SOLVABLE
    ]


def translated(problem: QP, name: str) -> qpbenchmark.Problem:
    """A QP as qpbenchmark has it: equal sides become equalities, the others one row a finite side."""
    fixed = problem.l == problem.u
    below, above = ~fixed & np.isfinite(problem.l), ~fixed & np.isfinite(problem.u)
    G = np.vstack([-problem.C[below], problem.C[above]])
    h = np.concatenate([-problem.l[below], problem.u[above]])
    A = np.vstack([problem.A, problem.C[fixed]])
    b = np.concatenate([problem.b, problem.l[fixed]])
    return qpbenchmark.Problem(
        problem.H.copy(),
        problem.g.copy(),
        *_rows(G, h),
        *_rows(A, b),
        problem.lb.copy(),
        problem.ub.copy(),
        name=name,
    )


def _rows(matrix: FloatArray, side: FloatArray) -> tuple[FloatArray | None, FloatArray | None]:
    return (matrix, side) if len(side) else (None, None)


if __name__ == "__main__":
    register()
    qpbenchmark.benchmark.main(test_set_path=Path(__file__))
