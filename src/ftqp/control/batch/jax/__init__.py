"""Rollouts of many arms as array code in JAX: on a GPU, or on the CPU without one.

The formulas are those of the kernel's common tick, file by file, with a leading axis of arms; all other ticks
are the kernel's own. Everything runs on JAX's default device in float64, switched on for these calls only, so
that a program that uses JAX in float32 goes on doing so.
"""

from ftqp.control.batch.jax.array_batch import drive_arrays

__all__ = ["drive_arrays"]
