"""A QP with compliant rows in other units, in which the multipliers of rows that give way are small."""

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.qp.adapters.buffers import QPBuffers


class EasedQP:
    """The same QP with the objective times s and slacks counted in units of their rows.

        min s (1/2 x'Hx + g'x) + 1/2 sum (s / soft_k) r_k^2,   A x + r = b,   s = min soft_k

    with r = c t. Where a task cannot be followed, multipliers of the QP as a planner poses it reach 1e8, and
    a method that approaches them step by step, and ends at an absolute tolerance, gets there late or never;
    here they are as large as what is left of the rows. Where a task is followed it is the other way round:
    all but the rows hardly counts. So this is for QPs whose rows give way.
    """

    def __init__(self, n: int, m: int, p: int) -> None:
        self.buffers = QPBuffers.zeros(n, m, p)
        self.soft: FloatArray = np.ones(m)
        self._units = np.ones(n)
        self._box_units = np.ones(n + m + p)
        self._objective = 1.0

    def pose(self, qp: QPBuffers, soft: FloatArray) -> None:
        """Write a QP into the buffers, in these units."""
        posed, units, inner = self.buffers, self._units, qp.n - qp.m
        self._objective = float(soft.min())
        np.divide(soft, self._objective, out=self.soft)
        np.divide(1.0, qp.A[:, inner:].diagonal(), out=units[inner:])
        np.divide(1.0, units, out=self._box_units[: qp.n])
        np.multiply(qp.H, units * (self._objective * units)[:, None], out=posed.H)
        np.multiply(qp.g, self._objective * units, out=posed.g)
        np.multiply(qp.rows, units, out=posed.rows)
        posed.lower[:], posed.upper[:] = qp.lower, qp.upper  # only slacks change their units: they have none

    def answer(self, qp: QPBuffers) -> None:
        """Write the solution that the buffers hold into those of the QP, in its units."""
        posed = self.buffers
        np.multiply(posed.x, self._units, out=qp.x)
        np.multiply(posed.multipliers, self._box_units / self._objective, out=qp.multipliers)


def compliance(qp: QPBuffers) -> FloatArray | None:
    """How soft each equality row is, soft_k = c_k^2 / h_k, (m,); None where rows have no slacks.

    The last m variables t are slacks where each is in one row alone, A x + c t = b, costs h t^2 / 2 and
    nothing else, and has no bounds. Minimised over t, this is |A x - b|^2 / (2 soft): the multiplier of a row
    is what is left of it over soft, and grows without measure where no x within the bounds comes near b.
    """
    n, m = qp.n, qp.m
    inner = n - m
    if m == 0 or inner <= 0:
        return None
    columns, costs = qp.A[:, inner:], qp.H[inner:]
    c, h = columns.diagonal(), costs[:, inner:].diagonal()
    if (
        np.count_nonzero(columns) != m
        or np.count_nonzero(costs) != m
        or not (c != 0.0).all()
        or not (h > 0.0).all()
        or qp.g[inner:].any()
        or qp.C[:, inner:].any()
        or np.isfinite(qp.lb[inner:]).any()
        or np.isfinite(qp.ub[inner:]).any()
    ):
        return None
    return np.asarray(c * c / h)
