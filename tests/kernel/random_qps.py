"""Random QPs of the kernel's form.

min 1/2 x'Hx + g'x + sum s_k^2/(2 soft_k),  Ax + s = b,  l <= Cx <= u,  lb <= x <= ub
"""

from dataclasses import dataclass, replace
from typing import Any

import daqp
import numpy as np

FEASIBLE = (
    "plain",
    "compliant",
    "locked",
    "equalities",
    "unbounded",
    "duplicates",
    "vertex",
    "locked compliant",
    "stiff",
)
INFEASIBLE = (
    "task out of reach",
    "opposite rows",
    "box against rows",
    "contradicting equalities",
    "locked against task",
)
EQUALITY = 5
"""daqp's mark of a row that holds with equality."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One QP; ``H`` is diagonal when ``dense`` is false, a row with ``soft`` 0 is hard."""

    H: Any
    dense: bool
    g: Any
    A: Any
    b: Any
    soft: Any
    C: Any
    l: Any
    u: Any
    lb: Any
    ub: Any

    def objective(self, x: Any) -> float:
        """The objective at x with the slacks that belong to it; hard rows are not looked at."""
        compliant = self.soft > 0.0
        s = (self.b - self.A @ x)[compliant]
        return float(0.5 * x @ self.H @ x + self.g @ x + 0.5 * np.sum(s * s / self.soft[compliant]))

    def violation(self, x: Any) -> float:
        """By how much x breaks hard rows, two-sided rows or the box."""
        hard = self.soft == 0.0
        parts = [
            np.abs(self.A @ x - self.b)[hard],
            self.l - self.C @ x,
            self.C @ x - self.u,
            self.lb - x,
            x - self.ub,
        ]
        return float(np.concatenate([[0.0], *parts]).max())

    def standard(self) -> tuple[Any, Any, Any, Any, Any, Any]:
        """H, g, A, upper, lower, sense of the same QP for daqp, slacks as variables, box rows first."""
        n, m = len(self.g), len(self.b)
        compliant = np.flatnonzero(self.soft > 0.0)
        k, mean = len(compliant), np.trace(self.H) / n
        H = np.zeros((n + k, n + k))
        H[:n, :n] = self.H
        H[n:, n:] = mean * np.eye(k)
        rows = np.zeros((m + len(self.l), n + k))
        rows[:m, :n], rows[m:, :n] = self.A, self.C
        rows[compliant, n + np.arange(k)] = np.sqrt(self.soft[compliant] * mean)
        free = np.full(k, np.inf)
        upper = np.concatenate([self.ub, free, self.b, self.u])
        lower = np.concatenate([self.lb, -free, self.b, self.l])
        sense = np.where(lower == upper, EQUALITY, 0).astype(np.intc)
        return H, np.concatenate([self.g, np.zeros(k)]), rows, upper, lower, sense


def hessian(rng: np.random.Generator, n: int, dense: bool, stiff: bool = False) -> Any:
    """Positive definite, condition up to 1e4, or about 1e8 when stiff."""
    spread = 10.0 ** rng.uniform(-2.0, 2.0, n) if rng.random() < 0.5 else np.ones(n)
    if stiff:
        spread = 10.0 ** np.linspace(-4.0, 4.0, n)
    if not dense:
        return np.diag(spread)
    if stiff:
        Q, _ = np.linalg.qr(rng.normal(size=(n, n)))
        H = (Q * spread) @ Q.T
        return 0.5 * (H + H.T)
    B = rng.normal(size=(n, n)) / np.sqrt(n)
    H = B.T @ (spread[:, None] * B) + 0.01 * np.trace(np.diag(spread)) / n * np.eye(n)
    return 0.5 * (H + H.T)


