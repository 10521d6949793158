"""The resolved-rate law on an arm some of whose joints stand still without its knowing."""

from collections.abc import Sequence
from typing import Any, final

import numpy as np

from ftqp.analysis.goals import GoalStudy
from ftqp.core.checks import FloatArray
from ftqp.kernel.layout.law_room import SHARE

SINGULAR = 1e-12
"""A condition of A M A' beyond the inverse of this is singular to rounding: the least rates are taken."""


@final
class UnawareLaw:
    """v = I_S G kappa e, G = M A' (A M A')^-1, kappa = min(K_e, v_max / |e|), A the rows' Jacobian.

    Source: docs/theory/after-a-failure.md, "The law and its clock".
    """

    def __init__(
        self, study: GoalStudy, M: FloatArray, locked: Sequence[int], gain: float = 1.0, v_max: float = np.inf
    ) -> None:
        self._study, self._M, self._gain, self._v_max = study, M, gain, v_max
        self.free = np.ones(len(M), dtype=np.bool_)
        self.free[list(locked)] = False

    def values(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """e, (..., m), and A, (..., m, n), at configurations, (..., n)."""
        e, A, _, _ = self._study.free.values(np.atleast_2d(q))
        return (e, A) if q.ndim > 1 else (e[0], A[0])

    def sizes(self, q: FloatArray) -> FloatArray:
        """|e| [m]."""
        return np.asarray(np.linalg.norm(self.values(q)[0], axis=-1))

    def kappa(self, size: float) -> float:
        """The gain at an |e| [1/s]."""
        return self._gain if size * self._gain <= self._v_max else self._v_max / size

    def rates(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """I_S G e, (..., n) [rad or m], and |e| [m]: the motion with gain 1."""
        e, A = self.values(q)
        MAt = self._M @ np.swapaxes(A, -1, -2)
        v = MAt @ np.linalg.pinv(A @ MAt, rcond=SINGULAR, hermitian=True) @ e[..., None]
        return np.where(self.free, v[..., 0], 0.0), np.linalg.norm(e, axis=-1)

    def scaled(self, s: float, y: FloatArray) -> FloatArray:
        """d(q, t)/ds of the state (q, t), (n + 1,)."""
        v, size = self.rates(y[:-1])
        w = SHARE + float(np.linalg.norm(v))
        return np.append(v / w, 1.0 / (w * self.kappa(float(size))))

    def between(self, begin: FloatArray, end: FloatArray, length: float, share: Any) -> FloatArray:
        """The state (q, t) at shares, (..., 1), of the way between two so far apart in s, of third order."""
        rest, x, h = 1.0 - share, share, length
        first, last = self.scaled(0.0, begin), self.scaled(0.0, end)
        held = rest * rest * ((1.0 + 2.0 * x) * begin + x * h * first)
        return np.asarray(held + x * x * ((1.0 + 2.0 * rest) * end - rest * h * last))
