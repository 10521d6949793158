"""Pose maths for set-up and reports, in plain numpy; the formulas of a tick are in ``ftqp.kernel``."""

from math import atan2, sqrt
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, array
from ftqp.core.errors import InputError

ORTHONORMAL_TOLERANCE = 1e-6
"""Largest entry of |R'R - I| that still counts as a rotation, and so far may the last row be from 0 0 0 1."""


def pose(value: Any, name: str = "pose") -> FloatArray:
    """A homogeneous transform (4, 4) from an array or anything with ``.homogeneous`` (pinocchio's SE3)."""
    given = getattr(value, "homogeneous", value)
    if isinstance(given, list | tuple | np.ndarray) and len(np.shape(given)) == 1:
        raise InputError(
            f"{name} has shape {np.shape(given)}, expected (4, 4), a rotation and a place: T = np.eye(4), or "
            "robot.pose(q) to keep its rotation, then T[:3, 3] = place"
        )
    result = array(name, given, (4, 4))
    rotation = result[:3, :3]
    if not is_rotation_matrix(rotation):
        off = float(np.abs(rotation.T @ rotation - np.eye(3)).max())
        raise InputError(
            f"{name} has a rotation part that is not a rotation (|R'R - I| = {off:.1e}, "
            f"det = {np.linalg.det(rotation):.3f}); expected an orthonormal, right-handed matrix"
        )
    if not has_last_row(result):
        row, column = (" ".join(f"{x:.4g}" for x in part) for part in (result[3], result[:3, 3]))
        raise InputError(
            f"{name} has the last row {row} and the position {column}, expected the last row 0 0 0 1; if it "
            "is transposed, give its .T"
        )
    return result


def is_rotation_matrix(R: FloatArray) -> bool:
    """Whether |R'R - I| <= ORTHONORMAL_TOLERANCE entry by entry and det R > 0, of a finite R, (3, 3)."""
    off = np.abs(R.T @ R - np.eye(3)).max()
    return bool(off <= ORTHONORMAL_TOLERANCE and np.linalg.det(R) > 0.0)


def has_last_row(T: FloatArray) -> bool:
    """Whether the last row of a finite T, (4, 4), is 0 0 0 1, as that of a transposed pose is not."""
    return bool(np.abs(T[3] - (0.0, 0.0, 0.0, 1.0)).max() <= ORTHONORMAL_TOLERANCE)


def transform(rotation: FloatArray, translation: FloatArray) -> FloatArray:
    """The homogeneous transform (4, 4) of a rotation (3, 3) and a translation (3,) [m]."""
    result = np.eye(4)
    result[:3, :3] = rotation
    result[:3, 3] = translation
    return result


def skew(w: FloatArray) -> FloatArray:
    """[w]x, (3, 3), with [w]x u = w x u."""
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


def rotation_exp(w: FloatArray) -> FloatArray:
    """exp([w]x), (3, 3): Rodrigues' formula for the rotation vector w, (3,) [rad]."""
    angle = float(np.linalg.norm(w))
    if angle < 1e-12:
        return np.eye(3) + skew(w)
    k: FloatArray = skew(w / angle)
    rotation: FloatArray = np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * (k @ k)
    return rotation


def rotation_to(z: FloatArray) -> FloatArray:
    """A rotation (3, 3) whose third column is the unit vector z."""
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def rotation_x(angle: float) -> FloatArray:
    """Rotation about x, (3, 3)."""
    return rotation_exp(np.array([angle, 0.0, 0.0]))


def rotation_z(angle: float) -> FloatArray:
    """Rotation about z, (3, 3)."""
    return rotation_exp(np.array([0.0, 0.0, angle]))


def quaternions(rotations: FloatArray) -> FloatArray:
    """Unit quaternions x, y, z, w with w >= 0 of rotation matrices (K, 3, 3), (K, 4).

    From the largest of the four components, so that nothing is divided by a small number; where w is 0 the
    first other component that is not 0 is positive.

    Source: Shepperd 1978.
    """
    R = np.asarray(rotations, dtype=np.float64)
    x, y, z = R[:, 0, 0], R[:, 1, 1], R[:, 2, 2]
    trace = x + y + z
    products = np.empty((len(R), 4, 4))  # four times the products of the components x, y, z, w
    products[:, 0, 0], products[:, 1, 1] = 1.0 - trace + 2.0 * x, 1.0 - trace + 2.0 * y
    products[:, 2, 2], products[:, 3, 3] = 1.0 - trace + 2.0 * z, 1.0 + trace
    for i, j in ((0, 1), (0, 2), (1, 2)):
        products[:, i, j] = products[:, j, i] = R[:, i, j] + R[:, j, i]
    for i, (j, k) in enumerate(((2, 1), (0, 2), (1, 0))):
        products[:, i, 3] = products[:, 3, i] = R[:, j, k] - R[:, k, j]
    largest = np.argmax(np.stack([x, y, z, trace], axis=1), axis=1)
    chosen = products[np.arange(len(R)), largest]
    result: FloatArray = chosen / np.linalg.norm(chosen, axis=1, keepdims=True)
    leading = result[np.arange(len(R)), np.argmax(result[:, (3, 0, 1, 2)] != 0.0, axis=1) - 1]
    result[leading < 0.0] *= -1.0
    return result


def rotated(quaternions: FloatArray, vectors: FloatArray) -> FloatArray:
    """Vectors p turned by unit quaternions with vector u and scalar w: p + 2 w (u x p) + 2 u x (u x p).

    Args:
        quaternions: x, y, z, w of each, (K, 4).
        vectors: several for each, (K, n, 3).
    """
    u, w = quaternions[:, None, :3], quaternions[:, None, 3:]
    crossed = np.cross(u, vectors)
    result: FloatArray = vectors + 2.0 * w * crossed + 2.0 * np.cross(u, crossed)
    return result


def rotation_vectors(rotations: FloatArray) -> FloatArray:
    """Rotation vectors [rad] of rotation matrices (K, 3, 3), (K, 3): accurate for every angle in [0, pi]."""
    q = quaternions(rotations)
    s = np.linalg.norm(q[:, :3], axis=1)
    factor = np.full(len(q), 2.0)
    np.divide(2.0 * np.arctan2(s, q[:, 3]), s, out=factor, where=s > 0.0)
    result: FloatArray = factor[:, None] * q[:, :3]
    return result


def rotation_vector(rotation: FloatArray) -> FloatArray:
    """The rotation vector [rad] of one rotation matrix (3, 3), (3,)."""
    R = rotation.tolist()
    s = np.array([R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1]]) * 0.5
    cosine = 0.5 * (R[0][0] + R[1][1] + R[2][2] - 1.0)
    if cosine < -0.5:  # the antisymmetric part becomes small near half a turn
        result: FloatArray = rotation_vectors(rotation[None])[0]
        return result
    sine = sqrt(float(s @ s))
    return s if sine < 1e-12 else s * (atan2(sine, cosine) / sine)