def feasible(rng: np.random.Generator, kind: str, dense: bool) -> Case:
    """A QP with a feasible point, of one of the kinds ``FEASIBLE``."""
    n = int(rng.integers(2, 13)) if rng.random() < 0.9 else int(rng.integers(13, 34))
    m, p = int(rng.integers(0, min(n, 7))), int(rng.integers(0, min(n, 20) + 1))
    H, x = hessian(rng, n, dense, kind == "stiff"), rng.normal(size=n)
    g, A, C = (
        rng.normal(size=n) * 10.0 ** rng.uniform(-1, 2),
        rng.normal(size=(m, n)),
        rng.normal(size=(p, n)),
    )
    lb, ub = x - rng.uniform(0.05, 2.0, n), x + rng.uniform(0.05, 2.0, n)
    l, u = C @ x - rng.uniform(0.05, 2.0, p), C @ x + rng.uniform(0.05, 2.0, p)
    soft, b = np.zeros(m), A @ x
    if "compliant" in kind:
        soft = np.where(rng.random(m) < 0.8, 10.0 ** rng.uniform(-8.0, 0.0, m), 0.0)
        b = b + np.where(soft > 0.0, rng.normal(size=m) * 3.0, 0.0)
    if "locked" in kind:
        i = rng.permutation(n)[: int(rng.integers(1, max(2, n - m)))]
        lb[i] = ub[i] = x[i]
    if kind == "equalities":
        j = rng.permutation(p)[: max(0, min(p, n - m) // 2)]
        l[j] = u[j] = (C @ x)[j]
    if kind == "unbounded":
        for bound, sign in ((lb, -1), (ub, 1), (l, -1), (u, 1)):
            bound[rng.random(len(bound)) < 0.6] = sign * np.inf
    if kind == "duplicates":
        A, b, soft = _doubled(rng, A), _doubled(rng, b), _doubled(rng, soft)
        if p > 2:
            C[1], l[1], u[1] = C[0], l[0], u[0]
            C[2] = np.eye(n)[0]  # the row says what the box says
            l[2], u[2] = lb[0], ub[0]
    if kind == "vertex":  # more limits meet in the feasible point than there are variables
        ub[rng.random(n) < 0.7] = 0.0
        lb[ub == 0.0] = -1.0
        x = np.minimum(np.where(ub == 0.0, 0.0, x), ub)
        b, u, l = A @ x, C @ x, C @ x - 1.0
        g = g - 3.0 * np.abs(g)
    return Case(H=H, dense=dense, g=g, A=A, b=b, soft=soft, C=C, l=l, u=u, lb=lb, ub=ub)


def _doubled(rng: np.random.Generator, rows: Any) -> Any:
    """The rows with the first one once more at the end."""
    return np.concatenate([rows, rows[:1]]) if len(rows) else rows


def unplanned(rng: np.random.Generator, dense: bool) -> Case:
    """A QP of which nobody knows beforehand whether it has a feasible point."""
    case = feasible(rng, "plain", dense)
    n, m, p = len(case.g), len(case.b), len(case.l)
    middle = 2.0 * rng.normal(size=p)
    lb = rng.normal(size=n) - 1.0
    width = rng.uniform(0.2, 3.0, p)
    return replace(
        case,
        b=rng.normal(size=m),
        l=middle - width,
        u=middle + width,
        lb=lb,
        ub=lb + rng.uniform(0.5, 3.0, n),
    )


def infeasible(rng: np.random.Generator, kind: str, dense: bool) -> Case:
    """A QP without a feasible point, by a margin, of one of the kinds ``INFEASIBLE``."""
    case = feasible(rng, "plain", dense)
    while len(case.b) < 1 or len(case.l) < 2:
        case = feasible(rng, "plain", dense)
    n, C, l, u = len(case.g), case.C.copy(), case.l.copy(), case.u.copy()
    b, lb, ub = case.b.copy(), case.lb.copy(), case.ub.copy()
    k = int(rng.integers(len(b)))
    reach = np.maximum(np.abs(lb), np.abs(ub))
    if kind == "task out of reach":
        b[k] = rng.choice([-1.0, 1.0]) * (np.abs(case.A[k]) @ reach + 0.1)
    elif kind == "opposite rows":
        C[1], l[1], u[1] = -C[0], -l[0] + 0.1, np.inf
    elif kind == "box against rows":
        l[0], u[0] = np.abs(C[0]) @ reach + 0.1, np.inf
    elif kind == "contradicting equalities":
        C[0], l[0], u[0] = case.A[k], b[k] + 0.1, b[k] + 0.1
    else:
        lb[:] = ub[:] = rng.normal(size=n)
    return replace(case, b=b, C=C, l=l, u=u, lb=lb, ub=ub)


def nudged(rng: np.random.Generator, case: Case) -> Case:
    """The QP a tick later: all vectors a little different, hard rows and locked variables as they are."""
    n, p = len(case.g), len(case.l)
    free, two_sided = case.lb < case.ub, case.l < case.u
    soft = case.soft > 0.0
    return replace(
        case,
        g=case.g * (1.0 + 0.2 * rng.normal(size=n)),
        b=case.b + soft * 0.1 * rng.normal(size=len(case.b)),
        lb=case.lb - free * rng.uniform(0.0, 0.04, n),
        ub=case.ub + free * rng.uniform(0.0, 0.04, n),
        l=case.l - two_sided * rng.uniform(0.0, 0.04, p),
        u=case.u + two_sided * rng.uniform(0.0, 0.04, p),
    )


def by_daqp(case: Case) -> Any:
    """daqp's x, or None when it says infeasible (-1) or that the equalities contradict each other (-6)."""
    H, g, rows, upper, lower, sense = case.standard()
    x, _, flag, _ = daqp.solve(
        H, g, rows, upper, lower, sense, primal_tol=1e-11, dual_tol=1e-12, iter_limit=10_000
    )
    assert flag in (1, -1, -6), f"daqp gave up with flag {flag}"
    return x[: len(case.g)] if flag == 1 else None
