"""The examples with placo, after its own 6axis_targets, humanoid and omniwheel."""

import numpy as np
import placo


def led(robot, solver, steps):
    """Move to where the arm ends when its targets stay."""
    solver.mask_fbase(True)
    solver.enable_joint_limits(True)
    solver.enable_velocity_limits(True)
    solver.dt = 0.005
    for _ in range(steps):
        solver.solve(True)
        robot.update_kinematics()


def two_hands(robot, goals, steps):
    """A hand goes to a pose, the other one keeps the pose that it has to it."""
    solver = placo.KinematicsSolver(robot)
    solver.add_frame_task("left_hand", goals["left_hand"]).configure("left", "soft", 1.0, 1.0)
    T = np.linalg.inv(robot.get_T_world_frame("left_hand")) @ robot.get_T_world_frame("right_hand")
    solver.add_relative_frame_task("left_hand", "right_hand", T).configure("grip", "hard", 1.0, 1.0)
    led(robot, solver, steps)


def look_at(robot, goals, steps):
    """A tool goes to a place and points at another one."""
    solver = placo.KinematicsSolver(robot)
    solver.add_position_task("panda_hand_tcp", goals["place"]).configure("place", "soft", 1.0)
    way = goals["ball"] - goals["place"]
    solver.add_axisalign_task("panda_hand_tcp", np.array([0.0, 0.0, 1.0]), way).configure("look", "soft", 1.0)
    led(robot, solver, steps)


def upper_body(robot, goals, steps):
    """Both hands go to places, and the centre of mass to another one."""
    solver = placo.KinematicsSolver(robot)
    for name in ("left_hand", "right_hand"):
        solver.add_position_task(name, goals[name]).configure(name, "soft", 1.0)
    mass = solver.add_com_task(goals["mass"])
    mass.mask.set_axises("xy")
    mass.configure("mass", "soft", 1.0)
    led(robot, solver, steps)


def mobile_base(robot, goals, steps):
    """The tip of an arm goes to a pose, its base to a place."""
    solver = placo.KinematicsSolver(robot)
    solver.add_frame_task("panda_hand_tcp", goals["tip"]).configure("tip", "soft", 1.0, 1.0)
    base = solver.add_joints_task()
    base.set_joints({"base_x": goals["base"][0], "base_y": goals["base"][1]})
    base.configure("base", "soft", 1.0)
    led(robot, solver, steps)
