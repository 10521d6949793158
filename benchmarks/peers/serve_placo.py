"""placo leads an arm: a soft frame task, limits of range and speed, locks by mask_dof."""

import numpy as np
import placo

from peers.servant import aimed, serve

REGULARIZATION = 1e-6


def make(charge):
    """What gives the speeds of a tick."""
    robot = placo.RobotWrapper("", placo.Flags.ignore_collisions, charge.urdf)
    for name, low, high, speed in zip(charge.joints, *charge.limits[:3], strict=True):
        robot.set_joint_limits(name, max(low, -1e3), min(high, 1e3))
        robot.set_velocity_limit(name, float(speed))
    solver = placo.KinematicsSolver(robot)
    solver.mask_fbase(True)
    solver.dt = charge.dt
    solver.enable_joint_limits(True)
    solver.enable_velocity_limits(True)
    task = solver.add_frame_task(charge.tip, np.eye(4))
    task.configure(charge.tip, "soft", 1.0, charge.length**2)
    solver.add_regularization_task(REGULARIZATION)
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
    serve(make, ("placo",))
