"""What is left of an arm without some of its joints: manipulability, the worst case, and velocity jumps."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ftqp.analysis.tolerance.null_vectors import jacobians
from ftqp.core.checks import FloatArray, array
from ftqp.core.errors import InputError

NOTHING = 1e-12
"""A share of manipulability below this is none."""


def relative_manipulability(J: Any, failed: Sequence[Sequence[int]] | None = None) -> FloatArray:
    """w(J without the columns F)/w(J) for each set F of joints, (..., sets), 0 to 1, w = sqrt(det(J J')).

        sqrt(det (1 - J^+ J)_FF) = the product of the singular values of the rows F of N

    The columns of N are an orthonormal basis of the self-motions. With one joint to spare it is the size of
    the entries of the unit null vector. Units of rows do not matter.
    Source: roberts1996; docs/theory/coverage.md, "Null vector and minors".

    Args:
        J: Jacobians, (..., m, n).
        failed: Sets of joints by 0-based index; None is each joint alone.

    Raises:
        InputError: J is no Jacobian, or a set is empty or has a joint that there is not.
    """
    matrices = jacobians(J)
    _, _, Vt = np.linalg.svd(matrices)
    N = np.swapaxes(Vt[..., matrices.shape[-2] :, :], -1, -2)
    sets = [(i,) for i in range(matrices.shape[-1])] if failed is None else list(failed)
    found = []
    for joints in sets:
        F = _indices(joints, matrices.shape[-1])
        if len(F) > N.shape[-1]:
            found.append(np.zeros(matrices.shape[:-2]))
        elif len(F) == 1:
            found.append(np.linalg.norm(N[..., F[0], :], axis=-1))
        else:
            found.append(np.linalg.svd(N[..., F, :], compute_uv=False).prod(axis=-1))
    return np.stack(found, axis=-1)


def worst_case(J: Any, failed: Sequence[Sequence[int]] | None = None) -> FloatArray:
    """The least relative manipulability over some sets of joints, (...), at most sqrt(r/n) over each alone.

    Args:
        J: Jacobians, (..., m, n).
        failed: As in ``relative_manipulability``.

    Raises:
        InputError: J is no Jacobian, or a set is empty or has a joint that there is not.
    """
    return np.asarray(relative_manipulability(J, failed).min(axis=-1))


def velocity_jump(J: Any, v: Any, joint: int) -> FloatArray:
    """v+ - v when a joint that moves is locked at once and the task's velocity stays, (n,) [rad/s or m/s].

        v+ - v = -P e_j v_j / P_jj,  P = 1 - J^+ J,  of length |v_j| / sqrt(P_jj)

    It is the only jump with one joint to spare, and the smallest with more. Where the joint is needed it has
    no answer, and the entries are infinite.
    Source: docs/theory/coverage.md, "The velocity jump".

    Args:
        J: The Jacobian, (m, n).
        v: Velocities before the lock, (n,) [rad/s or m/s].
        joint: The joint that locks, its 0-based index.

    Raises:
        InputError: J is no Jacobian, v has another length, or there is no such joint.
    """
    matrix = jacobians(J)
    if matrix.ndim != 2:
        raise InputError(f"J has shape {matrix.shape}, expected (m, n)")
    speed = array("v", v, (matrix.shape[1],), "(n,)")
    j = int(_indices((joint,), matrix.shape[1])[0])
    P = _projector(matrix)
    if not P[j, j] > NOTHING:
        return np.zeros(len(speed)) if speed[j] == 0.0 else np.full(len(speed), np.inf)
    return np.asarray(-P[:, j] * speed[j] / P[j, j])


def _projector(J: FloatArray) -> FloatArray:
    """1 - J^+ J, (..., n, n), of the rows that move independently."""
    _, sigma, Vt = np.linalg.svd(J, full_matrices=False)
    kept = sigma > NOTHING * sigma[..., :1]
    V = np.where(kept[..., None], Vt, 0.0)
    return np.asarray(np.eye(J.shape[-1]) - np.swapaxes(V, -1, -2) @ V)


def _indices(joints: Iterable[int], n: int) -> Any:
    found = np.array(sorted({int(i) for i in joints}), dtype=np.int64)
    if not len(found) or found[0] < 0 or found[-1] >= n:
        raise InputError(f"failed has the set {list(joints)}, expected joints by index from 0 to {n - 1}")
    return found
