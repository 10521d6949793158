"""The experiments of Bedrossian 1993: the arm of 11 joints in open loop, explicit Euler."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from tests.arm_at import arm_at
from tests.going import closed_loop

import ftqp
from ftqp.core.checks import FloatArray

INCH = 0.0254
DEG = np.pi / 180.0
LENGTH = 30.0 * INCH
Q1 = np.array([45, -60, 0, -45, 0, 45, 90, 45, 0, 0, 0]) * DEG
Q2 = np.array([0, -50, 0, -30, 0, 70, 0, 30, 0, 0, 0]) * DEG
REFERENCE = np.array([0, -50, 0, -30, 0, 83, 0, 3, 0, 14, 0]) * DEG
START_R = np.array([0.1, 0, 0.1, 0, -0.1, 0, 0, 0, 0.1, 0, 0]) * DEG
"""Offset of start R: J1, J3, J9 +0.1 deg, J5 -0.1 deg."""
MANOEUVRE_1 = np.array([-5.5, -2.5, 1.5, 0, 0, 0]) * INCH
MANOEUVRE_2 = np.array([-5.0, 0, 0, 0, 0, 0]) * INCH
LOCKS_1 = (0, 5, 6)
LOCKS_2 = (1, 3, 6)
LIMIT = 50.0 * DEG


def arm() -> ftqp.Robot:
    """The arm with limits so wide that no bound shapes the motion."""
    return ftqp.robots.load("modular11").with_limits(v_max=1e6, a_max=1e9)


def jacobian(robot: ftqp.Robot, q: FloatArray) -> FloatArray:
    """J at q, (6, nv), linear rows first."""
    return arm_at(robot, q).J


def scaled(J: FloatArray, length: float = LENGTH) -> FloatArray:
    """The linear rows divided by the characteristic length; works for twists, too."""
    J = np.array(J)
    J[:3] /= length
    return J


@dataclass
class Run:
    """What happened, one row a tick; the last row is the end."""

    q: FloatArray
    rates: FloatArray
    tip: FloatArray
    kappa: FloatArray
    status: list[ftqp.StepStatus]

    @property
    def peak(self) -> float:
        """Largest rate [deg/s]."""
        return float(np.abs(self.rates).max()) / DEG


def run(
    scheme: Any,
    q: FloatArray,
    twist: FloatArray,
    locks: tuple[int, ...] = (),
    *,
    gain: float = 0.0,
    duration: float = 20.0,
    dt: float = 0.01,
    robot: ftqp.Robot | None = None,
) -> Run:
    """Follow a constant twist from q; the target moves along the line in time, ``gain`` 0 is open loop."""
    robot = arm() if robot is None else robot
    task = ftqp.Task(kp=gain, rows="pose", calm=False)
    planner = ftqp.Planner(robot, dt, level="velocity", scheme=scheme, task=task, emergency=None)
    for joint in locks:
        planner.report(ftqp.Locked(joint))
    target, begin = ftqp.Target(pose=robot.pose(q), twist=twist), robot.pose(q)[:3, 3]

    def moving(k: int) -> ftqp.Target:
        target.position[:] = begin + twist[:3] * (k * dt)
        return target

    qs, rates, kappa, status = [q.copy()], [], [], []
    for step in closed_loop(planner, moving, round(duration / dt), q):
        qs.append(step.q.copy())
        rates.append(step.v.copy())
        kappa.append(step.kappa)
        status.append(step.status)
    tips = np.array([robot.pose(one) for one in qs])
    return Run(q=np.array(qs), rates=np.array(rates), tip=tips, kappa=np.array(kappa), status=status)


def progress(run: Run, twist: FloatArray, duration: float = 20.0) -> tuple[float, float, float]:
    """Share of the line travelled, largest distance from it [in], largest attitude error [deg]."""
    along = twist[:3] / np.linalg.norm(twist[:3])
    offset = run.tip[:, :3, 3] - run.tip[0, :3, 3]
    travelled = offset @ along
    off = np.linalg.norm(offset - travelled[:, None] * along, axis=1)
    turn = run.tip[:, :3, :3] @ run.tip[0, :3, :3].T
    trace = np.clip((np.trace(turn, axis1=1, axis2=2) - 1.0) / 2.0, -1.0, 1.0)
    total = np.linalg.norm(twist[:3]) * duration
    return float(travelled[-1] / total), float(off.max()) / INCH, float(np.arccos(trace).max()) / DEG
