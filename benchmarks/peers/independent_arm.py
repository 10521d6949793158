"""An arm of revolute joints by its pinocchio model, many configurations at once, in numpy: an oracle.

It shares no formula with ftqp's kernel: placements come from the model, everything else is here.
"""

import numpy as np

AXES = {"RX": (1.0, 0.0, 0.0), "RY": (0.0, 1.0, 0.0), "RZ": (0.0, 0.0, 1.0)}
TOLERANCE = 1e-6
"""Error of a posture that counts as none [m, and rad times the length]."""
ITERATIONS, DAMPING, LONGEST = 80, 0.03, 0.5
PORTION = 250


class IndependentArm:
    """Poses, Jacobians and restarts of inverse kinematics of a serial arm whose joints turn.

    Args:
        robot: An ``ftqp.Robot``, of which the pinocchio model, the tip and the position limits are read.
    """

    def __init__(self, robot) -> None:
        model = robot.model
        self.n = robot.nv
        self.places = [model.jointPlacements[i].homogeneous for i in range(1, model.njoints)]
        self.axes = [self._axis(model.joints[i]) for i in range(1, model.njoints)]
        frame = model.frames[model.getFrameId(robot.tip)]
        self.tip = frame.placement.homogeneous
        if frame.parentJoint != self.n:
            raise SystemExit(f"{robot.name}: the tip does not hang on the last joint")
        self.low, self.high = robot.limits.q_min.copy(), robot.limits.q_max.copy()
        self.length = robot.length

    @staticmethod
    def _axis(joint):
        kind = joint.shortname().removeprefix("JointModel")
        if kind in AXES:
            return np.array(AXES[kind])
        if kind == "RevoluteUnaligned":
            return np.array(joint.extract().axis)
        raise SystemExit(f"a joint of kind {kind} is not served by the oracle")

    def poses(self, q):
        """Rotations (k, 3, 3), positions (k, 3) and Jacobians (k, 6, n) along the base's axes."""
        k = len(q)
        R, p = np.tile(np.eye(3), (k, 1, 1)), np.zeros((k, 3))
        axes, origins = np.empty((k, self.n, 3)), np.empty((k, self.n, 3))
        for i, (place, axis) in enumerate(zip(self.places, self.axes, strict=True)):
            p = p + R @ place[:3, 3]
            R = R @ place[:3, :3]
            axes[:, i], origins[:, i] = R @ axis, p
            K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
            s, c = np.sin(q[:, i])[:, None, None], np.cos(q[:, i])[:, None, None]
            R = R @ (np.eye(3) + s * K + (1.0 - c) * (K @ K))
        p = p + R @ self.tip[:3, 3]
        R = R @ self.tip[:3, :3]
        linear = np.cross(axes, p[:, None] - origins)
        return R, p, np.concatenate([linear, axes], axis=2).swapaxes(1, 2)

    def errors(self, q, goal):
        """(k, 6): p_d - p [m] and the rotation vector of R_d R' [rad]; with the Jacobians."""
        R, p, J = self.poses(q)
        M = goal[:3, :3] @ R.swapaxes(1, 2)
        w = 0.5 * np.stack(
            [M[:, 2, 1] - M[:, 1, 2], M[:, 0, 2] - M[:, 2, 0], M[:, 1, 0] - M[:, 0, 1]], axis=1
        )
        s = np.linalg.norm(w, axis=1)
        angle = np.arctan2(s, 0.5 * (np.trace(M, axis1=1, axis2=2) - 1.0))
        w *= np.where(s > 1e-12, angle / np.maximum(s, 1e-12), 1.0)[:, None]
        return np.concatenate([goal[:3, 3] - p, w], axis=1), J

    def restarts(self, goal, near, locked, *, count=2000, rows=6, seed=0):
        """A posture with the locked joints where ``near`` has them, or None after so many random restarts.

        Damped least squares, joints clipped at their limits, 80 iterations each.

        Args:
            goal: (4, 4).
            near: The first start, (n,).
            locked: Indices of joints that stand still.
            count: Restarts.
            rows: 6 for the pose, 3 for the position.
            seed: Of the restarts.
        """
        generator = np.random.default_rng(seed)
        scale = np.array([1.0, 1.0, 1.0, *3 * [self.length]])[:rows]
        free = np.setdiff1d(np.arange(self.n), locked)
        low = np.where(np.isfinite(self.low), self.low, -np.pi)
        high = np.where(np.isfinite(self.high), self.high, np.pi)
        for first in range(0, count, PORTION):
            q = generator.uniform(low, high, (min(PORTION, count - first), self.n))
            q[:, locked] = near[locked]
            if first == 0:
                q[0, free] = near[free]
            for _ in range(ITERATIONS):
                e, J = self.errors(q, goal)
                e, A = e[:, :rows] * scale, J[:, :rows][:, :, free] * scale[:, None]
                size = np.linalg.norm(e, axis=1)
                done = size < TOLERANCE
                if done.any():
                    return q[np.flatnonzero(done)[np.argmin(np.abs(q[done] - near).max(axis=1))]]
                G = A @ A.swapaxes(1, 2) + (DAMPING * np.minimum(size, 0.3) ** 2)[:, None, None] * np.eye(
                    rows
                )
                d = np.einsum(
                    "kri,kr->ki", A, np.linalg.solve(G + 1e-12 * np.eye(rows), e[:, :, None])[..., 0]
                )
                d *= np.minimum(1.0, LONGEST / np.maximum(np.abs(d).max(axis=1, keepdims=True), 1e-12))
                q[:, free] = np.clip(q[:, free] + d, low[free], high[free])
        return None
