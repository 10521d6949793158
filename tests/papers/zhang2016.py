"""The seven-joint example, and its continuations in plain numpy."""

from math import cos, sin

import numpy as np
from scipy.spatial.transform import Rotation

from ftqp.analysis.survival.task_path import task_path
from ftqp.control.paths import PointToPoint
from ftqp.kernel.layout.enums import Survival
from ftqp.model import catalog
from ftqp.model.catalog.arms import published

ARM = catalog.load("zhang7").with_limits(v_max=np.inf)
FIGURES = published("zhang7")
Q0 = np.array(FIGURES["neutral"])
BEND = np.deg2rad(150.0)


def end_pose():
    goal = np.eye(4)
    goal[:3, :3] = Rotation.from_euler("xyz", [-1.0, -0.5, -2.0]).as_matrix()
    goal[:3, 3] = 9.6, 0.0, 3.0
    return goal


def example(dt, share=1.0):
    """The path of the example, or a share of its way, on a grid."""
    start, goal = ARM.pose(Q0), end_pose()
    turn = (Rotation.from_matrix(start[:3, :3]).inv() * Rotation.from_matrix(goal[:3, :3])).as_rotvec()
    end = np.eye(4)
    end[:3, :3] = start[:3, :3] @ Rotation.from_rotvec(share * turn).as_matrix()
    end[:3, 3] = start[:3, 3] + share * (goal[:3, 3] - start[:3, 3])
    return task_path(ARM, PointToPoint(start, end, duration=20.0), dt=dt)


def forward(q):
    """Pose and geometric Jacobian by standard Denavit-Hartenberg matrices."""
    T, axes, origins = np.eye(4), [], []
    for angle, (offset, d, a, alpha) in zip(q, FIGURES["dh"], strict=True):
        axes.append(T[:3, 2])
        origins.append(T[:3, 3])
        c, s, ca, sa = cos(angle + offset), sin(angle + offset), cos(alpha), sin(alpha)
        T = T @ np.array(
            [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0.0, sa, ca, d], [0.0, 0.0, 0.0, 1.0]]
        )
    Z, O = np.array(axes), np.array(origins)
    return T, np.vstack([np.cross(Z, T[:3, 3] - O).T, Z.T])


def error(goal, T):
    return np.concatenate(
        [goal[:3, 3] - T[:3, 3], Rotation.from_matrix(goal[:3, :3] @ T[:3, :3].T).as_rotvec()]
    )


def plain_continuation(goals, q, first, j, guarded=True):
    """The verdict on one pair: Newton steps of six joints, by numpy's solver."""
    left = [i for i in range(7) if i != j]
    q, step = q.copy(), np.zeros(7)
    side = np.sign(np.linalg.det(forward(q)[1][:, left]))
    for goal in goals[first + 1 :]:
        before = q.copy()
        q = q + step
        for _ in range(6):
            T, J = forward(q)
            e = error(goal, T)
            if np.abs(e).max() < 1e-10:
                break
            if guarded and np.linalg.det(J[:, left]) * side <= 0.0:
                return Survival.SINGULAR
            q[left] += np.clip(np.linalg.solve(J[:, left], e), -0.5, 0.5)
        e = error(goal, forward(q)[0])
        if np.linalg.norm(e[:3]) > 1e-5 or np.linalg.norm(e[3:]) > 1e-5:
            return Survival.NOT_CONVERGED
        if np.abs(q[left]).max() > BEND:
            return Survival.LIMIT
        step = q - before
    return Survival.SURVIVED
