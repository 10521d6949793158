"""Numbers of eight neighbouring joints at once: what all joints have in common costs as much as for one.

A loop over the joints goes in blocks, ``for at in range(0, K.chain.n, WIDTH)``; arrays of the joints have
room for whole blocks, and hold zeros behind the last joint. Sums, comparisons and the functions of
``ftqp.kernel.maths.elementary`` take such numbers as they take one. In plain Python they are numpy arrays.
"""

from collections.abc import Callable
from math import cos, sin
from typing import Any

import numpy as np

from ftqp.kernel.jit import COMPILED, exact_jit, jit
from ftqp.kernel.maths.elementary import any_of, floor, select

WIDTH = 8
"""Joints in a block."""


def _lanes(plain: Callable[..., Any]) -> Any:
    """What compiled code has under the name of a function; the function itself in plain Python."""
    if not COMPILED:
        return plain
    from ftqp.kernel.compiled.making import joint_lanes

    return getattr(joint_lanes, plain.__name__)


@_lanes
def load_lanes(array: Any, at: int) -> Any:
    """Eight numbers of a one-dimensional array of float64, from ``at`` on."""
    return array[at : at + WIDTH].copy()


@_lanes
def store_lanes(array: Any, at: int, lanes: Any) -> None:
    """Write eight numbers into a one-dimensional array of float64, from ``at`` on."""
    array[at : at + WIDTH] = lanes


@_lanes
def is_set(array: Any, at: int) -> Any:
    """Which of eight whole numbers of a one-dimensional array are not 0."""
    return array[at : at + WIDTH] != 0


@_lanes
def put_either(array: Any, at: int, condition: Any, one: int, other: int) -> None:
    """Write eight whole numbers: ``one`` where a condition holds, elsewhere ``other``."""
    array[at : at + WIDTH] = np.where(condition, one, other)


@_lanes
def lane_mask(count: int, at: int) -> Any:
    """Which of the indices at .. at + 7 are below a count."""
    return np.arange(at, at + WIDTH) < count


@_lanes
def numbers(at: int) -> Any:
    """The indices at .. at + 7."""
    return np.arange(float(at), at + WIDTH)


@_lanes
def sum_of(lanes: Any) -> float:
    """The sum of all lanes."""
    return float(np.sum(lanes))


@_lanes
def largest_of(lanes: Any) -> float:
    """The largest of all lanes."""
    return float(np.max(lanes))


@jit
def all_of(condition: Any) -> bool:
    """Whether a condition holds in every lane."""
    return not any_of(~condition)


PI_2_HIGH = 1.5707963267341256
"""pi/2 in three parts (Cody and Waite 1980); the first has 33 bits, so that k PI_2_HIGH is exact ..."""
PI_2_MIDDLE = 6.077100506303966e-11
PI_2_LOW = 2.0222662487959506e-21
REDUCED = 1e5
"""... for angles up to this one [rad], as k has 20 bits at most there and a double holds 53; beyond it the
library functions take over."""


@exact_jit
def sin_cos(x: Any) -> tuple[Any, Any]:
    """sin x and cos x for |x| <= REDUCED: x = k pi/2 + r, |r| <= pi/4, minimax polynomials in r.

    Source: FreeBSD's k_sin.c and k_cos.c (Sun Microsystems, 1993) for the coefficients.
    """
    k = floor(x * 0.6366197723675814 + 0.5)
    r = ((x - k * PI_2_HIGH) - k * PI_2_MIDDLE) - k * PI_2_LOW
    z = r * r
    s = -2.50507602534068634195e-08 + z * 1.58969099521155010221e-10
    s = 2.75573137070700676789e-06 + z * s
    s = -1.98412698298579493134e-04 + z * s
    s = 8.33333333332248946124e-03 + z * s
    s = -1.66666666666666324348e-01 + z * s
    s = r + r * z * s
    c = 2.08757232129817482790e-09 + z * -1.13596475577881948265e-11
    c = -2.75573143513906633035e-07 + z * c
    c = 2.48015872894767294178e-05 + z * c
    c = -1.38888888888741095749e-03 + z * c
    c = 4.16666666666666019037e-02 + z * c
    c = (1.0 - 0.5 * z) + z * z * c
    quarter = k - 4.0 * floor(0.25 * k)
    odd = k - 2.0 * floor(0.5 * k) > 0.5
    sine, cosine = select(odd, c, s), select(odd, s, c)
    return (
        select(quarter > 1.5, -sine, sine),
        select((quarter - 1.0) * (quarter - 2.0) < 0.5, -cosine, cosine),
    )


@jit
def joint_sines(state: Any, kinematics: Any, chain: Any) -> None:
    """sin q_i and cos q_i of every joint; 0 and 1 for a prismatic one, which does not turn."""
    for at in range(0, chain.n, WIDTH):
        q, slides = load_lanes(state.q, at), is_set(chain.prismatic, at)
        if all_of(abs(q) <= REDUCED):
            sine, cosine = sin_cos(q)
            store_lanes(kinematics.sine, at, select(slides, 0.0, sine))
            store_lanes(kinematics.cosine, at, select(slides, 1.0, cosine))
        else:
            for i in range(at, min(at + WIDTH, chain.n)):
                turns = not chain.prismatic[i]
                kinematics.sine[i] = sin(state.q[i]) if turns else 0.0
                kinematics.cosine[i] = cos(state.q[i]) if turns else 1.0
