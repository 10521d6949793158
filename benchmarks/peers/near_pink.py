"""pink past balls: frame and posture task, limits, and its barrier against collisions of capsules."""

import sys
from importlib.metadata import version

import numpy as np
import pink
import pinocchio as pin
from pink.barriers import SelfCollisionBarrier
from pink.limits import ConfigurationLimit, VelocityLimit
from pink.tasks import FrameTask, LinearHolonomicTask, PostureTask

from peers.motion_case import run_all
from peers.near_case import read_near
from peers.pink_shapes import BARRIER_GAIN, arm_and_world


def make(case):
    """The step of a case."""
    model = pin.buildModelFromXML(case.urdf)
    low, high, speed, _ = (np.array(row) for row in case.limits)
    model.lowerPositionLimit, model.upperPositionLimit = np.maximum(low, -1e3), np.minimum(high, 1e3)
    model.velocityLimit = speed
    q, shapes = np.array(case.q), arm_and_world(model, case.rods, balls=case.balls)
    configuration = pink.Configuration(
        model, model.createData(), q.copy(), collision_model=shapes, collision_data=shapes.createData()
    )
    task, posture = FrameTask(case.tip, position_cost=1.0, orientation_cost=1.0), PostureTask(cost=1e-3)
    posture.set_target(q)
    limits = [ConfigurationLimit(model), VelocityLimit(model)]
    barrier = SelfCollisionBarrier(len(shapes.collisionPairs), gain=BARRIER_GAIN, d_min=case.keep)
    still = []
    if case.locked >= 0:
        row = np.zeros((1, model.nv))
        row[0, case.locked] = 1.0
        still = [LinearHolonomicTask(row, np.zeros(1), q.copy(), cost=1.0)]
    poses, _ = case.targets()

    def step(k):
        task.set_target(pin.SE3(poses[k]))
        v = pink.solve_ik(
            configuration, [task, posture], case.dt, solver="daqp", limits=limits, constraints=still,
            barriers=[barrier],
        )  # fmt: skip
        configuration.integrate_inplace(v, case.dt)
        return configuration.q

    return step


if __name__ == "__main__":
    names = ("pin-pink", "pin", "daqp")
    run_all(make, read_near(sys.argv[1]), sys.argv[2], {name: version(name) for name in names})
