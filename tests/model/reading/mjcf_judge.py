"""A robot from an MJCF file beside MuJoCo itself, at random postures."""

from itertools import pairwise

import mujoco
import numpy as np

TOLERANCE = 1e-9
"""Of metres, of rotations, and of torques and inertias over their size."""


def differences(model, robot, postures=100, seed=0):
    """What of a robot's pose, gravity torque, mass matrix and ranges is not MuJoCo's, and by how much.

    Joints on the way to no tip stand where the file has them.
    """
    data, rng = mujoco.MjData(model), np.random.default_rng(seed)
    joints = [_joint(model, name) for name in robot.joints]
    at, dof = ([int(getattr(j, word)[0]) for j in joints] for word in ("qposadr", "dofadr"))
    E = np.eye(robot.nv)
    for i, l in enumerate(robot.chain.lead):
        E[i] = robot.chain.ratio[i] * np.eye(robot.nv)[l]
    low, high = np.maximum(robot.limits.q_min, -2.0), np.minimum(robot.limits.q_max, 2.0)
    worst = {"position": 0.0, "rotation": 0.0, "gravity torque": 0.0, "mass matrix": 0.0, "range": 0.0}

    def see(what, got, want):
        size = max(1.0, float(np.abs(want).max()))
        worst[what] = max(worst[what], float(np.abs(np.asarray(got) - want).max()) / size)

    for _ in range(postures):
        q = rng.uniform(np.minimum(low, high), np.maximum(low, high))
        q = np.where(robot.chain.lead != np.arange(robot.nv), robot.chain.ratio * q[robot.chain.lead], q)
        q = q + np.where(robot.chain.lead != np.arange(robot.nv), robot.chain.offset, 0.0)
        data.qpos[:] = model.qpos0
        data.qpos[at] = q
        mujoco.mj_forward(model, data)
        for tip in robot.tips:
            site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, tip)
            seen = data.site(tip) if site >= 0 else data.body(tip)
            T = robot.pose(q, tip)
            see("position", T[:3, 3], seen.xpos)
            see("rotation", T[:3, :3], seen.xmat.reshape(3, 3))
        see("gravity torque", robot.bias(q, 0.0 * q), E.T @ data.qfrc_bias[dof])
        see("mass matrix", robot.mass_matrix(q), E.T @ _mass_matrix(model, data)[np.ix_(dof, dof)] @ E)
    for i, joint in enumerate(joints):
        if robot.chain.lead[i] == i and i not in robot.chain.lead[robot.chain.lead != np.arange(robot.nv)]:
            true = model.jnt_range[joint.id] if model.jnt_limited[joint.id] else np.array([-np.inf, np.inf])
            if (robot.limits.q_min[i], robot.limits.q_max[i]) != tuple(true):
                see("range", [robot.limits.q_min[i], robot.limits.q_max[i]], true)
    assert all(a.id < b.id for a, b in pairwise(joints))
    return {what: size for what, size in worst.items() if not size <= TOLERANCE}


def _joint(model, name):
    """A joint; one without a name is called after its body, with its number where that has several."""
    if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name) >= 0:
        return model.joint(name)
    body, _, number = name.rpartition("_joint")
    return model.joint(int(model.body(body).jntadr[0]) + int(number or 1) - 1)


def _mass_matrix(model, data):
    M, unit = np.empty((model.nv, model.nv)), np.eye(model.nv)
    for i in range(model.nv):
        mujoco.mj_mulM(model, data, M[i], unit[i])
    return M
