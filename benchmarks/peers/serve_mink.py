"""mink leads an arm: frame and damping task, limits of range and speed, locks as frozen joints.

With a box in the way it has its limit of collision avoidance.
"""

import mink
import mujoco
import numpy as np

from peers.near_mink import COMPILER, DETECTED
from peers.servant import aimed, serve

DAMPING_COST = 1e-3
"""Of what the task leaves free, as for pink."""


def model_of(charge):
    """The arm, with its capsules and the box if there is one, and their names."""
    at = charge.urdf.index(">", charge.urdf.index("<robot")) + 1
    spec = mujoco.MjSpec.from_string(charge.urdf[:at] + COMPILER + charge.urdf[at:])
    bodies = {joint.name: joint.parent for joint in spec.joints}
    arm = []
    for k, (joint, *rest) in enumerate(charge.rods if charge.box else []):
        if joint < 0:
            continue
        ends, name = rest[:6], f"rod {k}"
        place = {"fromto": ends} if rest[:3] != rest[3:6] else {"pos": rest[:3]}
        kind = mujoco.mjtGeom.mjGEOM_CAPSULE if "fromto" in place else mujoco.mjtGeom.mjGEOM_SPHERE
        bodies[charge.joints[int(joint)]].add_geom(
            name=name, type=kind, size=(rest[6], 0.0, 0.0), mass=0.0, **place
        )
        arm.append(name)
    if charge.box:
        half, place = 0.5 * np.array(charge.box[:3]), charge.box[3:]
        spec.worldbody.add_geom(name="box", type=mujoco.mjtGeom.mjGEOM_BOX, size=half, pos=place)
    return spec.compile(), arm


def make(charge):
    """What gives the speeds of a tick."""
    model, arm = model_of(charge)
    configuration = mink.Configuration(model, np.array(charge.q))
    task = mink.FrameTask(charge.tip, "body", position_cost=1.0, orientation_cost=charge.length)
    damping = mink.DampingTask(model, cost=DAMPING_COST)
    speeds = {name: float(v) for name, v in zip(charge.joints, charge.limits[2], strict=True)}
    limits = [mink.ConfigurationLimit(model), mink.VelocityLimit(model, speeds)]
    if charge.box:
        limits.append(
            mink.CollisionAvoidanceLimit(
                model, [(arm, ["box"])], minimum_distance_from_collisions=charge.keep,
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
    serve(make, ("mink", "mujoco", "daqp"))
