"""Planar arms, eight configurations at once: levers, weighted Jacobian, and the motion after a lock.

u(psi) is the unit vector at the angle psi, psi_k = q_1 + ... + q_k, and p_i = sum over k >= i of l_k u(psi_k)
the lever of joint i, from its origin to the tip. J has the columns j_i = (-p_iy, p_ix), and m_i are the
columns of J M with M = W^-1. Source: docs/theory/after-a-failure.md.
"""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.elementary import larger, sqrt
from ftqp.kernel.maths.side_by_side import WIDTH, put, several
from ftqp.kernel.maths.trigonometry import sin_cos

SHARE = 0.5
"""c of the variable s with dq/ds = F / (c det A + |F|)."""
TINY = 1e-300
"""Keeps a quotient of two zeros a number."""


@jit
def levers(P: Any, q: Any) -> None:
    """p_i of every joint into ``px`` and ``py``."""
    n = len(P.link)
    psi = several(q, 0)
    for i in range(n):
        if i > 0:
            psi = psi + several(q, i * WIDTH)
        sine, cosine = sin_cos(psi)
        put(P.px, i * WIDTH, cosine * P.link[i])
        put(P.py, i * WIDTH, sine * P.link[i])
    x, y = several(P.px, (n - 1) * WIDTH), several(P.py, (n - 1) * WIDTH)
    for k in range(n - 1):
        at = (n - 2 - k) * WIDTH
        x, y = x + several(P.px, at), y + several(P.py, at)
        put(P.px, at, x)
        put(P.py, at, y)


@jit
def weighted(P: Any) -> Any:
    """m_i = sum over k of M_ik j_k into ``mx`` and ``my``; A = J M J' as A_11, A_12, A_22."""
    n = len(P.link)
    none = several(P.zero, 0)
    a, b, d = none, none, none
    for i in range(n):
        x, y = none, none
        for k in range(n):
            x = x - several(P.py, k * WIDTH) * P.M[i, k]
            y = y + several(P.px, k * WIDTH) * P.M[i, k]
        put(P.mx, i * WIDTH, x)
        put(P.my, i * WIDTH, y)
        a = a - several(P.py, i * WIDTH) * x
        b = b - several(P.py, i * WIDTH) * y
        d = d + several(P.px, i * WIDTH) * y
    return a, b, d


@jit
def field(P: Any, q: Any, free: Any, out: Any) -> Any:
    """dq/ds = F / (c det A + |F|) with F = I_S M J' adj(A) e into ``out``; |e|^2, det A and |F|.

    F is det A times the joint rates of the law without gain, smooth where J is singular; the speed |dq/ds| is
    at most 1.
    """
    n = len(P.link)
    levers(P, q)
    a, b, d = weighted(P)
    ex, ey = P.goal[0] - several(P.px, 0), P.goal[1] - several(P.py, 0)
    det = a * d - b * b
    along, across = d * ex - b * ey, a * ey - b * ex
    size = several(P.zero, 0)
    for at in range(0, n * WIDTH, WIDTH):
        F = several(free, at) * (several(P.mx, at) * along + several(P.my, at) * across)
        size = size + F * F
        put(out, at, F)
    size = sqrt(size)
    scale = 1.0 / (det * SHARE + size + TINY)
    for at in range(0, n * WIDTH, WIDTH):
        put(out, at, several(out, at) * scale)
    return ex * ex + ey * ey, det, size


@jit
def clock(P: Any, error: Any, det: Any, size: Any) -> Any:
    """dt/ds = det A / (kappa (c det A + |F|)) with kappa = min(K_e, v_max / |e|), of |e|^2."""
    slowness = larger(sqrt(error) * P.per_speed, P.slowness)
    return slowness * det / (det * SHARE + size + TINY)
