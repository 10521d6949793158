"""ftqp's whole step with each native backend, and an empty call that reads the harness."""

from collections.abc import Callable
from functools import partial
from importlib.metadata import version
from typing import Any

import numpy as np

import ftqp
from bench.worker import Case, Variant, serve

BACKENDS = ("active_set", "daqp", "proxqp", "osqp", "quadprog")
"""The backends that are set up once and updated."""

LEVELS = {"velocity": "velocity", "torque": "acceleration"}
"""The planner's name for each level of the benchmark."""


def variants(case: Case) -> dict[str, Callable[[], Variant]]:
    """``ftqp active_set`` is what the ratios are about; ``empty`` reads what the harness itself costs."""
    makers: dict[str, Callable[[], Variant]] = {"empty": partial(_empty, case)}
    for name in BACKENDS:
        makers[f"ftqp {name}"] = partial(_planner, case, name, twist=False)
    makers["ftqp active_set + twist"] = partial(_planner, case, "active_set", twist=True)
    if case.level == "velocity":
        makers["ftqp active_set, no torque rows"] = partial(
            _planner, case, "active_set", twist=False, torque_limits=False
        )
    return makers


def _empty(case: Case) -> Variant:
    def step(k: int) -> None:
        pass

    return Variant(step=step, q=lambda: case.q, status=lambda: "")


def _planner(case: Case, backend: str, *, twist: bool, torque_limits: bool = True) -> Variant:
    robot = ftqp.Robot.from_urdf(case.urdf, tip=case.tip, acceleration=case.a_max, neutral=case.q)
    gains: dict[str, Any] = {"kp": case.gain} if case.level == "velocity" else {"kp": case.kp, "kv": case.kv}
    planner = ftqp.Planner(
        robot,
        dt=case.dt,
        level=LEVELS[case.level],
        scheme=ftqp.schemes.mvn(),
        task=ftqp.Task(rows="pose", **gains),
        backend=backend,
        torque_limits=torque_limits,
    )
    planner.reset(case.q)
    if case.locked is not None:
        planner.report(ftqp.Locked(case.joints[case.locked]))
    targets = ftqp.Targets(np.array(case.pose_list()), np.array(case.twists) if twist else None)
    out = planner.step(case.q, 0.0 * case.q, targets.at(0))

    def step(k: int) -> None:
        nonlocal out
        out = planner.step(out.q, out.v, targets.at(k))

    return Variant(step=step, q=lambda: out.q, status=lambda: out.status.name)


def versions() -> dict[str, str]:
    """Versions of what was measured."""
    names = ("numpy", "numba", "pin", "daqp", "proxsuite", "osqp", "quadprog")
    return {"ftqp": ftqp.__version__, **{name: version(name) for name in names}}


if __name__ == "__main__":
    serve(variants, versions)
