"""pink leads an arm: frame and damping task, limits of range, speed and acceleration, locks as equalities.

With a box in the way it has its barrier against collisions of capsules.
"""

import numpy as np
import pink
import pinocchio as pin
from pink.barriers import SelfCollisionBarrier
from pink.limits import AccelerationLimit, ConfigurationLimit, VelocityLimit
from pink.tasks import DampingTask, FrameTask, LinearHolonomicTask

from peers.pink_shapes import BARRIER_GAIN, arm_and_world
from peers.servant import aimed, serve

DAMPING_COST = 1e-3
"""Of what the task leaves free; a posture task in its place strays farther and ends farther off."""


def make(charge):
    """What gives the speeds of a tick."""
    model = pin.buildModelFromXML(charge.urdf)
    low, high, speed, acceleration = (np.array(row) for row in charge.limits)
    model.lowerPositionLimit, model.upperPositionLimit = np.maximum(low, -1e3), np.minimum(high, 1e3)
    model.velocityLimit = speed
    q, shapes, barriers = np.array(charge.q), None, []
    if charge.box:
        shapes = arm_and_world(model, charge.rods, boxes=[charge.box])
        barriers = [SelfCollisionBarrier(len(shapes.collisionPairs), gain=BARRIER_GAIN, d_min=charge.keep)]
    configuration = pink.Configuration(
        model, model.createData(), q.copy(), collision_model=shapes,
        collision_data=None if shapes is None else shapes.createData(),
    )  # fmt: skip
    task = FrameTask(charge.tip, position_cost=1.0, orientation_cost=charge.length)
    damping = DampingTask(cost=DAMPING_COST)
    limits = [ConfigurationLimit(model), VelocityLimit(model), AccelerationLimit(model, acceleration)]

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
    serve(make, ("pin-pink", "pin", "daqp"))
