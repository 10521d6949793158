"""The resolved-rate law on an arm some of whose joints stand still without its knowing."""

from collections.abc import Sequence
from typing import final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.kernel.entry.study_session import StudySession

SHARE = 0.5
"""c of the variable s with dq/ds = v / (c + |v|)."""
SINGULAR = 1e-12
"""An A with a condition beyond the inverse of this is singular to rounding."""


@final
class UnawareLaw:
    """v = I_S G kappa e, G = M A' (A M A')^-1, kappa = min(K_e, v_max / |e|), A the rows' Jacobian.

    Source: docs/theory/after-a-failure.md, "The law and its clock".

    Args:
        session: Studies of the arm with the goal set.
        M: The inverse of the weights, (n, n).
        locked: Joints that do not move, by index.
        gain: K_e [1/s].
        v_max: The largest commanded |dx| [m/s], angular rows times the characteristic length.
    """

    def __init__(
        self, session: StudySession, M: FloatArray, locked: Sequence[int], gain: float, v_max: float
    ) -> None:
        self._session, self._M, self._gain, self._v_max = session, M, gain, v_max
        self.free = np.ones(session.nv, dtype=np.bool_)
        self.free[list(locked)] = False

    def values(self, q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """e (m,), A and D = -de/dq (m, n) at a configuration."""
        e, A, D, _ = self._session.values(q[None])
        return e[0], A[0], D[0]

    def error(self, q: FloatArray) -> FloatArray:
        """e, (m,) [m]."""
        return self.values(q)[0]

    def kappa(self, size: float) -> float:
        """The gain at an |e| [1/s]."""
        return self._gain if size * self._gain <= self._v_max else self._v_max / size

    def rates(self, q: FloatArray) -> tuple[FloatArray, float]:
        """I_S G e, (n,) [rad or m], and |e| [m]: the motion with gain 1."""
        e, A, _ = self.values(q)
        v = self._M @ A.T @ _solved(A @ self._M @ A.T, e)
        return np.where(self.free, v, 0.0), float(np.linalg.norm(e))

    def scaled(self, s: float, y: FloatArray) -> FloatArray:
        """d(q, t)/ds of the state (q, t), (n + 1,)."""
        v, size = self.rates(y[:-1])
        w = SHARE + float(np.linalg.norm(v))
        return np.append(v / w, 1.0 / (w * self.kappa(size)))

    def real(self, t: float, q: FloatArray) -> FloatArray:
        """dq/dt with gain 1."""
        return self.rates(q)[0]

    def slopes(self, t: float, q: FloatArray) -> FloatArray:
        """d(I_S G e)/dq, (n, n), rows and columns of joints that do not move zero.

        With lam = (A M A')^-1 e and c = M A' lam: dlam_l = (A M A')^-1 (-D_l - dA_l c - A M dA_l' lam) and
        dc_l = M (dA_l' lam + A' dlam_l). Source: docs/theory/after-a-failure.md, "How a run ends".
        """
        e, A, D, H = (value[0] for value in self._session.values(q[None], rates=True))
        M, B = self._M, A @ self._M @ A.T
        lam = _solved(B, e)
        c = M @ A.T @ lam
        turned = np.einsum("lmk,m->kl", H, lam)
        right = -D - np.einsum("lmk,k->ml", H, c) - A @ M @ turned
        slope = M @ (turned + A.T @ _solved(B, right))
        return np.asarray(np.where(self.free[:, None] & self.free[None, :], slope, 0.0))

    def contraction(self, q: FloatArray) -> FloatArray:
        """Eigenvalues of D I_S G, (m,) complex: with them |e| falls at the goal, with gain 1.

        Where fewer joints than task rows move, those of the part of G D that is theirs: the others are zero.
        """
        _, A, D = self.values(q)
        G = self._M @ A.T @ _solved(A @ self._M @ A.T, np.eye(len(A)))
        if self.free.sum() < len(A):
            return np.asarray(np.linalg.eigvals(G[self.free] @ D[:, self.free]))
        return np.asarray(np.linalg.eigvals((D * self.free) @ G))

    def newton_step(self, q: FloatArray) -> FloatArray:
        """The least step of the joints that move with D dq = e, (n,)."""
        e, _, D = self.values(q)
        return np.where(self.free, np.linalg.lstsq(D * self.free, e, rcond=1e-12)[0], 0.0)

    def flatness(self, q: FloatArray) -> float:
        """The least singular value of A over the largest."""
        sigma = np.linalg.svd(self.values(q)[1], compute_uv=False)
        return float(sigma[-1] / max(sigma[0], 1e-300))


def _solved(B: FloatArray, right: FloatArray) -> FloatArray:
    """B^-1 right; where B is singular to rounding the least squares, with rates that are huge or zero."""
    try:
        return np.asarray(np.linalg.solve(B, right))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.lstsq(B, right, rcond=SINGULAR)[0])
