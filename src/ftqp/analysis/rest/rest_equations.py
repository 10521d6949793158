"""The equations of a rest with one joint locked, in unknowns that stay regular where J is singular."""

from typing import final

import numpy as np

from ftqp.analysis.goals import GoalStudy
from ftqp.analysis.rest.linearisation import still_joints
from ftqp.core.checks import BoolArray, FloatArray

LARGEST_TURN = 0.7
"""Largest change of a joint in a step of ``solved`` [rad or m]."""


@final
class RestEquations:
    """Psi(z) = [M A' mu - beta e_i; gamma e - alpha a_i; two norms] = 0, z = (q, mu, beta, alpha, gamma).

    M is W^-1. M A' mu = beta e_i says that the arm can command joint i alone, gamma e = alpha a_i that it
    does. The norms L^2 mu'mu + beta^2 and alpha^2 + gamma^2 are 1, L the characteristic length. n + m + 2
    equations for n + m + 3 unknowns: rests are curves. beta is 0 where A is singular, gamma where joint i
    does not move the tip; (mu, beta) and (alpha, gamma) count up to their signs. Joints that never move the
    tip and are not commanded stand at their neutral values, which replaces their rows.
    Source: docs/theory/unidentified-failures.md, "Rest".
    """

    def __init__(self, study: GoalStudy, M: FloatArray, i: int) -> None:
        self.study, self.i = study, i
        self.M = M * (len(M) / np.trace(M))
        self.n, self.m = study.robot.nv, study.m
        self.size = self.n + self.m + 3
        self._still = still_joints(study, M)
        self._stand = study.robot.neutral[self._still]

    def values(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Psi, (k, n + m + 2), and its derivative, (k, n + m + 2, n + m + 3)."""
        n, m, i, k = self.n, self.m, self.i, len(z)
        mu, (beta, alpha, gamma) = z[:, n : n + m], z[:, n + m :].T
        e, A, D, H = self.study.free.values(z[:, :n], rates=True)
        MAt = self.M @ np.swapaxes(A, 1, 2)
        square = self.study.robot.length**2
        psi = np.empty((k, n + m + 2))
        psi[:, :n] = np.einsum("kia,ka->ki", MAt, mu)
        psi[:, i] -= beta
        psi[:, n : n + m] = gamma[:, None] * e - alpha[:, None] * A[:, :, i]
        psi[:, -2] = square * (mu * mu).sum(axis=1) + beta * beta - 1.0
        psi[:, -1] = alpha * alpha + gamma * gamma - 1.0
        d = np.zeros((k, n + m + 2, self.size))
        d[:, :n, :n] = np.swapaxes(np.einsum("klan,ka->kln", H, mu) @ self.M, 1, 2)
        d[:, :n, n : n + m] = MAt
        d[:, i, n + m] = -1.0
        turned = np.swapaxes(H[:, :, :, i], 1, 2)
        d[:, n : n + m, :n] = -gamma[:, None, None] * D - alpha[:, None, None] * turned
        d[:, n : n + m, n + m + 1] = -A[:, :, i]
        d[:, n : n + m, n + m + 2] = e
        d[:, -2, n : n + m] = 2.0 * square * mu
        d[:, -2, n + m] = 2.0 * beta
        psi[:, self._still] = z[:, self._still] - self._stand
        d[:, self._still] = 0.0
        d[:, self._still, self._still] = 1.0
        d[:, -1, n + m + 1] = 2.0 * alpha
        d[:, -1, n + m + 2] = 2.0 * gamma
        return psi, d

    def started(self, q: FloatArray) -> FloatArray:
        """Unknowns near configurations, (k, n + m + 3): the best multipliers there."""
        q = q.copy()
        q[:, self._still] = self._stand
        e, A, _, _ = self.study.free.values(q)
        mu = np.linalg.pinv(self.M @ np.swapaxes(A, 1, 2))[:, :, self.i]
        size = np.sqrt(self.study.robot.length**2 * (mu * mu).sum(axis=1) + 1.0)
        a = A[:, :, self.i]
        alpha = (a * e).sum(axis=1) / np.maximum((a * a).sum(axis=1), 1e-12)
        both = np.hypot(alpha, 1.0)
        return np.column_stack([q, mu / size[:, None], 1.0 / size, alpha / both, 1.0 / both])

    def solved(self, z: FloatArray, *, held: bool, iterations: int = 60) -> tuple[FloatArray, BoolArray]:
        """Unknowns brought to a rest by damped Gauss-Newton steps, and which of them got there, (k,)."""
        z = z.copy()
        columns = np.ones(self.size)
        columns[self.i] = 0.0 if held else 1.0
        damping = np.full(len(z), 1e-2)
        psi, d = self.values(z)
        cost = (psi * psi).sum(axis=1)
        open_ = np.arange(len(z))
        for _ in range(iterations):
            open_ = open_[cost[open_] > 1e-24]
            if not len(open_):
                break
            J = d[open_] * columns
            normal = J @ np.swapaxes(J, 1, 2)
            scale = np.trace(normal, axis1=1, axis2=2) / normal.shape[1]
            normal += (damping[open_] * np.minimum(cost[open_], 1.0) * scale + 1e-15 * scale)[
                :, None, None
            ] * np.eye(normal.shape[1])
            y = np.linalg.solve(normal, psi[open_][:, :, None])
            step = -(np.swapaxes(J, 1, 2) @ y)[:, :, 0]
            largest = np.abs(step[:, : self.n]).max(axis=1)
            step *= np.minimum(1.0, LARGEST_TURN / np.maximum(largest, 1e-300))[:, None]
            trial = z[open_] + step
            psi_new, d_new = self.values(trial)
            cost_new = (psi_new * psi_new).sum(axis=1)
            better = cost_new < cost[open_]
            won = open_[better]
            z[won], psi[won], d[won], cost[won] = (
                trial[better],
                psi_new[better],
                d_new[better],
                cost_new[better],
            )
            damping[won] *= 0.2
            damping[open_[~better]] *= 8.0
        return z, np.asarray(cost < 1e-20)
