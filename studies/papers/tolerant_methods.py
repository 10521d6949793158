"""Three published ways to go on after a lock, each a velocity from measured joints, wired alike.

All of them follow J v = xdot + K e with the rotation's rows times the arm's characteristic length, know of
the lock at once, and send speeds within the limits v_max; none of them knows limits of acceleration.
"""

from typing import Protocol

import numpy as np
import qpsolvers
from scipy.optimize import minimize

import ftqp

GAIN = 20.0
"""K [1/s], that of ftqp's task by default."""
INTEGRAL = 100.0
"""kappa of the integral [1/s2]: K^2 / 4, with which the error dies out without swinging."""
ROOM = 2.0
"""How fast a joint may approach its end [1/s]: Li and Zhang's kappa, which turns ranges into speeds."""
HALT = 1.0
"""Seconds that the arm is given to come to its halt [s]; longer where limits of speed ask for it."""
RESTARTS = 4
NEAREST = 1e-6
"""Weight of v'v beside the task's rate where not all of it can be had [m2]: (1 mm)^2."""


class Method(Protocol):
    """Gives a speed a tick, and may stop the clock of the path."""

    def step(self, q, pose, twist):
        """The speeds, (n,) [rad/s], and whether the path's time goes on."""

    def lock(self, joint: int, q, v) -> None:
        """The joint is locked from now on, at (q, v)."""


class Tip:
    """What all three read of the arm: J and the rate that is asked for, lengths throughout."""

    def __init__(self, robot: ftqp.Robot, dt: float) -> None:
        self.robot, self.dt = robot, dt
        self.works = np.ones(robot.nv, dtype=bool)
        self.scale = np.array([1.0, 1.0, 1.0, *3 * [robot.length]])

    def error(self, q, pose):
        """The tip's error, (6,) [m]."""
        T = self.robot.pose(q)
        return self.scale * np.concatenate([pose[:3, 3] - T[:3, 3], vector(pose[:3, :3] @ T[:3, :3].T)])

    def jacobian(self, q):
        """J without the columns of locked joints, (6, n) [m]."""
        J = self.scale[:, None] * self.robot.jacobian(q)
        J[:, ~self.works] = 0.0
        return J


class EqualityLocks:
    """min v'v / 2 with J v = xdot + K e, v_i = 0 of a locked joint, and speeds and ranges as bounds.

    v_min = max(-v_max, kappa (q_min - q)), v_max likewise. The scheme says nothing of where no v keeps all of
    it; there the nearest rate within the bounds is taken.

    Source: Li and Zhang 2012, a velocity-level scheme with equality constraints of the faulty joints.
    """

    def __init__(self, robot: ftqp.Robot, dt: float) -> None:
        self._tip = Tip(robot, dt)

    def step(self, q, pose, twist):
        """One QP."""
        tip, limits = self._tip, self._tip.robot.limits
        low = np.maximum(-limits.v_max, ROOM * (limits.q_min - q))
        high = np.minimum(limits.v_max, ROOM * (limits.q_max - q))
        fixed = np.eye(len(q))[~tip.works]
        A = np.vstack([tip.jacobian(q), fixed])
        b = np.concatenate([tip.scale * twist + GAIN * tip.error(q, pose), np.zeros(len(fixed))])
        low, high = np.minimum(low, high), np.maximum(low, high)
        low[~tip.works], high[~tip.works] = -np.inf, np.inf
        I, none = np.eye(len(q)), np.zeros(len(q))
        found = qpsolvers.solve_qp(I, none, None, None, A, b, low, high, solver="daqp")
        if found is None:
            found = qpsolvers.solve_qp(
                A.T @ A + NEAREST * I, -A.T @ b, None, None, None, None, low, high, solver="daqp"
            )
        return (none if found is None else np.where(tip.works, found, 0.0)), True

    def lock(self, joint: int, q, v) -> None:
        """One more equality."""
        self._tip.works[joint] = False


