"""The direction of self-motion of an arm with one joint to spare, with a sign of its own, and its minors."""

from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError


def null_vector(J: Any) -> FloatArray:
    """The unit null vector n of J, (..., n), with det [n; J] > 0: a formula of J alone, without memory.

    So its sign is the same at the same posture, and it is continuous along a path wherever J has full rank.
    Multiplying rows of J by positive numbers, as another unit of length does, leaves it as it is.
    Source: docs/theory/coverage.md, "Null vector and minors".

    Args:
        J: Jacobians with one column more than rows, (..., n - 1, n).

    Raises:
        InputError: The shape is another one, or a number is not finite.
    """
    matrices = jacobians(J, spare=1)
    _, _, Vt = np.linalg.svd(matrices)
    u = Vt[..., -1, :]
    sign = np.sign(np.linalg.det(np.concatenate([u[..., None, :], matrices], axis=-2)))
    return np.asarray(u * np.where(sign == 0.0, 1.0, sign)[..., None])


def minors(J: Any) -> FloatArray:
    """Z_i = (-1)^(i+1) det(J without column i), i = 1 .. n, (..., n): w n, with w = sqrt(det(J J')).

    Z has the unit of w and is no direction of self-motion for a given speed; n is.
    Source: zhang2016, eq. 4, which leaves the sign out; docs/theory/coverage.md, "Null vector and minors".

    Args:
        J: Jacobians with one column more than rows, (..., n - 1, n).

    Raises:
        InputError: The shape is another one, or a number is not finite.
    """
    matrices = jacobians(J, spare=1)
    n = matrices.shape[-1]
    each = [(-1.0) ** i * np.linalg.det(np.delete(matrices, i, axis=-1)) for i in range(n)]
    return np.stack(each, axis=-1)


def jacobians(J: Any, *, spare: int | None = None) -> FloatArray:
    """J as an array (..., m, n) of finite numbers."""
    try:
        matrices = np.asarray(J, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"J is {J!r:.60}, expected a Jacobian (m, n)") from error
    if matrices.ndim < 2 or matrices.shape[-1] < matrices.shape[-2]:
        raise InputError(
            f"J has shape {matrices.shape}, expected (m, n) with at least as many columns as rows"
        )
    m, n = matrices.shape[-2:]
    if spare is not None and n - m != spare:
        raise InputError(
            f"J has shape ({m}, {n}), expected one column more than rows; with more joints to spare take "
            "relative_manipulability"
        )
    if not np.isfinite(matrices).all():
        raise InputError("J is not finite, expected numbers")
    return matrices
