"""The backends under test, and how exactly each must reach a planted solution."""

from importlib.util import find_spec

import pytest

EXACT, ITERATIVE = 1e-9, 1e-6

needs_quadprog = pytest.mark.skipif(find_spec("quadprog") is None, reason='needs pip install -e ".[solvers]"')
QUADPROG = pytest.param("quadprog", marks=[pytest.mark.solvers, needs_quadprog])
NATIVE = ["active_set", "dtrnn", "daqp", QUADPROG, "osqp", "proxqp"]
ADAPTED = ["qpsolvers:daqp", "qpsolvers:osqp", "qpsolvers:proxqp"]


def tolerance(name: str) -> float:
    """Largest error of a component of x that a backend may make."""
    return ITERATIVE if name.removeprefix("qpsolvers:") in ("osqp", "proxqp") else EXACT
