"""Whether a run goes to the goal: a Newton search with the joints that move, and stability where it ends."""

from typing import Any, Final

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.elementary import select
from ftqp.kernel.maths.side_by_side import WIDTH, put, several
from ftqp.kernel.study.planar_arm import TINY, levers, weighted

NEAR: Final = 5e-2
"""From this |e| on the goal is looked for [mean link lengths]."""
REACH: Final = 5e-2
"""A rest that is further away from a run than this is not taken for its end [rad]."""
SEARCHES: Final = 4
"""Newton steps: from ``NEAR`` on the error falls below 1e-12 where the Jacobian is regular."""
FOUND: Final = 1e-9
"""The |e| at which a configuration counts as one at the goal."""
FLAT: Final = 1e-6
"""det A below this is singular, of an arm with links of mean length 1."""


@jit
def goal_ahead(P: Any, q: Any, free: Any) -> None:
    """Search the goal from q with the joints that move; the end is in ``trial``, the verdict in ``found``.

    found: 1 where a configuration at the goal lies within REACH and is stable, 2 where it is stable but
    singular, else 0. Of the reduced linearisation at e = 0 all eigenvalues but those of

        -J I_S M J' A^-1

    belong to motion at rest; it is stable where this 2 x 2 matrix has det > 0 and trace < 0.
    """
    size, none = len(P.q), several(P.zero, 0)
    for at in range(0, size, WIDTH):
        put(P.trial, at, several(q, at))
    for _ in range(SEARCHES):
        levers(P, P.trial)
        a, b, d = none, none, none
        for at in range(0, size, WIDTH):
            x, y, moves = several(P.px, at), several(P.py, at), several(free, at)
            a, b, d = a + moves * y * y, b - moves * x * y, d + moves * x * x
        ex, ey = P.goal[0] - several(P.px, 0), P.goal[1] - several(P.py, 0)
        inverse = 1.0 / (a * d - b * b + TINY)
        along, across = (d * ex - b * ey) * inverse, (a * ey - b * ex) * inverse
        for at in range(0, size, WIDTH):
            move = several(free, at) * (several(P.px, at) * across - several(P.py, at) * along)
            put(P.trial, at, several(P.trial, at) + move)
    levers(P, P.trial)
    a, b, d = weighted(P)
    ex, ey = P.goal[0] - several(P.px, 0), P.goal[1] - several(P.py, 0)
    way, n11, n12, n21, n22 = none, none, none, none, none
    for at in range(0, size, WIDTH):
        move = several(P.trial, at) - several(q, at)
        way = way + move * move
        x, y, moves = several(P.px, at), several(P.py, at), several(free, at)
        mx, my = moves * several(P.mx, at), moves * several(P.my, at)
        n11, n12, n21, n22 = n11 - y * mx, n12 - y * my, n21 + x * mx, n22 + x * my
    det = a * d - b * b
    stable = (n11 * n22 - n12 * n21 > 0.0) & (n11 * d - n12 * b - n21 * b + n22 * a > 0.0)
    there = (ex * ex + ey * ey < FOUND * FOUND) & (way < REACH * REACH) & stable
    put(P.found, 0, select(there, select(det > FLAT, 1.0, 2.0), 0.0))
