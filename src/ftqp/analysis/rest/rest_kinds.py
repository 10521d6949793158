"""What becomes of an arm near a rest: it is drawn there, repelled, or both, by all eigenvalues."""

from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from ftqp.analysis.goals import GoalStudy
from ftqp.analysis.rest.linearisation import reduced_jacobians, still_joints
from ftqp.core.checks import FloatArray

NEUTRAL = 1e-8
"""Share of the largest eigenvalue below which a real part counts as zero."""


class RestKind(StrEnum):
    """What a rest does with configurations near it."""

    SINK = "sink"
    SADDLE = "saddle"
    SOURCE = "source"
    DEGENERATE = "degenerate"
    OUTSIDE = "outside"


MEANINGS = {
    RestKind.SINK: "draws the arm there from all sides, off its goal",
    RestKind.SADDLE: "draws it from some sides and repels it to others",
    RestKind.SOURCE: "repels it to all sides",
    RestKind.DEGENERATE: "lies on a whole curve of rests with the joint locked at one value",
    RestKind.OUTSIDE: "lies outside the joint limits",
}
"""In words."""


def eigenvalues_at(study: GoalStudy, M: FloatArray, q: FloatArray, i: int) -> NDArray[np.complex128]:
    """The eigenvalues of the linearisation with joint i locked, (k, n - 1) [1/s at a gain of 1/s].

    Joints that never move the task rows and are not commanded are left out.
    """
    return np.asarray(
        np.linalg.eigvals(reduced_jacobians(study, M, q, [i, *still_joints(study, M)])), dtype=np.complex128
    )


def kind_of(eigenvalues: NDArray[np.complex128]) -> RestKind:
    """The kind of a rest by the real parts of all its eigenvalues.

    A sign of the determinant alone, as in goel2005, misses pairs that cross the imaginary axis, and all
    eigenvalues that change sign together where J is singular.
    """
    if is_neutral(eigenvalues):
        return RestKind.DEGENERATE
    return kind_by_signs(eigenvalues)


def is_neutral(eigenvalues: NDArray[np.complex128]) -> bool:
    """Whether a real part is zero beside the largest eigenvalue."""
    return bool(np.abs(eigenvalues.real).min() < NEUTRAL * np.abs(eigenvalues).max())


def kind_by_signs(eigenvalues: NDArray[np.complex128]) -> RestKind:
    """Sink, saddle or source, by the signs of the real parts alone."""
    real = eigenvalues.real
    positive = int((real > 0.0).sum())
    if positive == 0:
        return RestKind.SINK
    return RestKind.SOURCE if positive == len(real) else RestKind.SADDLE
