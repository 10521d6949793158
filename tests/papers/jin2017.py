"""The experiments of Jin et al. 2017: the six-link arm on its square."""

from dataclasses import dataclass
from typing import Any

import numpy as np

import ftqp
from ftqp.core.checks import FloatArray

DT = 0.01
START = np.full(6, np.pi / 12)


@dataclass
class Run:
    """What happened, one row a tick, k = 0 .. N inclusive."""

    t: FloatArray
    q: FloatArray
    v: FloatArray
    tau: FloatArray
    tau_brake: FloatArray
    error: FloatArray
    status: list[ftqp.StepStatus]
    limits: list[tuple[str, ...]]
    iterations: FloatArray
    planner: ftqp.Planner

    @property
    def stopped_at(self) -> float | None:
        """Time of the first tick of a stop [s]."""
        for t, status in zip(self.t, self.status, strict=True):
            if status is ftqp.StepStatus.STOPPING:
                return float(t)
        return None

    def count(self, status: ftqp.StepStatus) -> int:
        """Ticks with that status."""
        return self.status.count(status)


def square(law: str = "quintic") -> ftqp.paths.Path:
    """The square of 0.039 m in 20 s, from the arm's start."""
    start = ftqp.robots.load("planar6").pose(START)
    return ftqp.paths.Square(start, 0.039, duration=20.0, law=law)


def run(
    scheme: Any = None,
    *,
    level: str = "acceleration",
    bounds: Any = "jin",
    faults: tuple[tuple[float, Any], ...] = (),
    law: str = "quintic",
    mode: str = "hard",
    emergency: ftqp.EmergencyStop | None = None,
    mean_acceleration: bool = False,
    tau_max: Any = None,
    backend: Any = "active_set",
    vertical: bool = False,
) -> Run:
    """One experiment; ``faults`` are (time, fault) pairs, reported when their time has come."""
    robot = ftqp.robots.load("planar6", vertical=vertical)
    if tau_max is not None:
        robot = robot.with_limits(tau_max=tau_max)
    planner = ftqp.Planner(
        robot,
        DT,
        level=level,
        scheme=ftqp.schemes.dlsm() if scheme is None else scheme,
        task=ftqp.Task(mode=mode, calm=False, kp=10.0, kv=10.0 if level == "acceleration" else None),
        bounds=bounds,
        emergency=emergency,
        backend=backend,
    )
    path = square(law)
    t = np.arange(round(path.duration / DT) + 1) * DT
    samples = path.sample(t)
    acceleration = ftqp.paths.mean_acceleration(path, t, DT) if mean_acceleration else samples.acceleration
    target = ftqp.Target(pose=path.start)
    q, v = START.copy(), np.zeros(6)
    planner.reset(q)
    pending = list(faults)
    rows: dict[str, list[FloatArray]] = {name: [] for name in ("q", "v", "tau", "tau_brake")}
    errors, status, limits, iterations = [], [], [], []
    for k, now in enumerate(t):
        for at, fault in list(pending):
            if now >= at - 1e-9:
                planner.report(fault)
                pending.remove((at, fault))
        target.pose[:] = samples.pose[k]
        target.twist[:] = samples.twist[k]
        target.acceleration[:] = acceleration[k]
        step = planner.step(q, v, target)
        rows["q"].append(q.copy())
        rows["v"].append(v.copy())
        rows["tau"].append(step.tau.copy())
        rows["tau_brake"].append(step.tau_brake.copy())
        errors.append(step.position_error)
        status.append(step.status)
        limits.append(step.limits_active)
        iterations.append(step.qp.iterations)
        q, v = step.q.copy(), step.v.copy()
    arrays = {name: np.array(values) for name, values in rows.items()}
    return Run(
        t=t,
        error=np.array(errors),
        status=status,
        limits=limits,
        iterations=np.array(iterations),
        planner=planner,
        **arrays,
    )
