"""mink past balls: frame and posture task, limits, and its limit of collision avoidance."""

import sys
from importlib.metadata import version

import mink
import mujoco
import numpy as np

from peers.motion_case import run_all
from peers.near_case import read_near

COMPILER = '<mujoco><compiler fusestatic="false" balanceinertia="true"/></mujoco>'
DETECTED = 0.3
"""From which distance on mink looks at a pair [m], three times its examples' value."""


def model_of(case):
    """The arm with its capsules, and the balls."""
    at = case.urdf.index(">", case.urdf.index("<robot")) + 1
    spec = mujoco.MjSpec.from_string(case.urdf[:at] + COMPILER + case.urdf[at:])
    bodies = {joint.name: joint.parent for joint in spec.joints}
    arm, world = [], []
    for k, (joint, *rest) in enumerate(case.rods):
        ends, name = rest[:6], f"rod {k}"
        place = {"fromto": ends} if rest[:3] != rest[3:6] else {"pos": rest[:3]}
        kind = mujoco.mjtGeom.mjGEOM_CAPSULE if "fromto" in place else mujoco.mjtGeom.mjGEOM_SPHERE
        bodies[case.joints[int(joint)]].add_geom(
            name=name, type=kind, size=(rest[6], 0.0, 0.0), mass=0.0, **place
        )
        arm.append(name)
    for k, (x, y, z, radius) in enumerate(case.balls):
        spec.worldbody.add_geom(
            name=f"ball {k}", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(radius, 0.0, 0.0), pos=(x, y, z)
        )
        world.append(f"ball {k}")
    return spec.compile(), arm, world


def make(case):
    """The step of a case."""
    model, arm, world = model_of(case)
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


if __name__ == "__main__":
    names = ("mink", "mujoco", "daqp")
    run_all(make, read_near(sys.argv[1]), sys.argv[2], {name: version(name) for name in names})
