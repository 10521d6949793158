"""mink: frame task, limits of range and speed, locks as frozen joints, its limit of collision avoidance.

Along cases it has a posture task beside, leading an arm a damping task.
"""

import mink
import mujoco
import numpy as np

from peers.servant import aimed, main

COMPILER = '<mujoco><compiler fusestatic="false" balanceinertia="true"/></mujoco>'
DETECTED = 0.3
"""From which distance on mink looks at a pair [m], three times its examples' value."""
DAMPING_COST = 1e-3
"""Of what the task leaves free, as for pink."""


def model_of(given, rods, *, balls=(), boxes=()):
    """An arm with its capsules and what stands around it, and the names of both."""
    at = given.urdf.index(">", given.urdf.index("<robot")) + 1
    spec = mujoco.MjSpec.from_string(given.urdf[:at] + COMPILER + given.urdf[at:])
    bodies = {joint.name: joint.parent for joint in spec.joints}
    arm, kinds = [], mujoco.mjtGeom
    for k, (joint, *rest) in enumerate(rods):
        if joint < 0:
            continue
        ends, name = rest[:6], f"rod {k}"
        place = {"fromto": ends} if rest[:3] != rest[3:6] else {"pos": rest[:3]}
        kind = kinds.mjGEOM_CAPSULE if "fromto" in place else kinds.mjGEOM_SPHERE
        bodies[given.joints[int(joint)]].add_geom(
            name=name, type=kind, size=(rest[6], 0.0, 0.0), mass=0.0, **place
        )
        arm.append(name)
    things = [(kinds.mjGEOM_SPHERE, (radius, 0.0, 0.0), place) for *place, radius in balls]
    things += [(kinds.mjGEOM_BOX, 0.5 * np.array(one[:3]), one[3:]) for one in boxes]
    world = [f"thing {k}" for k in range(len(things))]
    for name, (kind, size, place) in zip(world, things, strict=True):
        spec.worldbody.add_geom(name=name, type=kind, size=size, pos=place)
    return spec.compile(), arm, world


def of_case(case, _):
    """The step of a case."""
    model, arm, world = model_of(case, case.rods, balls=case.balls)
    configuration = mink.Configuration(model, np.array(case.q))
    task = mink.FrameTask(case.tip, "body", position_cost=1.0, orientation_cost=1.0)
    posture = mink.PostureTask(model, cost=1e-3)
    posture.set_target(np.array(case.q))
    speeds = {name: float(v) for name, v in zip(case.joints, case.limits[2], strict=True)}
    limits = [
        mink.ConfigurationLimit(model),
        mink.VelocityLimit(model, speeds),
        mink.CollisionAvoidanceLimit(
            model, [(arm, world)], minimum_distance_from_collisions=case.keep,
            collision_detection_distance=DETECTED,
        ),
    ]  # fmt: skip
    constraints = [mink.DofFreezingTask(model, [case.locked])] if case.locked >= 0 else None
    poses, _ = case.targets()

    def step(k):
        task.set_target(mink.SE3.from_matrix(poses[k]))
        v = mink.solve_ik(
            configuration, [task, posture], case.dt, "daqp", limits=limits, constraints=constraints
        )
        configuration.integrate_inplace(v, case.dt)
        return configuration.q

    return step


def of_charge(charge):
    """What gives the speeds of a tick."""
    boxes = [charge.box] if charge.box else []
    model, arm, world = model_of(charge, charge.rods if boxes else (), boxes=boxes)
    configuration = mink.Configuration(model, np.array(charge.q))
    task = mink.FrameTask(charge.tip, "body", position_cost=1.0, orientation_cost=charge.length)
    damping = mink.DampingTask(model, cost=DAMPING_COST)
    speeds = {name: float(v) for name, v in zip(charge.joints, charge.limits[2], strict=True)}
    limits = [mink.ConfigurationLimit(model), mink.VelocityLimit(model, speeds)]
    if boxes:
        limits.append(
            mink.CollisionAvoidanceLimit(
                model, [(arm, world)], minimum_distance_from_collisions=charge.keep,
                collision_detection_distance=DETECTED,
            )
        )  # fmt: skip

    def velocity(at, pose, twist, failed, v):
        configuration.update(at)
        T = configuration.get_transform_frame_to_world(charge.tip, "body").as_matrix()
        task.set_target(mink.SE3.from_matrix(aimed(T, pose, twist, charge.gain, charge.dt)))
        locked = np.flatnonzero(failed).tolist()
        constraints = [mink.DofFreezingTask(model, locked)] if locked else None
        try:
            return mink.solve_ik(
                configuration, [task, damping], charge.dt, "daqp", limits=limits, constraints=constraints
            )
        except mink.exceptions.MinkError:
            return None

    return velocity


if __name__ == "__main__":
    main(of_case, of_charge, ("mink", "mujoco", "daqp"))
