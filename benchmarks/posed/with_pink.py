"""The examples with pink, after its stretch_relative_target, humanoid_g1_com and mobile_stretch."""

import pinocchio as pin
from pink import Configuration, solve_ik
from pink.tasks import ComTask, FrameTask, PostureTask, RelativeFrameTask


def jacobians(model, q):
    """Of a pose, a relative pose and the centre of mass, each at its target, along the axes of the frame."""
    here = Configuration(model, model.createData(), q)
    weights = {"position_cost": 1.0, "orientation_cost": 1.0}
    tasks = (
        FrameTask("right_hand", **weights),
        RelativeFrameTask("right_hand", "left_hand", **weights),
        ComTask(cost=1.0),
    )
    for task in tasks:
        task.set_target_from_configuration(here)
    return [task.compute_jacobian(here) for task in tasks]


def led(model, q, tasks, steps):
    """Where the arm ends when its targets stay."""
    configuration = Configuration(model, model.createData(), q)
    for _ in range(steps):
        velocity = solve_ik(configuration, tasks, 0.005, solver="daqp")
        configuration.integrate_inplace(velocity, 0.005)
    return configuration.q


def two_hands(model, q, goals, steps):
    """A hand goes to a pose, the other one keeps the pose that it has to it."""
    left = FrameTask("left_hand", position_cost=1.0, orientation_cost=1.0)
    left.set_target(pin.SE3(goals["left_hand"]))
    grip = RelativeFrameTask("right_hand", "left_hand", position_cost=10.0, orientation_cost=10.0)
    grip.set_target_from_configuration(Configuration(model, model.createData(), q))
    return led(model, q, [left, grip], steps)


look_at = None  # pink has no task for an axis


def upper_body(model, q, goals, steps):
    """Both hands go to places, and the centre of mass to another one."""
    tasks = [ComTask(cost=[1.0, 1.0, 0.0])]
    tasks[0].set_target(goals["mass"])
    for name in ("left_hand", "right_hand"):
        tasks.append(FrameTask(name, position_cost=1.0, orientation_cost=0.0))
        tasks[-1].set_target(pin.SE3(pin.SE3.Identity().rotation, goals[name]))
    return led(model, q, tasks, steps)


def mobile_base(model, q, goals, steps):
    """The tip of an arm goes to a pose, its base to a place."""
    tip = FrameTask("panda_hand_tcp", position_cost=1.0, orientation_cost=1.0)
    tip.set_target(pin.SE3(goals["tip"]))
    base = FrameTask("base_y_link", position_cost=[1.0, 1.0, 0.0], orientation_cost=0.0)
    base.set_target(pin.SE3(pin.SE3.Identity().rotation, goals["base_place"]))
    posture = PostureTask(cost=1e-6)
    posture.set_target(q)
    return led(model, q, [tip, base, posture], steps)
