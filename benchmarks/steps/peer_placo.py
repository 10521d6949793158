"""placo's whole step: KinematicsSolver at velocity level, DynamicsSolver with torque limits at torque level.

As in placo's own examples: set the target, ``solve(True)`` (which integrates), ``update_kinematics()``.
"""

from collections.abc import Callable
from functools import partial
from importlib.metadata import version
from typing import Any

import placo
from bench.worker import Case, Variant, serve


def variants(case: Case, way: str) -> dict[str, Callable[[], Variant]]:
    """``placo soft`` is the reference; in the others the task is hard, or knows the target's velocity."""
    if case.level == "velocity":
        return {
            "placo soft": partial(_velocity, case, way, "soft"),
            "placo hard": partial(_velocity, case, way, "hard"),
        }
    return {
        "placo soft": partial(_torque, case, way, "soft", twist=False),
        "placo soft + twist": partial(_torque, case, way, "soft", twist=True),
        "placo hard": partial(_torque, case, way, "hard", twist=False),
    }


def _robot(case: Case) -> Any:
    robot = placo.RobotWrapper("", placo.Flags.ignore_collisions, case.urdf)
    for name, value in zip(case.joints, case.q, strict=True):
        robot.set_joint(name, float(value))
    robot.update_kinematics()
    return robot


def _velocity(case: Case, way: str, priority: str) -> Variant:
    robot = _robot(case)
    solver = placo.KinematicsSolver(robot)
    solver.mask_fbase(True)
    solver.dt = case.dt
    solver.enable_joint_limits(True)
    solver.enable_velocity_limits(True)
    task = solver.add_frame_task(case.tip, case.poses[0])
    task.configure(case.tip, priority, 1.0, 1.0)
    if case.locked is not None:
        solver.mask_dof(case.joints[case.locked])
    poses = case.targets(way)

    def step(k: int) -> None:
        task.T_world_frame = poses[k]
        solver.solve(True)
        robot.update_kinematics()

    return Variant(step=step, q=lambda: [robot.get_joint(name) for name in case.joints])


def _torque(case: Case, way: str, priority: str, *, twist: bool) -> Variant:
    robot = _robot(case)
    solver = placo.DynamicsSolver(robot)
    solver.mask_fbase(True)
    solver.dt = case.dt
    solver.enable_joint_limits(True)
    solver.enable_velocity_limits(True)
    solver.enable_torque_limits(True)
    for name, a_max in zip(case.joints, case.a_max, strict=True):
        solver.set_qdd_safe(name, float(a_max))
    task = solver.add_frame_task(case.tip, case.poses[0])
    task.configure(case.tip, priority, 1.0, 1.0)
    if case.locked is not None:
        name = case.joints[case.locked]
        still = solver.add_joints_task()
        still.set_joint(name, robot.get_joint(name))
        still.configure("locked", "hard", 1.0)
    solver.set_kp(case.kp)
    solver.set_kd(case.kv)
    poses = case.targets(way)
    linear, angular = case.twists[:, :3].copy(), case.twists[:, 3:].copy()
    if way == "best":
        linear, angular = list(linear), list(angular)
    position, orientation = task.position(), task.orientation()
    success = True

    def step(k: int) -> None:
        nonlocal success
        task.T_world_frame = poses[k]
        success = solver.solve(True).success
        robot.update_kinematics()

    def step_with_twist(k: int) -> None:
        nonlocal success
        task.T_world_frame = poses[k]
        position.dtarget_world = linear[k]
        orientation.omega_world = angular[k]
        success = solver.solve(True).success
        robot.update_kinematics()

    return Variant(
        step=step_with_twist if twist else step,
        q=lambda: [robot.get_joint(name) for name in case.joints],
        status=lambda: "success" if success else "no success",
    )


def versions() -> dict[str, str]:
    """Versions of what was measured."""
    return {name: version(name) for name in ("placo", "libpinocchio", "numpy")}


if __name__ == "__main__":
    serve(variants, versions)
