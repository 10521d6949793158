"""The DTRNN for a batch of QPs at once, as array code in JAX: on a GPU, or on the CPU without one.

The formulas are those of the scalar network in ``ftqp.kernel``, file by file, with a leading axis of
problems. Everything runs on JAX's default device in float64, switched on for these calls only, so that a
program that uses JAX in float32 goes on doing so.
"""

from ftqp.qp.dtrnn.jax.batch_rounds import solve_batch

__all__ = ["solve_batch"]
