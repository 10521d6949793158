"""ftqp's whole step with each native backend, and an empty call that reads the harness."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from bench import cases
from bench.results import packages
from bench.urdf import TIP, Arm
from bench.worker import Array, Case, Variant, serve

import ftqp

BACKENDS = ("active_set", "daqp", "proxqp", "osqp", "quadprog")
"""The backends that are set up once and updated."""

ALONG = "ftqp active_set + twist"
"""The variant that is told all of its targets, as a loop after the README's does."""

LEVELS = {"velocity": "velocity", "torque": "acceleration"}
"""The planner's name for each level of the benchmark."""


def tasks() -> list[cases.Path]:
    """The Panda and the chain of 30 joints, each with its targets."""

    def pose_of(urdf: str, a_max: Array) -> Callable[[Array], Array]:
        robot = ftqp.Robot.from_urdf(urdf, tip=TIP, acceleration=a_max)
        return lambda q: np.array(robot.pose(q))

    arms = (("panda", Arm.of(ftqp.robots.load("panda"))), ("chain30", cases.chain30()))
    return [cases.path(name, arm, pose_of) for name, arm in arms]


def variants(case: Case, way: str) -> dict[str, Callable[[], Variant]]:
    """``ftqp active_set`` is what the ratios are about; ``empty`` reads what the harness itself costs."""
    makers: dict[str, Callable[[], Variant]] = {"empty": partial(_empty, case)}
    for name in BACKENDS:
        makers[f"ftqp {name}"] = partial(_planner, case, way, name, twist=False)
    makers[ALONG] = partial(_planner, case, way, "active_set", twist=True)
    makers["ftqp active_set, not calm"] = partial(_planner, case, way, "active_set", twist=False, calm=False)
    if case.level == "velocity":
        makers["ftqp active_set, no torque rows"] = partial(
            _planner, case, way, "active_set", twist=False, torque_limits=False
        )
    return makers


def _empty(case: Case) -> Variant:
    def step(k: int) -> None:
        pass

    return Variant(step=step, q=lambda: case.q, status=lambda: "")


def _planner(
    case: Case, way: str, backend: str, *, twist: bool, torque_limits: bool = True, calm: bool = True
) -> Variant:
    robot = ftqp.Robot.from_urdf(case.urdf, tip=case.tip, acceleration=case.a_max, neutral=case.q)
    gains: dict[str, Any] = {"kp": case.gain} if case.level == "velocity" else {"kp": case.kp, "kv": case.kv}
    if not calm:
        gains["calm"] = False
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
    twists = case.twists if twist else None
    return driven(planner, way, case.q, case.poses, twists, None if twists is None else 0.0 * twists)


def driven(
    planner: Any,
    way: str,
    q: Array,
    poses: Array,
    twists: Array | None = None,
    accelerations: Array | None = None,
) -> Variant:
    """A planner that leads an arm which obeys exactly, called in one of the ways of ``bench.ways``.

    Args:
        planner: It has been reset to q, at rest.
        way: ``best`` gives its own arrays back to it and takes targets that were made ahead. Otherwise every
            step gets fresh arrays, made when the one before is over, and rewrites its one target.
        q: Start, (nv,) [rad].
        poses: Targets, (N, 4, 4).
        twists: Their velocities, (N, 6); None leaves them zero and unwritten.
        accelerations: The same, (N, 6); given where twists are.
    """
    given_q, given_v = q.copy(), 0.0 * q
    if way == "best":
        targets = ftqp.Targets(poses, twists, accelerations)
        out = planner.step(given_q, given_v, targets.at(0))

        def step(k: int) -> None:
            nonlocal out
            out = planner.step(out.q, out.v, targets.at(k))

        return Variant(step=step, q=lambda: out.q, status=lambda: out.status.name)
    target = ftqp.Target(pose=poses[0])
    out = planner.step(given_q, given_v, target)

    def step_to_pose(k: int) -> None:
        nonlocal out
        out = planner.step(given_q, given_v, target.at(poses[k]))

    def step_along(k: int) -> None:
        nonlocal out
        out = planner.step(given_q, given_v, target.at(poses[k], twists[k], accelerations[k]))

    def measure() -> None:
        nonlocal given_q, given_v
        given_q, given_v = out.q.copy(), out.v.copy()

    return Variant(
        step=step_to_pose if twists is None else step_along,
        q=lambda: out.q,
        status=lambda: out.status.name,
        between=measure,
    )


def versions() -> dict[str, str]:
    """Versions of what was measured."""
    names = ("numpy", "numba", "pin", "daqp", "proxsuite", "osqp", "quadprog")
    return {"ftqp": ftqp.__version__, **packages(names)}


if __name__ == "__main__":
    serve(variants, versions)
