"""Memory of solvers on QPs that no robot made."""

from functools import cache
from typing import Any

import numpy as np

from ftqp.kernel.layout.rooms import qp_fields

VARIABLES = 128
ROWS = 64
CONSTRAINTS = 512
"""Capacity of a QP that the active set solves alone."""


@cache
def standalone_dtype() -> np.dtype[Any]:
    """The type of a record that holds a standalone QP."""
    return np.dtype(
        [
            *qp_fields(VARIABLES, ROWS, CONSTRAINTS),
            ("centre", "f8", (VARIABLES,)),
            ("g_given", "f8", (VARIABLES,)),
            ("diagonal_given", "f8", (VARIABLES,)),
        ],
        align=True,
    )