class NoiseTolerantNetwork:
    """J v = xdot + gamma e + kappa (integral of e) by the pseudoinverse without the locked joint's column.

    The error of the task is made to obey de/dt = -gamma e - kappa (integral of e), so that constant and
    slowly growing disturbances die out. Speeds beyond the limits are scaled down together, which the network
    itself does not do.

    Source: Jin, Zhang and Li 2016, the integration-enhanced design formula; Guo et al. 2018, on redundant
    arms. Neither text was at hand, only their abstracts and a review that calls the structure one of a single
    integral of the error: the formula is the simplest with that structure, and both gains are ours.
    """

    def __init__(self, robot: ftqp.Robot, dt: float) -> None:
        self._tip, self._sum = Tip(robot, dt), np.zeros(6)

    def step(self, q, pose, twist):
        """One tick of the network."""
        tip = self._tip
        e = tip.error(q, pose)
        self._sum += tip.dt * e
        v = np.linalg.pinv(tip.jacobian(q), rcond=1e-6) @ (
            tip.scale * twist + GAIN * e + INTEGRAL * self._sum
        )
        return v / max(1.0, float(np.max(np.abs(v) / tip.robot.limits.v_max))), True

    def lock(self, joint: int, q, v) -> None:
        """One column less."""
        self._tip.works[joint] = False


class HaltOptimization:
    """A smooth halt in the posture that leaves the arm most able, then resolved rates along what is left.

    The posture is the one nearby with the largest manipulability sqrt(det(J J')) of the joints that work,
    within the ranges; the halt is a quintic in the joints from (q, v) to rest there. Then the arm returns to
    where it left the path, and the path's time goes on. The paper's further aim, a small torque on a floating
    base, has no meaning on an arm that stands.

    Source: Chen, Li, Fu, Yuan and Fei 2020, models HCOM and HMOM; distances are bounded here by what the
    joints can do in the time of the halt.
    """

    def __init__(self, robot: ftqp.Robot, dt: float) -> None:
        self._tip, self._halt, self._k = Tip(robot, dt), None, 0

    def step(self, q, pose, twist):
        """The healthy arm, the halt, the way back, the rest of the path."""
        tip = self._tip
        if self._halt is not None and self._k < len(self._halt):
            v = (self._halt[self._k] - q) / tip.dt
            self._k += 1
            return np.where(tip.works, v, 0.0), False
        e = tip.error(q, pose)
        waits = self._halt is not None and np.linalg.norm(e) > 1e-3 and self._k < 4 * len(self._halt)
        self._k += waits
        rate = GAIN * e if waits else tip.scale * twist + GAIN * e
        size = float(np.linalg.norm(rate[:3]))
        rate *= min(1.0, 0.25 / size) if waits and size > 0.0 else 1.0
        v = np.linalg.pinv(tip.jacobian(q), rcond=1e-6) @ rate
        return v / max(1.0, float(np.max(np.abs(v) / tip.robot.limits.v_max))), not waits

    def lock(self, joint: int, q, v) -> None:
        """Choose the halt."""
        tip, limits = self._tip, self._tip.robot.limits
        tip.works[joint] = False
        moves = np.flatnonzero(tip.works)
        reach = 0.25 * limits.v_max * HALT
        low, high = np.maximum(limits.q_min, q - reach)[moves], np.minimum(limits.q_max, q + reach)[moves]
        low, high = np.minimum(low, high), np.maximum(low, high)

        def unable(x) -> float:
            to = q.copy()
            to[moves] = x
            J = tip.jacobian(to)
            return -float(np.sqrt(max(0.0, np.linalg.det(J @ J.T))))

        generator, best = np.random.default_rng(0), np.clip(q[moves], low, high)
        for start in [best, *(generator.uniform(low, high) for _ in range(RESTARTS))]:
            found = minimize(unable, start, bounds=list(zip(low, high, strict=True)), method="L-BFGS-B")
            if found.fun < unable(best):
                best = found.x
        end = q.copy()
        end[moves] = best
        speed = np.where(tip.works, v, 0.0)
        fastest = 1.875 * float(np.max(np.abs(end - q) / limits.v_max)) + 0.5
        seconds = max(HALT, fastest)
        s = np.arange(1, round(seconds / tip.dt) + 1)[:, None] * tip.dt / seconds
        way = 10 * s**3 - 15 * s**4 + 6 * s**5
        brake = s - 6 * s**3 + 8 * s**4 - 3 * s**5
        self._halt, self._k = q + way * (end - q) + seconds * brake * speed, 0


def vector(R):
    """The rotation vector of R, (3,)."""
    axis = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    s = float(np.linalg.norm(axis))
    return axis * (np.arctan2(s, 0.5 * (np.trace(R) - 1.0)) / s if s > 1e-12 else 1.0)
