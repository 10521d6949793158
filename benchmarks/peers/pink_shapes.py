"""Bodies of an arm and of what stands around it, for pink's barrier against collisions."""

import coal
import numpy as np
import pinocchio as pin

BARRIER_GAIN = 20.0
"""Of the barrier; pink's examples have 20, and its own default is 1."""


def arm_and_world(model, rods, *, balls=(), boxes=()):
    """The arm's capsules and what stands around it, and all pairs of one of each.

    Args:
        model: The arm.
        rods: Its bodies as in `NearCase`.
        balls: x, y, z and radius of each, (K, 4).
        boxes: Edges and middle of each, (K, 6).
    """
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
