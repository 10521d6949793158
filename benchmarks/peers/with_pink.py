"""pink: limits, locks as equalities, and its barrier against collisions of capsules where things stand.

Along cases it has a frame and a posture task, and with the way ``accelerations`` pink's AccelerationLimit.
Leading an arm it has a frame and a damping task, and limits of range, speed and acceleration.
"""

import coal
import numpy as np
import pink
import pinocchio as pin
from pink.barriers import SelfCollisionBarrier
from pink.limits import AccelerationLimit, ConfigurationLimit, VelocityLimit
from pink.tasks import DampingTask, FrameTask, LinearHolonomicTask, PostureTask

from peers.servant import aimed, main

BARRIER_GAIN = 20.0
"""Of the barrier; pink's examples have 20, and its own default is 1."""
DAMPING_COST = 1e-3
"""Of what the task leaves free; a posture task in its place strays farther and ends farther off."""


def arm_and_world(model, rods, *, balls=(), boxes=()):
    """The arm's capsules and what stands around it, (x, y, z, radius) or (edges, middle), and all pairs."""
    found = pin.GeometryModel()
    arm = []
    for k, (joint, *rest) in enumerate(rods):
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
    things = [(coal.Sphere(radius), place) for *place, radius in balls]
    things += [(coal.Box(*one[:3]), one[3:]) for one in boxes]
    world = [
        found.addGeometryObject(
            pin.GeometryObject(f"thing {k}", 0, 0, pin.SE3(np.eye(3), np.array(place)), shape)
        )
        for k, (shape, place) in enumerate(things)
    ]
    for a in arm:
        for b in world:
            found.addCollisionPair(pin.CollisionPair(a, b))
    return found


def begun(given, *, balls=(), boxes=()):
    """The model of a case or charge, where it begins, its configuration there, and its barriers."""
    model = pin.buildModelFromXML(given.urdf)
    low, high, speed, _ = (np.array(row) for row in given.limits)
    model.lowerPositionLimit, model.upperPositionLimit = np.maximum(low, -1e3), np.minimum(high, 1e3)
    model.velocityLimit = speed
    q, shapes, barriers = np.array(given.q), None, []
    if len(balls) or len(boxes):
        shapes = arm_and_world(model, given.rods, balls=balls, boxes=boxes)
        barriers = [SelfCollisionBarrier(len(shapes.collisionPairs), gain=BARRIER_GAIN, d_min=given.keep)]
    configuration = pink.Configuration(
        model, model.createData(), q.copy(), collision_model=shapes,
        collision_data=None if shapes is None else shapes.createData(),
    )  # fmt: skip
    return model, q, configuration, barriers


def of_case(case, way):
    """The step of a case."""
    model, q, configuration, barriers = begun(case, balls=case.balls)
    task, posture = FrameTask(case.tip, position_cost=1.0, orientation_cost=1.0), PostureTask(cost=1e-3)
    posture.set_target(q)
    limits, still = [ConfigurationLimit(model), VelocityLimit(model)], []
    if way == "accelerations":
        limits.append(AccelerationLimit(model, np.array(case.limits[3])))
    if case.locked >= 0:
        still = [LinearHolonomicTask(np.eye(model.nv)[[case.locked]], np.zeros(1), q.copy(), cost=1.0)]
    poses, _ = case.targets()

    def step(k):
        task.set_target(pin.SE3(poses[k]))
        v = pink.solve_ik(
            configuration, [task, posture], case.dt, solver="daqp", limits=limits, constraints=still,
            barriers=barriers,
        )  # fmt: skip
        if way == "accelerations":
            limits[-1].set_last_integration(v, case.dt)
        configuration.integrate_inplace(v, case.dt)
        return configuration.q

    return step


def of_charge(charge):
    """What gives the speeds of a tick."""
    model, q, configuration, barriers = begun(charge, boxes=[charge.box] if charge.box else ())
    task = FrameTask(charge.tip, position_cost=1.0, orientation_cost=charge.length)
    damping = DampingTask(cost=DAMPING_COST)
    accelerations = AccelerationLimit(model, np.array(charge.limits[3]))
    limits = [ConfigurationLimit(model), VelocityLimit(model), accelerations]

    def velocity(at, pose, twist, failed, v):
        configuration.update(at)
        T = configuration.get_transform_frame_to_world(charge.tip).homogeneous
        task.set_target(pin.SE3(aimed(T, pose, twist, charge.gain, charge.dt)))
        limits[-1].set_last_integration(v, charge.dt)
        locks = [
            LinearHolonomicTask(np.eye(model.nv)[[i]], np.zeros(1), q, cost=1.0, gain=0.0)
            for i in np.flatnonzero(failed)
        ]
        for kept in (limits, limits[:2]):
            try:
                return pink.solve_ik(
                    configuration, [task, damping], charge.dt, solver="daqp", limits=kept, constraints=locks,
                    barriers=barriers, safety_break=False,
                )  # fmt: skip
            except pink.exceptions.PinkError:
                continue
        return None

    return velocity


if __name__ == "__main__":
    main(of_case, of_charge, ("pin-pink", "pin", "daqp"))
