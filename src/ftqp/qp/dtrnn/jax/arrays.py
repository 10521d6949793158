"""Array code for a batch, by JAX; this is the one file that imports it.

Every array has a leading axis of problems.
"""

from functools import partial
from typing import Any, Final

from ftqp.core.errors import MissingPackage
from ftqp.core.extras import remedy_for_extra

try:
    import jax
    import jax.numpy as jnp
    from jax import lax
except ImportError as error:
    raise MissingPackage("the engine 'jax'", "jax", remedy_for_extra("gpu")) from error

Array = jax.Array
jit = jax.jit
double: Final[Any] = partial(jax.enable_x64, True)
"""Context in which JAX computes in float64; the rest of a program that uses it goes on as it was."""

__all__ = [
    "Array",
    "device_kind",
    "dot",
    "double",
    "jit",
    "jnp",
    "largest",
    "lax",
    "norm",
    "times",
    "transposed_times",
]


def device_kind() -> str:
    """``cpu``, ``gpu`` or ``tpu``: where JAX computes."""
    return str(jax.default_backend())


def times(M: Array, v: Array) -> Array:
    """M v for every problem."""
    return jnp.einsum("bij,bj->bi", M, v)


def transposed_times(M: Array, v: Array) -> Array:
    """M'v for every problem."""
    return jnp.einsum("bji,bj->bi", M, v)


def dot(v: Array, w: Array) -> Array:
    """v'w for every problem, (B, 1)."""
    return (v * w).sum(axis=1, keepdims=True)


def norm(v: Array) -> Array:
    """|v| for every problem, (B, 1)."""
    return jnp.sqrt(dot(v, v))


def largest(v: Array) -> Array:
    """max(1, max |v_i|) for every problem, (B, 1)."""
    return jnp.abs(v).max(axis=1, keepdims=True, initial=1.0)
