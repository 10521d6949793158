"""placo's whole step with the same tasks as ``own_tasks``, as in placo's own examples."""

from collections.abc import Callable
from functools import partial

import numpy as np
import placo
from bench.worker import Case, Variant, serve
from steps.peer_placo import _robot, versions

HANDS = ("left_hand", "right_hand")
ELBOW, EYE = "link_panda_joint4", "link_panda_joint6"


def variants(case: Case, way: str) -> dict[str, Callable[[], Variant]]:
    """The tasks of ``own_tasks``, the relative one hard."""
    if case.robot == "dual_panda":
        return {"placo": partial(_solver, case, way, others=True)}
    return {
        "placo, tip alone": partial(_solver, case, way, others=False),
        "placo": partial(_solver, case, way, others=True),
    }


def _solver(case: Case, way: str, *, others: bool) -> Variant:
    robot = _robot(case)
    torque = case.level == "torque"
    solver = (placo.DynamicsSolver if torque else placo.KinematicsSolver)(robot)
    solver.mask_fbase(True)
    solver.dt = case.dt
    solver.enable_joint_limits(True)
    solver.enable_velocity_limits(True)
    if torque:
        solver.enable_torque_limits(True)
        for name, a_max in zip(case.joints, case.a_max, strict=True):
            solver.set_qdd_safe(name, float(a_max))
        solver.set_kp(case.kp)
        solver.set_kd(case.kv)
    tip = solver.add_frame_task(case.tip, case.poses[0])
    tip.configure(case.tip, "soft", 1.0, 1.0)
    if others and case.robot == "dual_panda":
        T = np.linalg.inv(robot.get_T_world_frame(HANDS[0])) @ robot.get_T_world_frame(HANDS[1])
        solver.add_relative_frame_task(*HANDS, T).configure("grip", "hard", 1.0, 1.0)
    elif others:
        elbow = solver.add_position_task(ELBOW, robot.get_T_world_frame(ELBOW)[:3, 3])
        elbow.configure("elbow", "soft", 0.1)
        elbow.mask.set_axises("z")
        sight = np.array([0.6, 0.1, 0.0]) - robot.get_T_world_frame(EYE)[:3, 3]
        if not torque:
            axis = np.array([0.0, 0.0, 1.0])
            solver.add_axisalign_task(EYE, axis, sight).configure("look", "soft", 0.1)
        else:
            R = robot.get_T_world_frame(EYE)[:3, :3]
            solver.add_orientation_task(EYE, R).configure("look", "soft", 0.1)
    poses = case.targets(way)

    def step(k: int) -> None:
        tip.T_world_frame = poses[k]
        solver.solve(True)
        robot.update_kinematics()

    return Variant(step=step, q=lambda: [robot.get_joint(name) for name in case.joints])


if __name__ == "__main__":
    serve(variants, versions)
