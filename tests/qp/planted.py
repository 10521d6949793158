"""QPs with a known solution: an active set is chosen first, then data that make it optimal."""

from dataclasses import dataclass

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.qp.adapters.backend import QPBuffers
from ftqp.qp.problem import QP


@dataclass(frozen=True, slots=True, kw_only=True)
class Planted:
    """A QP and its only solution (unique when H is definite and the active rows are independent)."""

    problem: QP
    x: FloatArray
    y: FloatArray
    z: FloatArray
    z_box: FloatArray


def hessian(rng, n, kind):
    """``identity``, ``diagonal`` (ones, 1e3), ``dense`` (condition 1e2) or ``mtn`` (M'M, condition 1e8)."""
    if kind == "identity":
        return np.eye(n)
    if kind == "diagonal":
        return np.diag(np.where(np.arange(n) < (n + 1) // 2, 1.0, 1e3))
    q, _ = np.linalg.qr(rng.normal(size=(n, n)))
    condition = {"dense": 1e2, "mtn": 1e8}[kind]
    H = (q * np.logspace(0.0, -np.log10(condition), n)) @ q.T
    return 0.5 * (H + H.T)


def planted(rng, n=7, m=3, p=4, *, kind="dense", fixed=0, equal_rows=0, unbounded=0.25):
    """A random QP whose solution is known.

    Args:
        rng: Source of randomness.
        n: Variables.
        m: Equality rows, as many of them as leave freedom are independent.
        p: Two-sided rows.
        kind: The kind of Hessian.
        fixed: Variables with lb == ub.
        equal_rows: Rows with l == u.
        unbounded: Share of bounds that are infinite.
    """
    H = hessian(rng, n, kind)
    A, C, x = rng.normal(size=(m, n)), rng.normal(size=(p, n)), rng.normal(size=n)
    # The active rows must stay independent: equalities, fixed and active ones together fewer than variables.
    freedom = max(0, n - m - fixed - equal_rows)
    at_bound = int(rng.integers(0, freedom // 2 + 1))
    at_row = min(p - equal_rows, int(rng.integers(0, freedom - at_bound + 1)) // 2)
    lb, ub, z_box = _side(rng, x, fixed, at_bound, unbounded)
    l, u, z = _side(rng, C @ x, equal_rows, at_row, unbounded)
    y = rng.normal(size=m)
    g = -(H @ x + A.T @ y + C.T @ z + z_box)
    return Planted(problem=QP(H, g, A, A @ x, C, l, u, lb, ub), x=x, y=y, z=z, z_box=z_box)


def _side(rng, value, equal, active, unbounded):
    """Bounds around ``value`` and multipliers; in a random order the first are equal, the next active."""
    k = len(value)
    low, high, z = value - rng.uniform(0.1, 2.0, k), value + rng.uniform(0.1, 2.0, k), np.zeros(k)
    low[rng.random(k) < unbounded] = -np.inf
    high[rng.random(k) < unbounded] = np.inf
    order = rng.permutation(k)
    for i in order[:equal]:
        low[i] = high[i] = value[i]
        z[i] = rng.normal()
    for i in order[equal : equal + active]:
        if rng.random() < 0.5:
            high[i], z[i] = value[i], rng.uniform(0.1, 2.0)
        else:
            low[i], z[i] = value[i], -rng.uniform(0.1, 2.0)
    return low, high, z


def infeasible(rng, n=7, m=3, p=4):
    """A QP whose equalities are out of reach of its box."""
    A = rng.normal(size=(m, n))
    reach = np.abs(A).sum(axis=1)
    b = 1.5 * reach * rng.choice([-1.0, 1.0], m)
    return QP(
        hessian(rng, n, "dense"),
        rng.normal(size=n),
        A,
        b,
        rng.normal(size=(p, n)),
        -np.ones(p),
        np.ones(p),
        -np.ones(n),
        np.ones(n),
    )


def fill(buffers, problem):
    """``buffers``, holding ``problem`` now."""
    for name in ("H", "g", "A", "b", "C", "l", "u", "lb", "ub"):
        getattr(buffers, name)[...] = getattr(problem, name)
    return buffers


def buffers(problem):
    """New buffers that hold ``problem``."""
    return fill(QPBuffers.zeros(problem.n, problem.m, problem.p), problem)


def flat_qp(seed):
    """A QP with a solution, an H of any rank below full at any scale, and no box."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 31))
    rank, m, p = int(rng.integers(1, n)), int(rng.integers(0, n // 3 + 2)), int(rng.integers(0, 2 * n))
    F = rng.normal(size=(rank, n))
    H = F.T @ F * 10.0 ** rng.uniform(-3.0, 3.0)
    A, C, x = rng.normal(size=(m, n)), rng.normal(size=(p, n)), rng.normal(size=n)
    l, u, z = C @ x - rng.uniform(0.0, 1.0, p), C @ x + rng.uniform(0.0, 1.0, p), np.zeros(p)
    active = rng.random(p) < 0.3
    u[active], z[active] = (C @ x)[active], rng.uniform(0.1, 2.0, int(active.sum()))
    rows = (C, l, u) if p else ()
    return QP(H, -(H @ x + A.T @ rng.normal(size=m) + C.T @ z), A, A @ x, *rows)


def contradicting_qp(seed, margin, size=1.0):
    """A QP whose rows, weighted and added, ask for less than 0 by a margin, of points far off by ``size``."""
    rng = np.random.default_rng(seed)
    n, p = int(rng.integers(2, 12)), int(rng.integers(2, 20))
    m, some = int(rng.integers(0, n // 2 + 1)), int(rng.integers(1, p))
    A, C, x = rng.normal(size=(m, n)), rng.normal(size=(p, n)), size * rng.normal(size=n)
    weights = np.where(np.arange(p) < some, rng.uniform(0.1, 1.0, p), 0.0)
    u, b, mu = C @ x + np.where(weights > 0.0, 0.0, rng.uniform(0.0, 1.0, p)), A @ x, rng.normal(size=m)
    last, below = -(weights @ C + mu @ A), -(weights @ u + mu @ b) - margin
    return QP(np.eye(n), rng.normal(size=n), A, b, np.vstack([C, last]), None, np.append(u, below))
