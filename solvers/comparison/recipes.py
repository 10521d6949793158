"""What the recorded sequences are: robots, paths, faults and the times that are worth a look."""

from functools import partial

import numpy as np
from bench.cases import chain30 as chain30_arm
from bench.urdf import TIP, text
from comparison.making import Recipe

import ftqp
from ftqp.control.paths import Circle, Line, Square
from ftqp.model.robot import Robot
from ftqp.sim.schedule import FaultEvent

PANDA = (0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398)
"""The usual posture of a Panda [rad]."""
IIWA = (0.0, 0.6, 0.0, -1.2, 0.0, 1.0, 0.0)

JIN = {
    "dt": 0.01,
    "scheme": {"name": "dlsm", "alpha": 0.995, "mu": 4.0, "nu": 4.0},
    "bounds": {"name": "jin", "gamma_p": 20.0, "gamma_v": 20.0, "margin": 0.1},
    "torque_limits": False,
    "task": ftqp.Task(rows=("x", "y"), mode="hard", kp=10.0, kv=10.0),
}
"""The planner of Jin et al. 2017."""
SQUARE = partial(Square, side=0.039, axes=("x", "y"), duration=20.0)
CIRCLE = partial(Circle, radius=0.1, axes=("x", "y"), duration=4.0)
POSITION = ftqp.Task(rows="position")


def load(name: str, **options: bool) -> Robot:
    """A robot of the catalog."""
    return ftqp.robots.load(name, **options)


def chain30() -> Robot:
    """The 30-joint arm of the step benchmark."""
    arm = chain30_arm()
    return ftqp.Robot.from_urdf(text("chain30", arm), tip=TIP, acceleration=arm.a_max)


def weak_panda() -> Robot:
    """A Panda whose elbow has a quarter of its torque, 1.5 N m more than it takes to stand still."""
    return load("panda").with_limits(tau_max=[87.0, 87.0, 87.0, 23.5, 12.0, 12.0, 12.0])


def weak_planar6() -> Robot:
    """The arm of Jin et al. with 80 % of the torque that joint 1 would use on the square."""
    return load("planar6").with_limits(tau_max=[0.030336, 1.0, 1.0, 1.0, 1.0, 1.0])


def narrow_iiwa() -> Robot:
    """An iiwa whose joints may move 0.2 rad either way from its usual posture."""
    return load("iiwa14").with_limits(q_min=np.array(IIWA) - 0.2, q_max=np.array(IIWA) + 0.2)


def locked(joint: int, at: float, mode: str = "ramp") -> FaultEvent:
    """A lock that the planner is told of at once."""
    return FaultEvent(at, ftqp.Locked(joint, mode=mode))


panda = partial(Recipe, robot=partial(load, "panda"), q=PANDA, path=CIRCLE)
planar6 = partial(Recipe, robot=partial(load, "planar6"), path=SQUARE, planner=JIN)
iiwa14 = partial(Recipe, robot=partial(load, "iiwa14"), q=IIWA)


