"""Whether a number is finite, in a form that fast math leaves alone."""

from math import inf

from ftqp.kernel.jit import jit


@jit
def is_finite(x: float) -> bool:
    """|x| < inf: false for NaN and infinities.

    numba's ``math.isfinite`` compares x - x with itself; with reassociation allowed, the compiler folds that
    into 0 when x is a sum, and NaN passes.
    """
    return abs(x) < inf
