"""Joint positions (nv,) and pinocchio's configuration (nq,), which has two numbers for a continuous joint."""

from typing import Any

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray, array, numbers


def positions_of(model: Any, continuous: BoolArray, q: Any) -> FloatArray:
    """Joint positions (nv,) from (nv,) positions or from pinocchio's configuration (nq,) [rad or m].

    Raises:
        InputError: The shape is another one, or a number is NaN or infinite.
    """
    nv, given = len(continuous), numbers("q", q)
    if model.nq == nv or given.shape == (nv,):
        return array("q", given, (nv,), "(nv,)")
    configuration = array("q", given, (int(model.nq),), "(nv,) or (nq,)")
    result = np.empty(nv)
    for i, at in enumerate(model.idx_qs[1:]):
        if continuous[i]:
            result[i] = np.arctan2(configuration[at + 1], configuration[at])
        else:
            result[i] = configuration[at]
    return result


def configuration_of(model: Any, continuous: BoolArray, positions: FloatArray) -> FloatArray:
    """pinocchio's configuration (nq,) from joint positions (nv,) [rad or m]."""
    result = np.empty(int(model.nq))
    for i, at in enumerate(model.idx_qs[1:]):
        if continuous[i]:
            result[at : at + 2] = np.cos(positions[i]), np.sin(positions[i])
        else:
            result[at] = positions[i]
    return result