RECIPES = (
    panda("panda-healthy", "pose along a circle, nothing fails", begin=1.5),
    panda(
        "panda-healthy-velocity", "pose along a circle, velocity commands, posture kept",
        planner={"level": "velocity", "scheme": "rmp"}, begin=1.5,
    ),
    iiwa14(
        "iiwa14-healthy", "position along a line, least kinetic energy",
        path=partial(Line, displacement=(0.0, 0.25, 0.10), duration=4.0),
        planner={"scheme": "mke", "task": POSITION}, begin=1.0,
    ),
    planar6("planar6-healthy", "the square of Jin et al. 2017, hard task, dense objective", begin=7.0),
    planar6(
        "planar6-locked", "the same after joint 1 has locked",
        faults=(locked(0, 15.0, "instant"),), begin=16.5,
    ),
    planar6(
        "planar6-fault-instant", "joint 1 stops dead while it moves",
        faults=(locked(0, 12.5, "instant"),), begin=12.4,
    ),
    panda(
        "panda-fault-ramp", "joint 3 brakes and locks while it moves; no joint is left to spare",
        faults=(locked(2, 2.0),), begin=1.99, count=60,
    ),
    panda(
        "panda-fault-velocity", "joint 4 brakes and locks, velocity commands",
        planner={"level": "velocity", "task": POSITION}, faults=(locked(3, 1.5),), begin=1.49,
    ),
    panda(
        "panda-free-swinging", "joint 1 has no torque: an equality among the torque rows",
        path=partial(Line, displacement=(0.05, 0.10, -0.05), duration=4.0), planner={"task": POSITION},
        faults=(FaultEvent(2.0, ftqp.FreeSwinging(0, damping=0.5)),), begin=1.99,
    ),
    panda(
        "panda-degraded", "joint 4 keeps an eighth of its speed and half of its torque, told 0.05 s late",
        path=partial(Square, side=0.25, axes=("y", "z"), duration=6.0), planner={"task": POSITION},
        faults=(
            FaultEvent(2.0, ftqp.Degraded(3, velocity=0.12, acceleration=0.5, torque=0.5), announced=2.05),
        ),
        begin=2.04,
    ),
    panda(
        "panda-torque", "a torque limit of the elbow binds", robot=weak_panda,
        path=partial(Line, displacement=(0.3, 0.0, 0.2), duration=0.8), planner={"task": POSITION},
        begin=0.07, count=60,
    ),
    planar6(
        "planar6-torque", "torque limit of joint 1 and a position limit bind, hard task", robot=weak_planar6,
        planner={**JIN, "scheme": {"name": "rmp", "mu": 4.0}, "torque_limits": True}, begin=9.3,
    ),
    panda(
        "panda-near-singular", "the arm is led to where it is stretched, and beyond",
        path=partial(Line, displacement=(0.64, 0.0, 0.0), duration=3.0), planner={"task": POSITION},
        begin=2.49, count=60,
    ),
    Recipe(
        "puma560-near-singular",
        "six joints, no redundancy, velocity commands through the stretched wrist",
        robot=partial(load, "puma560"), q=(0.0, 0.7854, -3.14159, 0.0, 0.0698, 0.0),
        path=partial(Line, displacement=(0.1, 0.05, 0.0), duration=1.0),
        planner={"level": "velocity", "task": ftqp.Task(calm=False)},  # calm solves a QP of its own there
        begin=0.55,
    ),
    planar6(
        "planar6-infeasible",
        "joints 1 to 5 lock at a corner of the square; from then on the hard task has no solution",
        faults=tuple(locked(joint, 15.0, "instant") for joint in range(5)), begin=14.9, count=60,
    ),
    panda(
        "panda-infeasible", "joints 3 and 5 lock on a circle; the hard pose task has no solution",
        planner={"task": ftqp.Task(mode="hard")},
        faults=(locked(2, 1.5, "instant"), locked(4, 1.5, "instant")), begin=1.49,
    ),
    panda(
        "panda-too-fast", "a hard circle that is faster than the arm: the bounds exclude the task",
        path=partial(Circle, radius=0.15, axes=("x", "y"), duration=0.8),
        planner={"task": ftqp.Task(mode="hard")}, begin=0.1,
    ),
    iiwa14(
        "iiwa14-moving-bounds", "position limits come near: viability makes the bounds move every tick",
        robot=narrow_iiwa, path=partial(Line, displacement=(0.0, 0.30, 0.10), duration=2.0),
        planner={"task": POSITION}, begin=1.18, count=60,
    ),
    planar6(
        "planar6-moving-bounds", "gravity along -y, viability bounds, most of them active",
        robot=partial(ftqp.robots.load, "planar6", vertical=True),
        planner={**JIN, "bounds": "viability", "task": ftqp.Task(rows=("x", "y"), kp=10.0, kv=10.0)},
        begin=7.0,
    ),
    planar6(
        "planar6-mtn", "least torque: the eigenvalues of H span eight decades",
        planner={**JIN, "scheme": "mtn"}, begin=7.0,
    ),
    panda(
        "panda-mtn", "least torque of a Panda, torque limits, slack task",
        planner={"scheme": "mtn"}, begin=0.5,
    ),
    Recipe(
        "xarm7-iiwt", "least inertia-inverse-weighted torque", robot=partial(load, "xarm7", rotors=False),
        path=partial(Circle, radius=0.05, axes=("x", "y"), duration=3.0),
        planner={"scheme": "iiwt", "task": POSITION}, begin=1.0,
    ),
    panda(
        "panda-scaled", "the path scale falls below 1 where the arm cannot keep up",
        path=partial(Circle, radius=0.15, axes=("x", "y"), duration=1.2),
        planner={"task": ftqp.Task(mode="scaled")}, begin=0.27,
    ),
    panda(
        "panda-lexicographic", "second stages where the task cannot be kept",
        path=partial(Circle, radius=0.15, axes=("x", "y"), duration=0.8),
        planner={"task": ftqp.Task(mode="lexicographic"), "scheme": "dlsm"}, begin=0.21,
    ),
    Recipe(
        "zhang7-velocity", "two booms of 5 m, velocity commands, no inertia known",
        robot=partial(load, "zhang7"), path=partial(Line, displacement=(0.5, 0.5, 0.0), duration=4.0),
        planner={"level": "velocity", "scheme": "mvn", "dt": 0.01}, begin=1.0,
    ),
    Recipe(
        "modular11-locked", "11 joints, two of them locked, no inertia known",
        robot=partial(load, "modular11"), path=partial(Line, displacement=(0.3, 0.0, -0.2), duration=4.0),
        planner={"dt": 0.005}, faults=(locked(1, 1.0), locked(5, 1.5)), begin=1.4,
    ),
    Recipe(
        "planar30-dlsm", "30 joints in a plane, dense objective, torque rows",
        robot=partial(load, "planar(30)"), path=partial(Square, side=0.2, axes=("x", "y"), duration=8.0),
        planner={"scheme": "dlsm"}, begin=1.0, count=15,
    ),
    Recipe(
        "chain30-locked", "30 joints in space, pose, torque rows, the middle joint locks",
        robot=chain30, q=tuple(chain30_arm().neutral.tolist()),
        path=partial(Circle, radius=0.2, axes=("x", "y"), duration=4.0), faults=(locked(14, 1.0),),
        begin=0.995, count=15,
    ),
)  # fmt: skip
"""Every sequence, in the order of the table."""
