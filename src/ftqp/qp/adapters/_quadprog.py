"""quadprog: the dual active-set method of Goldfarb and Idnani (1983)."""

from dataclasses import dataclass

import numpy as np
import quadprog

from ftqp.core.checks import FloatArray
from ftqp.qp.adapters.backend import Backend, Claim, QPBuffers


@dataclass(frozen=True, slots=True, kw_only=True)
class QuadprogSettings:
    """Settings of quadprog, which has no tolerance and no cap: it works to rounding and ends by itself.

    Attributes:
        regularization: What is added to the diagonal of H, as a multiple of trace(H)/n, unless H is positive
            definite; > 0. A larger one is safer and moves the answer more.
    """

    regularization: float = 1e-12


class Quadprog(Backend):
    """quadprog on x'Cx >= b rebuilt at every solve, so that warm is cold; equal bounds are equalities."""

    package = "quadprog"
    settings_type = QuadprogSettings

    def _prepare(self, qp: QPBuffers) -> None:
        n, k = qp.n, len(qp.lower)
        self._all_rows: FloatArray = np.zeros((k, n))
        self._all_rows[:n] = np.eye(n)
        self._columns: FloatArray = np.zeros((2 * k, n))
        self._least: FloatArray = np.zeros(2 * k)

    def _run(self, qp: QPBuffers, cold: bool) -> Claim:
        rows, columns, least = self._all_rows, self._columns, self._least
        rows[qp.n :] = qp.rows
        lower, upper = qp.lower, qp.upper
        equal = lower == upper
        fixed = np.flatnonzero(equal)
        below = np.flatnonzero((lower > -np.inf) & ~equal)
        above = np.flatnonzero((upper < np.inf) & ~equal)
        e, i, k = len(fixed), len(fixed) + len(below), len(fixed) + len(below) + len(above)
        columns[:e], least[:e] = rows[fixed], lower[fixed]
        columns[e:i], least[e:i] = rows[below], lower[below]
        columns[i:k], least[i:k] = -rows[above], -upper[above]
        answer = self._answer(qp, columns[:k].T if k else None, least[:k] if k else None, e)
        if isinstance(answer, Claim):
            return answer
        x, z, self.iterations = answer
        qp.x[:] = x
        # quadprog's L = f - z'(C'x - b), with z of either sign on equalities.
        qp.multipliers[:] = 0.0
        qp.multipliers[fixed] = -z[:e]
        qp.multipliers[below] = -z[e:i]
        qp.multipliers[above] += z[i:k]
        return Claim.SOLVED

    def _answer(
        self, qp: QPBuffers, columns: FloatArray | None, least: FloatArray | None, equalities: int
    ) -> tuple[FloatArray, FloatArray, int] | Claim:
        """x, multipliers and iterations, or what went wrong; quadprog reports by sentence only."""
        H = qp.H
        for attempt in range(2):
            try:
                result = quadprog.solve_qp(H, -qp.g, columns, least, equalities)
            except ValueError as error:
                if "inconsistent" in str(error):
                    return Claim.INFEASIBLE
                if "positive definite" not in str(error) or attempt == 1:
                    return Claim.FAILED
                n = qp.n
                H = qp.H + (self.settings.regularization * np.trace(qp.H) / n) * np.eye(n)
                continue
            return result[0], result[4], int(result[3].sum())
        return Claim.FAILED
