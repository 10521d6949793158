"""Products of three-vectors, in scalars so that the compiler keeps them in registers."""

from ftqp.kernel.jit import jit


@jit
def cross(a0: float, a1: float, a2: float, b0: float, b1: float, b2: float) -> tuple[float, float, float]:
    """a x b."""
    return a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
