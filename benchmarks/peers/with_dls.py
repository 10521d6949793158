"""Damped least squares along the cases of a file: ten lines of pinocchio and numpy."""

import sys
from importlib.metadata import version

import numpy as np
import pinocchio as pin

from peers.motion_case import read, run_all, vector_of

GAIN, DAMPING = 20.0, 0.02


def make(case):
    """The step of a case."""
    model = pin.buildModelFromXML(case.urdf)
    data, tip = model.createData(), model.getFrameId(case.tip)
    low, high, speed, _ = (np.array(row) for row in case.limits)
    q, free = np.array(case.q), np.arange(model.nv) != case.locked
    poses, twists = case.targets()

    def step(k):
        J = pin.computeFrameJacobian(model, data, q, tip, pin.LOCAL_WORLD_ALIGNED)[:, free]
        T = data.oMf[tip]
        e = np.concatenate([poses[k, :3, 3] - T.translation, vector_of(poses[k, :3, :3] @ T.rotation.T)])
        v = J.T @ np.linalg.solve(J @ J.T + DAMPING**2 * np.eye(6), twists[k] + GAIN * e)
        v *= min(1.0, 1.0 / max(np.abs(v / speed[free]).max(), 1e-12))
        q[free] = np.clip(q[free] + case.dt * v, low[free], high[free])
        return q

    return step


if __name__ == "__main__":
    run_all(make, read(sys.argv[1]), sys.argv[2], {name: version(name) for name in ("pin", "numpy")})
