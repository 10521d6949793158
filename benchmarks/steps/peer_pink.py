"""pink's whole step at velocity level: frame task, ``solve_ik``, ``integrate_inplace``."""

from collections.abc import Callable
from functools import partial
from importlib.metadata import version

import numpy as np
import pink
import pinocchio as pin
from bench.worker import Case, Variant, serve
from pink.tasks import FrameTask, LinearHolonomicTask

SOLVERS = ("daqp", "proxqp", "quadprog")
"""Solvers of qpsolvers that its documentation uses."""


def variants(case: Case, way: str) -> dict[str, Callable[[], Variant]]:
    """pink with each of the solvers its documentation uses; nothing at torque level."""
    if case.level != "velocity":
        return {}
    return {f"pink {solver}": partial(_velocity, case, way, solver) for solver in SOLVERS}


def _velocity(case: Case, way: str, solver: str) -> Variant:
    model = pin.buildModelFromXML(case.urdf)
    configuration = pink.Configuration(model, model.createData(), case.q.copy())
    task = FrameTask(case.tip, position_cost=1.0, orientation_cost=1.0)
    tasks = [task]
    constraints = None
    if case.locked is not None:
        row = np.zeros((1, model.nv))
        row[0, case.locked] = 1.0
        constraints = [LinearHolonomicTask(row, np.zeros(1), case.q.copy(), cost=1.0)]
    poses = case.targets(way)
    dt = case.dt

    def step(k: int) -> None:
        task.set_target(pin.SE3(poses[k]))
        v = pink.solve_ik(configuration, tasks, dt, solver=solver, constraints=constraints)
        configuration.integrate_inplace(v, dt)

    return Variant(step=step, q=lambda: configuration.q)


def versions() -> dict[str, str]:
    """Versions of what was measured."""
    names = ("pin-pink", "pin", "qpsolvers", "daqp", "proxsuite", "quadprog", "numpy")
    return {name: version(name) for name in names}


if __name__ == "__main__":
    serve(variants, versions)
