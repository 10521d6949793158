"""The acceleration that a joint has beside its reference: third-order observers, a slow and a fast one."""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.detection_room import BANKS
from ftqp.kernel.maths.elementary import select
from ftqp.kernel.maths.side_by_side import WIDTH, is_set, put, several


@jit
def observe_accelerations(D: Any) -> None:
    """d, the acceleration of e = q - q_r, filtered by F(s) = w^3/(s + w)^3.

    s- = s + dt w + dt^2/2 d,  x = e - s-
    s = s- + (1 - p^3) x,  w += 3/2 (1 - p)^2 (1 + p)/dt x + dt d,  d += (1 - p)^3/dt^2 x,  p = exp(-w dt)

    A joint that is blind has d = 0.
    Source: docs/theory/detection.md, "Observers".
    """
    dt = D.dt
    for b in range(BANKS):
        k_s, k_w, k_d = D.k_s[b], D.k_w[b], D.k_d[b]
        for at in range(0, D.n, WIDTH):
            s, w, d = several(D.s[b], at), several(D.w[b], at), several(D.d[b], at)
            blind = is_set(D.blind, at)
            s = s + dt * (w + 0.5 * dt * d)
            x = several(D.e, at) - s
            put(D.s[b], at, select(blind, 0.0, s + k_s * x))
            put(D.w[b], at, select(blind, 0.0, w + dt * d + k_w * x))
            put(D.d[b], at, select(blind, 0.0, d + k_d * x))


@jit
def through(chain: Any, at: int, x: Any, p: float) -> Any:
    """x filtered by three poles p, whose states are the rows of ``chain``; this is F for any signal."""
    g = 1.0 - p
    y = several(chain[0], at)
    y = y + g * (x - y)
    put(chain[0], at, y)
    x = y
    y = several(chain[1], at)
    y = y + g * (x - y)
    put(chain[1], at, y)
    x = y
    y = several(chain[2], at)
    y = y + g * (x - y)
    put(chain[2], at, y)
    return y
