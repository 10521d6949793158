"""mink's whole step at velocity level: frame task, ``solve_ik`` with both limits, ``integrate_inplace``."""

from collections.abc import Callable
from functools import partial
from importlib.metadata import version

import mink
import mujoco
from bench.worker import Case, Variant, serve

COMPILER = '<mujoco><compiler fusestatic="false" balanceinertia="true"/></mujoco>'
"""Keeps the tip as a body of its own; masses play no part at velocity level."""


def variants(case: Case, way: str) -> dict[str, Callable[[], Variant]]:
    """mink with each of two solvers of qpsolvers, its documentation's first; nothing at torque level."""
    if case.level != "velocity":
        return {}
    return {f"mink {solver}": partial(_velocity, case, way, solver) for solver in ("daqp", "quadprog")}


def _velocity(case: Case, way: str, solver: str) -> Variant:
    head, body = case.urdf.split(">", 1)
    model = mujoco.MjModel.from_xml_string(f"{head}>{COMPILER}{body}")
    configuration = mink.Configuration(model, case.q.copy())
    task = mink.FrameTask(case.tip, "body", position_cost=1.0, orientation_cost=1.0)
    tasks = [task]
    speeds = {name: float(v) for name, v in zip(case.joints, case.v_max, strict=True)}
    limits = [mink.ConfigurationLimit(model), mink.VelocityLimit(model, speeds)]
    constraints = None if case.locked is None else [mink.DofFreezingTask(model, [case.locked])]
    poses = case.targets(way)
    dt = case.dt

    def step(k: int) -> None:
        task.set_target(mink.SE3.from_matrix(poses[k]))
        v = mink.solve_ik(configuration, tasks, dt, solver, limits=limits, constraints=constraints)
        configuration.integrate_inplace(v, dt)

    return Variant(step=step, q=lambda: configuration.q)


def versions() -> dict[str, str]:
    """Versions of what was measured."""
    return {name: version(name) for name in ("mink", "mujoco", "qpsolvers", "daqp", "quadprog", "numpy")}


if __name__ == "__main__":
    serve(variants, versions)
