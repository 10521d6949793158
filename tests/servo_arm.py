"""Arms that do not do exactly what they are told: servos on positions or velocities, torques against physics.

They share nothing with the planner's own model but the robot's numbers; dynamics are pinocchio's.
"""

from collections import deque
from types import SimpleNamespace

import numpy as np
import pinocchio

SUBSTEPS, LONGEST = 4, 2e-3


class ServoArm:
    """Healthy joints behind a critically damped servo of bandwidth wn [rad/s]; a brake stops one in 10 ms.

    takes: ``position`` (a = wn^2 (q_c - q) + 2 wn (v_c - v)), ``position only`` (v_c = 0) or ``velocity``
    (a = wn (v_c - v)).
    """

    def __init__(self, q, dt, takes="position", wn=2 * np.pi * 15, latency=0, sigma=0.0, seed=0):
        self.q, self.v = np.array(q), np.zeros(len(q))
        self.dt, self.takes, self.wn, self.sigma = dt, takes, wn, sigma
        self.braked = np.zeros(len(q), bool)
        self.rng = np.random.default_rng(seed)
        self.past = deque([self.q.copy()] * (latency + 1), maxlen=latency + 1)
        self.push = np.zeros(len(q))
        self.dry = np.zeros(len(q))  # what friction takes of an acceleration at most [rad/s2]

    def measured(self):
        q = self.past[0].copy()
        return q + self.sigma * self.rng.normal(size=len(q)) if self.sigma else q

    def command(self, step):
        substeps = max(SUBSTEPS, round(self.dt / LONGEST))
        for _ in range(substeps):
            h = self.dt / substeps
            if self.takes == "velocity":
                a = self.wn * (step.v - self.v)
            else:
                v = step.v if self.takes == "position" else 0.0
                a = self.wn**2 * (step.q - self.q) + 2 * self.wn * (v - self.v)
            self.advance(a + self.push, h)
        self.past.append(self.q.copy())

    def advance(self, a, h):
        a = np.where(self.braked, np.clip(-self.v / h, -200.0, 200.0), a)
        v = self.v + h * a
        self.v = np.sign(v) * np.maximum(np.abs(v) - h * self.dry, 0.0)
        self.q = self.q + h * self.v


class TorqueArm(ServoArm):
    """The rigid body of the robot with a load that nobody knows of, and Coulomb friction [N m]."""

    def __init__(self, robot, q, dt, mass=0.0, friction=0.0, **options):
        super().__init__(q, dt, **options)
        self.model = robot.model.copy()
        last = self.model.njoints - 1
        if mass:
            self.model.appendBodyToJoint(
                last, pinocchio.Inertia(mass, np.array([0.0, 0.0, 0.05]), np.zeros((3, 3))),
                pinocchio.SE3(robot.chain.tip_rotation, robot.chain.tip_translation),
            )  # fmt: skip
        self.data = self.model.createData()
        self.below = np.tril_indices(self.model.nv, -1)
        self.friction = friction
        self.tau_max = robot.limits.tau_max
        self.most = 0.0

    def command(self, step):
        tau = step.tau.copy()
        self.most = max(self.most, float(np.max(np.abs(tau) / self.tau_max)))
        h = self.dt / SUBSTEPS
        for _ in range(SUBSTEPS):
            a, given = pinocchio.aba(self.model, self.data, self.q, self.v, tau), tau
            if self.braked.any() or np.any(self.friction):
                M = pinocchio.crba(self.model, self.data, self.q).copy()
                M[self.below] = M.T[self.below]
            if np.any(self.friction):
                # friction with stick: what would be needed to stop the joint, at most the friction
                free = self.v + h * a
                given = tau + np.clip(-np.diag(M) * free / h, -self.friction, self.friction)
                a = pinocchio.aba(self.model, self.data, self.q, self.v, given)
            a = a + self.push
            if self.braked.any():
                bias = pinocchio.nonLinearEffects(self.model, self.data, self.q, self.v)
                f, k = self.braked, ~self.braked
                a_f = np.clip(-self.v[f] / h, -200.0, 200.0)
                a_k = np.linalg.solve(M[np.ix_(k, k)], (given - bias)[k] - M[np.ix_(k, f)] @ a_f)
                a[f], a[k] = a_f, a_k
            self.advance(a, h)
        self.past.append(self.q.copy())


class Unheeding(TorqueArm):
    """A torque arm of which one motor gives no torque any more; brakes close when they are asked for."""

    dead: int | None = None

    def command(self, step):
        tau = step.tau.copy()
        if self.dead is not None:
            tau[self.dead] = 0.0
        self.braked |= step.brakes
        super().command(SimpleNamespace(tau=tau))
