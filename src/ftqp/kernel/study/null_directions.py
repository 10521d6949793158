"""Singular parts of a study's Jacobian, its least-norm step, and directions of its self-motion."""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.maths.singular_directions import singular_directions

CUT_OFF = 1e-12
"""A singular value below this share of the largest counts as zero. Rounding of an SVD, some thousand
times."""


@part_jit
def decompose(S: Any) -> None:
    """A = U diag(sigma) V' into ``U``, ``sigma`` and ``W`` = diag(sigma) V'."""
    study = S.study
    for row in range(study.m):
        for i in range(S.chain.n):
            study.W[row, i] = study.A[row, i]
    singular_directions(study.W, study.m, S.chain.n, study.U, study.sigma)


@jit
def least_step(S: Any, damping: float) -> float:
    """dq = V diag(sigma/(sigma^2 + damping)) U' e into ``dq``; returns its largest entry.

    Without damping it is the least-norm solution of A dq = e.
    """
    study, n = S.study, S.chain.n
    for i in range(n):
        study.dq[i] = 0.0
    for k in range(study.m):
        s = study.sigma[k]
        if s <= CUT_OFF * study.sigma[0]:
            continue
        along = 0.0
        for row in range(study.m):
            along += study.U[row, k] * study.e[row]
        along /= s * s + damping
        for i in range(n):
            study.dq[i] += along * study.W[k, i]
    largest = 0.0
    for i in range(n):
        largest = max(largest, abs(study.dq[i]))
    return largest


@jit
def onto_null_space(S: Any, t: Any) -> float:
    """t <- (1 - V V') t, then of length 1; returns the length that was left of it."""
    study, n = S.study, S.chain.n
    for k in range(study.m):
        s = study.sigma[k]
        if s <= CUT_OFF * study.sigma[0]:
            continue
        along = 0.0
        for i in range(n):
            along += study.W[k, i] * t[i]
        along /= s * s
        for i in range(n):
            t[i] -= along * study.W[k, i]
    square = 0.0
    for i in range(n):
        square += t[i] * t[i]
    size = sqrt(square)
    if size > 0.0:
        for i in range(n):
            t[i] /= size
    return size


@jit
def any_null_direction(S: Any, t: Any) -> None:
    """t <- the direction of self-motion that leaves most of a joint's own direction."""
    n = S.chain.n
    best, which = -1.0, 0
    for j in range(n):
        if S.study.held[j]:
            continue
        for i in range(n):
            t[i] = 1.0 if i == j else 0.0
        left = onto_null_space(S, t)
        if left > best:
            best, which = left, j
    for i in range(n):
        t[i] = 1.0 if i == which else 0.0
    onto_null_space(S, t)
    onto_null_space(S, t)
