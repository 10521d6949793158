"""placo along the cases of a file: KinematicsSolver with limits, the locked joint masked, as in its docs."""

import sys
from importlib.metadata import version

import placo

from peers.motion_case import read, run_all


def make(case):
    """The step of a case."""
    robot = placo.RobotWrapper("", placo.Flags.ignore_collisions, case.urdf)
    for name, value, low, high, speed in zip(case.joints, case.q, *case.limits[:3], strict=True):
        robot.set_joint(name, float(value))
        robot.set_joint_limits(name, max(low, -1e3), min(high, 1e3))
        robot.set_velocity_limit(name, float(speed))
    robot.update_kinematics()
    solver = placo.KinematicsSolver(robot)
    solver.mask_fbase(True)
    solver.dt = case.dt
    solver.enable_joint_limits(True)
    solver.enable_velocity_limits(True)
    poses, _ = case.targets()
    task = solver.add_frame_task(case.tip, poses[0])
    task.configure(case.tip, "soft", 1.0, 1.0)
    solver.mask_dof(case.joints[case.locked])
    solver.add_regularization_task(1e-6)

    def step(k):
        task.T_world_frame = poses[k]
        solver.solve(True)
        robot.update_kinematics()
        return [robot.get_joint(name) for name in case.joints]

    return step


if __name__ == "__main__":
    run_all(make, read(sys.argv[1]), sys.argv[2], {"placo": version("placo")})
