"""An arm that goes to and fro although its target stands: its scheme gives way to coming to rest."""

from math import inf
from typing import Any

from ftqp.kernel.jit import jit, rare_jit

SETTLED = 1.0
"""How long the target has stood before a swing counts [s]: until then the arm arrives."""
WINDOW, LONG_WINDOW = 1.0, 4.0
"""Over how long a motion is looked at [s], second by second and, for slow swings, four seconds at once. The
long one because greatest manipulability swung slowly without end
(tests/robustness/test_swings_of_seconds.py)."""
TO_AND_FRO = 0.5
"""It is a swing where the joints come no farther than this share of the way that they go ..."""
LEAST_WAY = 0.005
"""... and that is more than what one joint goes in a window at this share of its velocity limit. What they
must tell apart is in tests/robustness/test_schemes_that_swing.py."""
TIMES = 2
"""An arm that swings once comes to rest beside its task; seen so often, it no longer asks for its error."""


@jit
def watch_swing(K: Any) -> None:
    """Whether the arm swings: its way and how far it has come, window by window, in what v_max goes in 1 s.

    ``calm.window`` is the time within the long window, of which every second is a short one.

    A swing is remembered until the target moves or another set of joints works. A motion that leads the arm
    somewhere, however long it takes, is none.
    Source: docs/theory/calm.md, "Schemes that do not rest".
    """
    calm = K.calm
    if calm.stood < SETTLED:
        calm.window = 0.0
        calm.hushed = 0
    elif not gives_up(calm):
        _look_back(K)


@jit
def gives_up(calm: Any) -> bool:
    """Whether the arm swings although its scheme has given way: not even its error is worth that."""
    swung: bool = calm.hushed >= TIMES
    return swung


@rare_jit
def _look_back(K: Any) -> None:
    faults, state, calm = K.faults, K.state, K.calm
    if calm.window == 0.0:
        calm.way = calm.long_way = 0.0
        _begin_at(state, K.chain, calm.q_long_window)
    if calm.way == 0.0:
        _begin_at(state, K.chain, calm.q_window)
    way = 0.0
    for k in range(faults.working):
        i = faults.order[k]
        way += state.dt * abs(state.v[i]) / _top(K.limits, i)
    calm.way += way
    calm.long_way += way
    begun = calm.window // WINDOW
    calm.window += state.dt
    swings = False
    if calm.window // WINDOW > begun:
        swings = _goes_to_and_fro(state, faults, K.limits, WINDOW, calm.way, calm.q_window)
        calm.way = 0.0
    if calm.window >= LONG_WINDOW:
        swings = swings or _goes_to_and_fro(
            state, faults, K.limits, LONG_WINDOW, calm.long_way, calm.q_long_window
        )
        calm.window = 0.0
    if swings:
        calm.hushed += 1
        calm.window = 0.0


@jit
def _begin_at(state: Any, chain: Any, q: Any) -> None:
    for i in range(chain.n):
        q[i] = state.q[i]


@jit
def _goes_to_and_fro(state: Any, faults: Any, limits: Any, window: float, way: float, q: Any) -> bool:
    """Whether the joints went ``way`` since they were at q, and came no farther than half of that."""
    come = 0.0
    for k in range(faults.working):
        i = faults.order[k]
        come += abs(state.q[i] + state.dt * state.v[i] - q[i]) / _top(limits, i)
    swings: bool = way > LEAST_WAY * window and come < TO_AND_FRO * way
    return swings


@jit
def _top(limits: Any, i: int) -> Any:
    return limits.v_max[i] if limits.v_max[i] < inf else 1.0
