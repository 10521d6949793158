"""Networks of random QPs for the tests of the kernel, and their matrices by the formula."""

from typing import Any

import numpy as np

from ftqp.kernel.dtrnn.network_of_qp import Problem, assemble
from ftqp.kernel.dtrnn.projection import Options
from ftqp.kernel.layout.flat_arrays import memory_size

PRODUCT = Options(2, 1, 1, 0, 2000, 1.6, 1e-9)
"""The options of ftqp.qp.dtrnn.solve as it comes."""


def problem(rng: np.random.Generator, n: int, m: int, p: int, *, fixed: int = 0, equal: int = 0,
            **changes: Any) -> dict[str, Any]:  # fmt: skip
    """A feasible QP as arrays; its bounds are finite, its rows of A hard, the first bounds may be equal."""
    B, x = rng.normal(size=(n, n)), rng.uniform(-1.0, 1.0, n)
    A, C = rng.normal(size=(m, n)), rng.normal(size=(p, n))
    parts = dict(H=B @ B.T + 0.1 * np.eye(n), g=rng.normal(size=n), A=A, b=A @ x, soft=np.zeros(m), C=C,
                 l=C @ x - rng.uniform(0.1, 1.0, p), u=C @ x + rng.uniform(0.1, 1.0, p),
                 lb=x - rng.uniform(0.1, 1.0, n), ub=x + rng.uniform(0.1, 1.0, n))  # fmt: skip
    parts["lb"][:fixed] = parts["ub"][:fixed] = x[:fixed]
    parts["l"][:equal] = parts["u"][:equal] = (C @ x)[:equal]
    return parts | changes


def network_of(parts: dict[str, Any]) -> tuple[int, Any]:
    """The verdict on the bounds, and the network."""
    n, m, p = len(parts["g"]), len(parts["b"]), len(parts["l"])
    memory = np.full(memory_size(n, m, p), np.nan)
    return assemble(memory, problem_of(parts))


def problem_of(q: dict[str, Any]) -> Problem:
    """The parts of a QP as the kernel takes them."""
    n, m, p = len(q["g"]), len(q["b"]), len(q["l"])
    names = ("H", "g", "g", "A", "b", "soft", "C", "l", "u", "lb", "ub")
    return Problem(n, m, p, 1, *(q[name] for name in names))


def projected(net: Any, v: Any) -> Any:
    """P(v)."""
    return np.clip(v, net.low, net.high)


def residual_of(net: Any, u: Any) -> Any:
    """e(u)."""
    return u - projected(net, u - (net.Gamma @ u + net.z))
