"""A planner that honours the contract with the least effort, so that the loop is tested by itself."""

from functools import partial
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest

from ftqp.control.planner.status import StepStatus
from ftqp.faults.kinds import Locked
from ftqp.model import catalog
from ftqp.qp.problem import SolveStatus
from ftqp.sim.log.signals import QP_CODES
from ftqp.sim.plants.plant import Arm


class FakePlanner:
    """Follows a given joint acceleration, brakes the locked joints it knows of, keeps what it gets."""

    diagnosis = None
    findings = ()
    tasks: ClassVar = {}
    constraints: ClassVar = {}
    scene = clearance = learned = None

    def __init__(self, robot, dt=1e-2, level="acceleration", a=None, code=lambda k: 0, before=lambda k: None):
        self.robot, self.dt, self.level = robot, dt, level
        self.faults = {}
        self.scheme, self.task = SimpleNamespace(name="fake"), SimpleNamespace(mode="slack")
        self.backend, self.emergency = "none", None
        self.drive = SimpleNamespace(kind="position")
        self.calls, self.task_rows = [], tuple("xyzabc")
        self._a = np.zeros(robot.nv) if a is None else np.asarray(a, dtype=float)
        self._code, self._before = code, before

    def reset(self, q, v=None):
        self.calls = [("reset", np.array(q), np.array(v))]

    def report(self, fault):
        self.faults[self.robot.joints[self.robot.joint(fault.joint)]] = fault
        self.calls.append(("report", fault))

    def withdraw(self, joint):
        del self.faults[joint]

    def step(self, q, v, target, *, tau=None):
        k = sum(call[0] == "step" for call in self.calls)
        self._before(k)
        self.calls.append(("step", q.copy(), v.copy(), target.pose.copy(), target.twist.copy()))
        a = self._a.copy()
        for joint, fault in self.faults.items():
            if isinstance(fault, Locked):
                i = self.robot.joint(joint)
                rate = 0.25 * self.robot.limits.a_max[i] if fault.deceleration is None else fault.deceleration
                a[i] = -np.sign(v[i]) * min(rate, abs(v[i]) / self.dt)
        v_next = v + self.dt * a
        if self.level == "acceleration":
            q_next = q + self.dt * v + 0.5 * self.dt**2 * a
        else:
            q_next = q + self.dt * v_next
        zero = np.zeros(len(q))
        code = self._code(k)
        self._made = SimpleNamespace(
            q=q_next,
            v=v_next,
            a=a,
            tau=zero,
            tau_brake=zero,
            lower=zero - 1.0,
            upper=zero + 1.0,
            code=code,
            status=list(StepStatus)[code],
            position_error=1e-4 * k,
            rotation_error=2e-4 * k,
            slack=np.zeros(6),
            scale=1.0,
            jacobian=np.diag([2.0, 1.0, 1.0, 1.0, 1.0, 0.5 + 0.01 * k, 0.0])[:6, : len(q)],
            kappa=0.125,
            qp=SimpleNamespace(status=SolveStatus.SOLVED, iterations=3, residual=1e-12),
            keeper=lambda rows, first, rest: partial(self._keep, rows, first, rest),
        )
        return self._made

    def _keep(self, rows, first, rest, k, code):
        step = self._made
        each = np.concatenate([step.a, step.tau, step.tau_brake, step.lower, step.upper])
        rows[k, first : first + len(each)] = each
        errors = step.position_error, step.rotation_error, step.scale, code
        numbers = *errors, QP_CODES[step.qp.status], step.qp.iterations, step.qp.residual
        further = np.concatenate([step.slack, step.jacobian.ravel(), numbers])
        rows[k, rest : rest + len(further)] = further
        rows[k, rest + len(further) + 1] = step.kappa


@pytest.fixture(scope="session")
def planar():
    return catalog.load("planar6")


@pytest.fixture
def fake():
    return FakePlanner


@pytest.fixture
def start(panda):
    return Arm(panda).tip(panda.neutral).copy()
