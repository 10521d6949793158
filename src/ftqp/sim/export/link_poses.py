"""Where each link stands in the one before it, for many postures at once: what a tree of frames is told."""

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.pose import quaternions
from ftqp.model.chain import Chain


def joint_poses(chain: Chain, i: int, q: FloatArray) -> FloatArray:
    """Pose of joint frame i in that of its parent, position and unit quaternion x, y, z, w, (K, 7) [m].

    (rotation_i, translation_i) Rz(q), or Tz(q) for a joint that slides.

    Args:
        chain: The arm's constants.
        i: 0-based index of the joint.
        q: Its positions, (K,) [rad or m].
    """
    result = np.empty((len(q), 7))
    result[:, :3] = chain.translation[i]
    x, y, z, w = quaternions(chain.rotation[i][None])[0]
    if chain.prismatic[i]:
        result[:, :3] += np.outer(q, chain.rotation[i][:, 2])
        result[:, 3:] = x, y, z, w
        return result
    s, c = np.sin(0.5 * q), np.cos(0.5 * q)
    result[:, 3], result[:, 4] = x * c + y * s, y * c - x * s
    result[:, 5], result[:, 6] = z * c + w * s, w * c - z * s
    return result


def fixed_pose(rotation: FloatArray, translation: FloatArray) -> FloatArray:
    """Position and unit quaternion x, y, z, w, (7,) [m], of a rotation (3, 3) and a translation (3,)."""
    return np.concatenate([translation, quaternions(rotation[None])[0]])
