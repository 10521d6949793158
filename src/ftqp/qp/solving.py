"""One QP, one call: solve it with any backend and check the answer."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.core.errors import InputError
from ftqp.qp.adapters.backend import Backend, Claim, QPBuffers
from ftqp.qp.adapters.registry import backend as backend_of
from ftqp.qp.answer_check import accepted, infeasibility, residuals
from ftqp.qp.problem import PARTS, QP, Solution, SolveStatus


def solve(
    problem: QP, backend: str | Path | Mapping[str, Any] | Backend = "active_set", **settings: Any
) -> Solution:
    """Solve a QP, cold.

    The solver's word is not taken. The status is SOLVED exactly when the KKT residuals are small enough
    (``ftqp.qp.accepted``), INFEASIBLE exactly when they are not and a Farkas certificate is found
    (``ftqp.qp.answer_check.infeasibility``), whatever the solver claimed; otherwise it is MAX_ITERATIONS if
    the solver ran into its cap, else FAILED.

    Args:
        problem: The QP.
        backend: The solver: a name, a mapping with a name and settings, the path of a profile, or a backend
            object.
        **settings: Settings of the backend, when it is given by name; unknown ones are errors.

    Returns:
        The answer, checked by its residuals.

    Raises:
        InputError: This is no QP, the backend or a setting is unknown, or the QP is larger than the backend
            can take.
        MissingPackage: The solver's package is not installed.
    """
    if not isinstance(problem, QP):
        raise InputError(f"the problem is a {type(problem).__name__}, expected an ftqp.QP")
    if settings:
        if not isinstance(backend, str) or backend.endswith(".toml"):
            names = ", ".join(settings)
            raise InputError(
                f"{names} were given together with a backend that is not a name; put them into that backend"
            )
        backend = {**settings, "name": backend}
    solver = backend_of(backend)
    buffers = loaded(problem)
    solver.setup(buffers)
    return checked(problem, solver, buffers, solver.solve(cold=True))


def loaded(problem: QP) -> QPBuffers:
    """New buffers that hold the problem; their solution is NaN."""
    buffers = QPBuffers.zeros(problem.n, problem.m, problem.p)
    for name in PARTS:
        getattr(buffers, name)[...] = getattr(problem, name)
    buffers.solution[:] = np.nan
    return buffers


def checked(problem: QP, solver: Backend, buffers: QPBuffers, claim: Claim) -> Solution:
    """What the buffers hold after a solve that ended in ``claim``, with the status by its residuals."""
    x, y, z, z_box = (part.copy() for part in (buffers.x, buffers.y, buffers.z, buffers.z_box))
    found, certificate = residuals(problem, x, y, z, z_box), None
    if accepted(problem, found, x, y):
        status = SolveStatus.SOLVED
    elif (certificate := infeasibility(problem)) is not None:
        status = SolveStatus.INFEASIBLE
    else:
        known = claim in (Claim.MAX_ITERATIONS, Claim.OUT_OF_TIME)
        status = SolveStatus[claim.name] if known else SolveStatus.FAILED
    return Solution(
        x=x, y=y, z=z, z_box=z_box, status=status, iterations=solver.iterations, residuals=found,
        backend=solver.name, certificate=certificate,
    )  # fmt: skip
