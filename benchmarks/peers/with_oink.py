"""roboplan's OInK leads an arm: frame task, limits of range, speed and acceleration, locks as speeds of 0."""

import numpy as np
from roboplan import core, optimal_ik

from peers.servant import aimed, main

REGULARIZATION = 1e-6
"""Of what the task leaves free: the square of pink's damping cost."""
TOLERANCE = 1e-9
"""Of its solver; its default of 1e-6 leaves 0.01 rad/s in a tick of 1 ms."""


def make(charge):
    """What gives the speeds of a tick."""
    scene = core.Scene("arm", core.loadUrdfSceneDescriptionFromXml(charge.urdf))
    scene.addGroup("arm", charge.joints)
    settings = optimal_ik.OinkSettings()
    settings.eps_abs = TOLERANCE
    solver = optimal_ik.Oink(scene, "arm", settings)
    pose = core.CartesianConfiguration("", charge.tip, np.eye(4))
    options = optimal_ik.FrameTaskOptions(position_cost=1.0, orientation_cost=charge.length**2)
    task = optimal_ik.FrameTask(solver, scene, pose, options)
    _, _, speed, acceleration = (np.array(row) for row in charge.limits)
    limits = [
        optimal_ik.PositionLimit(solver, 1.0), optimal_ik.VelocityLimit(solver, charge.dt, speed),
        optimal_ik.AccelerationLimit(solver, charge.dt, acceleration),
    ]  # fmt: skip
    change = np.zeros(solver.num_variables)

    def velocity(at, pose, twist, failed, v):
        T = scene.forwardKinematics(at, charge.tip)
        task.setTargetFrameTransform(np.asfortranarray(aimed(T, pose, twist, charge.gain, charge.dt)))
        limits[1].v_max = np.where(failed, 0.0, speed)
        limits[2].setLastVelocity(v)
        for kept in (limits, limits[:2]):
            try:
                solver.solveIk(at, [task], kept, [], change, REGULARIZATION)
                return change / charge.dt
            except RuntimeError:
                continue
        return None

    return velocity


if __name__ == "__main__":
    main(None, make, ("roboplan-oink", "roboplan-core"))
