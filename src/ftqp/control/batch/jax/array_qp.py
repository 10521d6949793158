"""The QP of many arms where no bound is active, as ``ftqp.kernel.lanes.common_tick`` solves it."""

from typing import Final, NamedTuple

from ftqp.control.batch.jax.array_facts import Arm
from ftqp.control.batch.jax.array_rows import Rows
from ftqp.qp.dtrnn.jax.arrays import Array, jnp, lax, times, transposed_times

DEPENDENT: Final = 1e-12
"""A pivot below this share of its row's own entry belongs to a row that depends on others."""
REFINE_FROM: Final = 1e-12
"""What is left of the rows is refined from here on ..."""
REFINEMENTS: Final = 3
"""... so many times."""
RELAXED_FROM: Final = 1e-3
"""A task residual above this share of the task's right side, plus TASK_FLOOR, counts as relaxed."""
TASK_FLOOR: Final = 1e-4


class Answer(NamedTuple):
    """The command of each arm.

    Attributes:
        x: (B, n).
        missed: Whether it leaves some of the task, (B,).
        good: Whether it solves the QP without bounds, (B,).
    """

    x: Array
    missed: Array
    good: Array


def resolve(arm: Arm, rows: Rows, works: Array, fixed: Array) -> Answer:
    """x = x_0 + H^-1 A' lam,  (A H^-1 A' + soft) lam = b - A x_0,  H^-1 = 0 for a joint that is fixed.

    Args:
        arm: The arm.
        rows: Of its task.
        works: 1 for a joint that works, else 0, (B, n).
        fixed: x of the joints that do not, 0 for the others, (B, n).
    """
    inverse = works / rows.H
    x = fixed - rows.g * inverse
    W = rows.A * inverse[:, None, :]
    S = (W[:, :, None, :] * rows.A[:, None, :, :]).sum(axis=-1)
    S = S + rows.soft[:, None, :] * jnp.eye(S.shape[1])
    F = lax.linalg.cholesky(S, symmetrize_input=False)
    pivots, whole = (jnp.diagonal(part, axis1=1, axis2=2) for part in (F, S))
    good = (pivots * pivots > DEPENDENT * whole).all(axis=1)

    def solved(right: Array) -> Array:
        half = lax.linalg.triangular_solve(F, right[..., None], left_side=True, lower=True)
        return lax.linalg.triangular_solve(F, half, left_side=True, lower=True, transpose_a=True)[..., 0]

    def left(x: Array, lam: Array) -> tuple[Array, Array]:
        s = rows.b - times(rows.A, x)
        return s, s - rows.soft * lam

    def refine(_: int, at: tuple[Array, Array]) -> tuple[Array, Array]:
        x, lam = at
        rest = left(x, lam)[1]
        needed = jnp.abs(rest).max(axis=1, keepdims=True) > REFINE_FROM
        more = jnp.where(needed, solved(rest), 0.0)
        return x + transposed_times(W, more), lam + more

    lam = solved(rows.b - times(rows.A, x))
    x, lam = lax.fori_loop(0, REFINEMENTS, refine, (x + transposed_times(W, lam), lam))
    task, rest = (jnp.abs(part).max(axis=1) for part in left(x, lam))
    size = jnp.abs(rows.b).max(axis=1)
    good = good & (rest <= arm.accept * (1.0 + size))
    return Answer(x, task > RELAXED_FROM * size + TASK_FLOOR, good)
