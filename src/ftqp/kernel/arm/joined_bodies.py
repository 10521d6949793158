"""A body and something that is fixed to it, as one body."""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit


@jit
def join(
    chain: Any, body: int, base_mass: float, base_com: Any, base_inertia: Any, base_stoutness: float,
    m: float, x: float, y: float, z: float,
) -> None:  # fmt: skip
    """Body ``body`` with a mass m at (x, y, z) of its frame fixed to it, by the theorem of parallel axes.

    Args:
        chain: the arm, whose body is written.
        body: the joint that it moves with.
        base_mass: of the body alone [kg].
        base_com: its centre of mass, (3,) [m].
        base_inertia: its inertia about that, (6,) [kg m2].
        base_stoutness: its largest principal moment [kg m2].
        m: the mass [kg].
        x: where its centre is [m].
        y: where its centre is [m].
        z: where its centre is [m].

    Source: Featherstone 2008, section 2.13.
    """
    total = base_mass + m
    share = m / total if total > 0.0 else 0.0
    x, y, z = x - base_com[0], y - base_com[1], z - base_com[2]
    reduced = base_mass * share  # of the two bodies about their common centre
    chain.mass[body] = total
    chain.com[body, 0] = base_com[0] + share * x
    chain.com[body, 1] = base_com[1] + share * y
    chain.com[body, 2] = base_com[2] + share * z
    I, base = chain.inertia[body], base_inertia
    I[0], I[3], I[5] = (
        base[0] + reduced * (y * y + z * z),
        base[3] + reduced * (x * x + z * z),
        base[5] + reduced * (x * x + y * y),
    )
    I[1], I[2], I[4] = base[1] - reduced * x * y, base[2] - reduced * x * z, base[4] - reduced * y * z
    c = chain.com[body]
    chain.lever[body] = sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2])
    chain.stoutness[body] = base_stoutness + reduced * (x * x + y * y + z * z)
