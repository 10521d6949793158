"""The room of the record that brings the arm to rest."""

from typing import Any

from ftqp.kernel.layout.enums import TASK_ROWS


def calm_fields(N: int) -> list[Any]:
    """What brings the arm to rest, see ``ftqp.kernel.calm``.

    ``on``: whether the planner wants it; ``entered``: whether the last tick was posed in calm; ``stood``:
    how long the target has stood [s]; ``sure``: how long it has been clear that little can be gained [s];
    ``holding``: the arm no longer tries, at the error ``held``. ``hushed``: how often it has been seen to
    swing; ``way`` and ``long_way``: of its joints within the present ``window`` [s], which began at
    ``q_window`` and ``q_long_window``. ``rho``: share of the error e'e that can be removed; ``beta``: share
    of the error that feedback asks for; ``soft``: weight of the scheme's objective; ``psi``: how much of
    the metric there is; ``count``: how many joints are free. ``anchor``: pose where the target stands.
    ``known``: the joints that worked at the last tick, so many as ``known_working``.

    ``reach`` and ``lipschitz`` bound the curvature and the change of the rows; ``sigma_seen`` is the smallest
    singular value when it was last looked at, at ``q_seen`` with ``seen_working`` joints.

    ``A``, ``e``, ``b``, ``rate``: rows, error, right sides and column of a path's rate as the priority weighs
    them; ``S``: curvature; ``D``: the metric; ``gradient``: A'e; ``kick``: what is added to it at a saddle;
    ``delta``: way to go of the free joints. ``free``: working joints, those first that can follow the
    gradient. The rest is memory.
    """
    six, square = (TASK_ROWS, TASK_ROWS), (N, N)
    whole = ("on", "entered", "holding", "hushed", "count", "seen_working", "known_working")
    numbers = (
        "stood", "sure", "held", "way", "long_way", "window", "rho", "beta", "psi", "soft", "reach",
        "lipschitz", "sigma_seen",
    )  # fmt: skip
    return [
        *((name, "i8") for name in whole),
        *((name, "f8") for name in numbers),
        *((name, "i8", (N,)) for name in ("free", "known")),
        *((name, "f8", (N,)) for name in ("q_seen", "q_window", "q_long_window")),
        *((name, "f8", (N,)) for name in ("gradient", "kick", "delta", "direction")),
        ("anchor", "f8", (12,)),
        *((name, "f8", (TASK_ROWS,)) for name in ("weighted", "e", "b", "rate", "squares")),
        ("A", "f8", (TASK_ROWS, N)),
        *((name, "f8", square) for name in ("S", "D", "work", "modes", "gains")),
        *((name, "f8", six) for name in ("U", "G")),
        *((name, "f8", (max(N, TASK_ROWS),)) for name in ("values", "beside")),
    ]
