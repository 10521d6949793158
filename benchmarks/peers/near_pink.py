"""pink past balls: frame and posture task, limits, and its barrier against collisions of capsules."""

import sys
from importlib.metadata import version

import coal
import numpy as np
import pink
import pinocchio as pin
from pink.barriers import SelfCollisionBarrier
from pink.limits import ConfigurationLimit, VelocityLimit
from pink.tasks import FrameTask, LinearHolonomicTask, PostureTask

from peers.motion_case import run_all
from peers.near_case import read_near

GAIN = 20.0
"""Of the barrier; pink's examples have 20, and its own default is 1."""


def geometry(case, model):
    """The arm's capsules and the balls, and all pairs of one of each."""
    found = pin.GeometryModel()
    arm, world = [], []
    for k, (joint, *rest) in enumerate(case.rods):
        a, b, radius = np.array(rest[:3]), np.array(rest[3:6]), rest[6]
        way = b - a
        length = float(np.linalg.norm(way))
        T = pin.SE3.Identity()
        T.translation = 0.5 * (a + b)
        if length > 0.0:
            T.rotation = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), way / length).matrix()
        parent = int(joint) + 1
        frame = int(np.argmax([f.parentJoint == parent for f in model.frames]))
        arm.append(found.addGeometryObject(
            pin.GeometryObject(f"rod {k}", parent, frame, T, coal.Capsule(radius, length))
        ))  # fmt: skip
    for k, (x, y, z, radius) in enumerate(case.balls):
        T = pin.SE3(np.eye(3), np.array([x, y, z]))
        world.append(found.addGeometryObject(pin.GeometryObject(f"ball {k}", 0, 0, T, coal.Sphere(radius))))
    for a in arm:
        for b in world:
            found.addCollisionPair(pin.CollisionPair(a, b))
    return found


def make(case):
    """The step of a case."""
    model = pin.buildModelFromXML(case.urdf)
    low, high, speed, _ = (np.array(row) for row in case.limits)
    model.lowerPositionLimit, model.upperPositionLimit = np.maximum(low, -1e3), np.minimum(high, 1e3)
    model.velocityLimit = speed
    q, shapes = np.array(case.q), geometry(case, model)
    configuration = pink.Configuration(
        model, model.createData(), q.copy(), collision_model=shapes, collision_data=shapes.createData()
    )
    task, posture = FrameTask(case.tip, position_cost=1.0, orientation_cost=1.0), PostureTask(cost=1e-3)
    posture.set_target(q)
    limits = [ConfigurationLimit(model), VelocityLimit(model)]
    barrier = SelfCollisionBarrier(len(shapes.collisionPairs), gain=GAIN, d_min=case.keep)
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
