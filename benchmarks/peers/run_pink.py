"""pink along the cases of a file: frame and posture task, limits, the locked joint as an equality.

The third argument is ``plain`` or ``accelerations``, which adds pink's AccelerationLimit.
"""

import sys
from importlib.metadata import version

import numpy as np
import pink
import pinocchio as pin
from pink.limits import AccelerationLimit, ConfigurationLimit, VelocityLimit
from pink.tasks import FrameTask, LinearHolonomicTask, PostureTask

from peers.motion_case import read, run_all


def maker(accelerations):
    """What makes the step of a case."""

    def make(case):
        model = pin.buildModelFromXML(case.urdf)
        low, high, speed, acceleration = (np.array(row) for row in case.limits)
        model.lowerPositionLimit, model.upperPositionLimit = np.maximum(low, -1e3), np.minimum(high, 1e3)
        model.velocityLimit = speed
        q = np.array(case.q)
        configuration = pink.Configuration(model, model.createData(), q.copy())
        task, posture = FrameTask(case.tip, position_cost=1.0, orientation_cost=1.0), PostureTask(cost=1e-3)
        posture.set_target(q)
        limits = [ConfigurationLimit(model), VelocityLimit(model)]
        if accelerations:
            limits.append(AccelerationLimit(model, acceleration))
        row = np.zeros((1, model.nv))
        row[0, case.locked] = 1.0
        still = [LinearHolonomicTask(row, np.zeros(1), q.copy(), cost=1.0)]
        poses, _ = case.targets()

        def step(k):
            task.set_target(pin.SE3(poses[k]))
            v = pink.solve_ik(
                configuration, [task, posture], case.dt, solver="daqp", limits=limits, constraints=still
            )
            if accelerations:
                limits[-1].set_last_integration(v, case.dt)
            configuration.integrate_inplace(v, case.dt)
            return configuration.q

        return step

    return make


if __name__ == "__main__":
    names = ("pin-pink", "pin", "daqp")
    run_all(
        maker(sys.argv[3] == "accelerations"), read(sys.argv[1]), sys.argv[2],
        {name: version(name) for name in names},
    )  # fmt: skip
