"""Weights of the joint rates, and their check."""

from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, array, numbers
from ftqp.core.errors import InputError


def weights_inverse(W: Any, n: int) -> FloatArray:
    """M = W^-1 of the weights of the joint rates, (n, n); None is the identity."""
    if W is None:
        return np.eye(n)
    W = numbers("W", W)
    given = np.diag(array("W", W, (n,), "(nv,)")) if W.ndim == 1 else array("W", W, (n, n), "(nv, nv)")
    if not np.allclose(given, given.T, rtol=1e-9, atol=1e-12 * float(np.abs(given).max())):
        raise InputError(
            "W is not symmetric, expected a symmetric positive definite matrix; use (W + W.T) / 2"
        )
    least, largest = np.linalg.eigvalsh(given)[[0, -1]]
    if not least > 1e-12 * max(largest, 1e-300):
        raise InputError(
            f"W has the eigenvalue {least:.3g}, expected a positive definite matrix; "
            "add a multiple of the identity"
        )
    inverse = np.linalg.inv(given)
    return np.asarray(0.5 * (inverse + inverse.T))
