"""placo: KinematicsSolver with a soft frame task, limits of range and speed, locks masked, as in its docs."""

import numpy as np
import placo

from peers.servant import aimed, main

REGULARIZATION = 1e-6


def begun(given, weight):
    """The robot of a case or charge, its solver, and the task of its tip."""
    robot = placo.RobotWrapper("", placo.Flags.ignore_collisions, given.urdf)
    for name, value, low, high, speed in zip(given.joints, given.q, *given.limits[:3], strict=True):
        robot.set_joint(name, float(value))
        robot.set_joint_limits(name, max(low, -1e3), min(high, 1e3))
        robot.set_velocity_limit(name, float(speed))
    robot.update_kinematics()
    solver = placo.KinematicsSolver(robot)
    solver.mask_fbase(True)
    solver.dt = given.dt
    solver.enable_joint_limits(True)
    solver.enable_velocity_limits(True)
    task = solver.add_frame_task(given.tip, np.eye(4))
    task.configure(given.tip, "soft", 1.0, weight)
    solver.add_regularization_task(REGULARIZATION)
    return robot, solver, task


def of_case(case, _):
    """The step of a case."""
    robot, solver, task = begun(case, 1.0)
    solver.mask_dof(case.joints[case.locked])
    poses, _ = case.targets()

    def step(k):
        task.T_world_frame = poses[k]
        solver.solve(True)
        robot.update_kinematics()
        return [robot.get_joint(name) for name in case.joints]

    return step


def of_charge(charge):
    """What gives the speeds of a tick."""
    robot, solver, task = begun(charge, charge.length**2)
    masked = set()

    def velocity(at, pose, twist, failed, v):
        for name, value in zip(charge.joints, at, strict=True):
            robot.set_joint(name, float(value))
        robot.update_kinematics()
        for i in np.flatnonzero(failed):
            if i not in masked:
                solver.mask_dof(charge.joints[i])
                masked.add(i)
        T = robot.get_T_world_frame(charge.tip)
        task.T_world_frame = aimed(T, pose, twist, charge.gain, charge.dt)
        try:
            solver.solve(True)
        except RuntimeError:
            return None
        return (np.array([robot.get_joint(name) for name in charge.joints]) - at) / charge.dt

    return velocity


if __name__ == "__main__":
    main(of_case, of_charge, ("placo",))
