"""Whether a pose can be gone to with some joints locked: random postures and RRT-Connect among true meshes.

It shares no code with ftqp: numpy, pinocchio and coal; edges are looked at every 0.05 rad.
"""

import numpy as np
import pinocchio as pin

STEPS, LONGEST = 60, 0.5
SPACING, REACH, NODES = 0.05, 1.0, 3000
MOST = 32


class MeshOracle:
    """What a long search by the true meshes says of one scene.

    Args:
        arm: An ``IndependentArm``.
        judge: The meshes.
        things: What is around, as ``things_of`` gives it.
        keep: How far bodies are to be apart [m]; those that are nearer at the start may stay as near.
    """

    def __init__(self, arm, judge, things, keep):
        self.arm, self.model, self.data, self.keep = arm, judge.model, judge.model.createData(), keep
        self.low, self.high = arm.low, arm.high
        self.geometry = judge.scene_with(things)
        self.asked = pin.GeometryData(self.geometry)
        self.found = None

    def solves(self, start, pose, failed, starts, tolerances, seed=0):
        """Whether there is a way: "yes", or what was not found; the nearest clear posture is ``found``."""
        self._allow(start)
        free = np.array([j not in failed for j in range(len(start))])
        random = np.random.default_rng(seed)
        postures = self._postures(start, pose, free, starts, tolerances, random)
        if not len(postures):
            return "no posture"
        clear = [q for q in postures[np.argsort(np.abs(postures - start).max(axis=1))] if not self._meets(q)]
        if not clear:
            return "no clear posture"
        self.found = clear[0]
        return "yes" if self._joins(start, clear[:MOST], free, random) else "no way"

    def _allow(self, start):
        """Keep the pairs apart, or as near as they are at the start."""
        pin.computeDistances(self.model, self.data, self.geometry, self.asked, start)
        for request, result in zip(self.asked.collisionRequests, self.asked.distanceResults, strict=True):
            request.security_margin = min(self.keep, result.min_distance - 1e-4)

    def _meets(self, q):
        return pin.computeCollisions(self.model, self.data, self.geometry, self.asked, q, True)

    def _postures(self, start, pose, free, starts, tolerances, random):
        """Postures of the pose by damped Newton steps from many places at once."""
        q = np.where(free, random.uniform(self.low, self.high, (starts, len(start))), start)
        q[0], scale = start, np.array([1.0] * 3 + [tolerances[0] / tolerances[1]] * 3)
        for _ in range(STEPS):
            e, J = self.arm.errors(q, pose)
            e, A = e * scale, J * scale[:, None] * free
            pull = np.einsum("kij,ki->kj", A, e)
            stands = ((q <= self.low) & (pull < 0.0)) | ((q >= self.high) & (pull > 0.0))
            A = A * ~stands[:, None]
            damping = 0.02 * np.einsum("ki,ki->k", e, e) + 1e-10
            M = A @ A.swapaxes(1, 2) + damping[:, None, None] * np.eye(6)
            step = np.einsum("kij,ki->kj", A, np.linalg.solve(M, e[:, :, None])[:, :, 0])
            step *= np.minimum(1.0, LONGEST / np.maximum(np.abs(step).max(axis=1), 1e-12))[:, None]
            q = np.where(free, np.clip(q + step, self.low, self.high), start)
        e, _ = self.arm.errors(q, pose)
        off = np.stack([np.linalg.norm(e[:, :3], axis=1), np.linalg.norm(e[:, 3:], axis=1)], axis=1)
        return q[(off <= tolerances).all(axis=1)]

    def _goes(self, a, b):
        """Up to where the straight way from a to b is clear, as a share."""
        count = max(1, int(np.ceil(np.abs(b - a).max() / SPACING)))
        for k in range(1, count + 1):
            if self._meets(a + k / count * (b - a)):
                return (k - 1) / count
        return 1.0

    def _joins(self, start, goals, free, random):
        """RRT-Connect from the start to any of the goals."""
        if any(self._goes(start, goal) == 1.0 for goal in goals):
            return True
        trees = [[start], list(goals)]
        for _ in range(NODES):
            q = np.where(free, random.uniform(self.low, self.high), start)
            new = self._grown(trees[0], q)
            if new is not None:
                while True:
                    last = self._grown(trees[1], new)
                    if last is None:
                        break
                    if last is new:
                        return True
            trees.reverse()
        return False

    def _grown(self, tree, q):
        """A tree's new node, one step towards a place; the place itself where it is there."""
        a = tree[int(np.argmin(np.linalg.norm(np.array(tree) - q, axis=1)))]
        far = np.linalg.norm(q - a)
        if far < 1e-6:
            return q
        b = q if far <= REACH else a + REACH / far * (q - a)
        share = self._goes(a, b)
        if share < 0.2:
            return None
        tree.append(b if share == 1.0 else a + share * (b - a))
        return tree[-1]
