"""Joints that mimic others: q_m = ratio q_l + offset, so that the leader's column carries what they move.

A mimic joint stays a joint of the tree: kinematics, drift and the torques of its body are as of any other.
What is linear in accelerations is folded: with a = E a', column l of J E is J_l + ratio J_m, M becomes E'M E
and h E'h. The mimic joint's own column is then zero, and its command is the image of its leader's.
Source: docs/theory/joint-limits.md, "Joints that mimic others".
"""

from typing import Any

from ftqp.kernel.jit import jit


@jit
def fold_row(chain: Any, row: Any) -> None:
    """Columns of joints that mimic others are added to those of their leaders."""
    for m in range(chain.n):
        l = chain.lead[m]
        if l != m:
            row[l] += chain.ratio[m] * row[m]
            row[m] = 0.0


@jit
def fold_square(chain: Any, S: Any, own: float) -> None:
    """E'S E of a square matrix of the joints, with ``own`` on the diagonal of those that mimic others."""
    for m in range(chain.n):
        l = chain.lead[m]
        if l == m:
            continue
        ratio = chain.ratio[m]
        for i in range(chain.n):
            S[i, l] += ratio * S[i, m]
            S[i, m] = 0.0
        for j in range(chain.n):
            S[l, j] += ratio * S[m, j]
            S[m, j] = 0.0
        S[m, m] = own


@jit
def spread_by(chain: Any) -> float:
    """By how much folding makes the norm of a square matrix grow at most: |E|^2 <= 1 + sum ratio^2."""
    most = 1.0
    for m in range(chain.n):
        if chain.lead[m] != m:
            most += chain.ratio[m] * chain.ratio[m]
    return most


@jit
def fold_columns(kinematics: Any, chain: Any) -> None:
    """J with folded columns; ``J_each`` keeps each joint's own, which second derivatives need."""
    J, each = kinematics.J, kinematics.J_each
    for k in range(6):
        for i in range(chain.n):
            each[k, i] = J[k, i]
        fold_row(chain, J[k])


@jit
def columns(kinematics: Any, chain: Any) -> Any:
    """The tip's Jacobian with a column for every joint by itself."""
    return kinematics.J_each if chain.mimics else kinematics.J


@jit
def mimic(chain: Any, x: Any) -> None:
    """Velocities, accelerations or steps of joints that mimic others, from those of their leaders."""
    for m in range(chain.n):
        if chain.lead[m] != m:
            x[m] = chain.ratio[m] * x[chain.lead[m]]


@jit
def mimic_places(chain: Any, q: Any) -> None:
    """The same of places."""
    for m in range(chain.n):
        if chain.lead[m] != m:
            q[m] = chain.ratio[m] * q[chain.lead[m]] + chain.offset[m]
