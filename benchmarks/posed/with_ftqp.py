"""The examples with ftqp. Each gets a robot, where it begins and its targets, and returns where it ends."""

import ftqp


def led(planner, q, targets, steps):
    """Where the arm ends when its targets stay."""
    planner.reset(q)
    for _ in range(steps):
        q = planner.step(q, None, targets).q.copy()
    return q


def two_hands(robot, q, goals, steps):
    """A hand goes to a pose, the other one keeps the pose that it has to it."""
    tasks = [ftqp.PoseTask("left_hand"), ftqp.RelativeTask("right_hand", "left_hand", level=0)]
    planner = ftqp.Planner(robot, 0.005, level="velocity", tasks=tasks)
    return led(planner, q, {"left_hand": goals["left_hand"]}, steps)


def look_at(robot, q, goals, steps):
    """A tool goes to a place and points at another one."""
    look = ftqp.AxisTask("panda_hand_tcp", towards=goals["ball"], level=2)
    planner = ftqp.Planner(robot, 0.005, level="velocity", tasks=[ftqp.PositionTask("panda_hand_tcp"), look])
    return led(planner, q, {"panda_hand_tcp": goals["place"]}, steps)


def upper_body(robot, q, goals, steps):
    """Both hands go to places, and the centre of mass to another one."""
    hand = ftqp.PositionTask("right_hand", level=0)
    mass = ftqp.CentreOfMass("xy", target=goals["mass"], level=2)
    tasks = [ftqp.PositionTask("left_hand"), hand, mass]
    planner = ftqp.Planner(robot, 0.005, level="velocity", tasks=tasks)
    return led(planner, q, {name: goals[name] for name in ("left_hand", "right_hand")}, steps)


def mobile_base(robot, q, goals, steps):
    """The tip of an arm goes to a pose, its base to a place."""
    base = ftqp.JointTask({"base_x": goals["base"][0], "base_y": goals["base"][1]}, level=2)
    planner = ftqp.Planner(robot, 0.005, level="velocity", tasks=[ftqp.PoseTask("panda_hand_tcp"), base])
    return led(planner, q, {"panda_hand_tcp": goals["tip"]}, steps)
