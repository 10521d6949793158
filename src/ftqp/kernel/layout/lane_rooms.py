"""What differs from arm to arm where several are driven side by side; the last axis of a field is the arm."""

from functools import cache
from typing import Any

import numpy as np

from ftqp.kernel.layout.enums import TASK_ROWS

LANES = (4, 8)
"""How many arms a vector register may hold: of AVX2 or NEON (two registers), and of AVX-512."""


def _rooms(N: int) -> dict[str, dict[str, tuple[int, ...]]]:
    """Shapes of the fields by room; those that a planner's record has, too, mean the same.

    ``faults.works``: 1 for a joint that works, 0 for one that is locked or being locked. Room ``lane`` is
    memory of the common tick: ``inverse`` of H's diagonal, 0 for a fixed joint; ``W``: the rows times it;
    ``fixed``: x of a fixed joint, ``after``: its velocity after the tick, ``braking``: one still moves;
    ``G``, ``L``: a Gram matrix, and Cholesky factors with inverse diagonal; ``lam``: multipliers; ``left``:
    what a step leaves of the rows; ``a``: accelerations of this tick, ``a_last`` of the last one;
    ``worst``: largest position and rotation error; ``done``: ticks, ``relaxed``: those that left some of the
    task, as ``missed`` says of this one, ``first_bad``: the first of them, -1 while there is none.
    """
    return {
        "state": {"q": (N,), "v": (N,)},
        "faults": {"works": (N,), "lock_velocity": (N,), "lock_rate": (N,)},
        "limits": {
            **dict.fromkeys(("q_min", "q_max", "v_max", "a_max", "a_brake", "tau_max"), (N,)),
            "guard": (1,),
        },
        "watch": {"last_position_error": (1,), "last_rotation_error": (1,)},
        "calm": {"stood": (1,), "sigma_seen": (1,), "q_seen": (N,), "weighted": (TASK_ROWS,)},
        "task": {"error": (TASK_ROWS,), "position_error": (), "rotation_error": ()},
        "kinematics": {
            "sine": (N,),
            "cosine": (N,),
            "R_tip": (9,),
            "o_tip": (3,),
            "drift": (6,),
            "R": (N, 9),
            "o": (N, 3),
            "axis_w": (N, 3),
            "J": (6, N),
            "w": (N, 3),
            "alpha": (N, 3),
            "acc": (N, 3),
            "tau": (N,),
            "effort": (N, 2),
            "wrench": (N, 6),
        },
        "qp": {"A": (TASK_ROWS, N), "b": (TASK_ROWS,), "soft": (TASK_ROWS,), "g": (N,), "x": (N,)},
        "lane": {
            "inverse": (N,),
            "a": (N,),
            "a_last": (N,),
            "W": (TASK_ROWS, N),
            "fixed": (N,),
            "after": (N,),
            "braking": (1,),
            "lam": (TASK_ROWS,),
            "left": (TASK_ROWS,),
            "L": (TASK_ROWS, TASK_ROWS),
            "G": (TASK_ROWS, TASK_ROWS),
            "worst": (2,),
            "done": (1,),
            "relaxed": (1,),
            "first_bad": (1,),
            "missed": (1,),
        },
    }


@cache
def lanes_dtype(capacity: int, width: int) -> np.dtype[Any]:
    """The type of the memory of ``width`` arms of up to ``capacity`` joints."""
    return np.dtype(
        [
            (room, np.dtype([(name, "f8", (*shape, width)) for name, shape in fields.items()]))
            for room, fields in _rooms(capacity).items()
        ]
    )


def lanes_memory(capacity: int, width: int) -> tuple[Any, int]:
    """Zeroed memory of one group of arms, and the address in it where a vector register may begin."""
    size, register = lanes_dtype(capacity, width).itemsize, 8 * width
    memory = np.zeros(size + register, dtype=np.uint8)
    begin = int(memory.ctypes.data)
    return memory, begin + (-begin) % register
