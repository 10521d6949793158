"""Work memory of a planner one of whose joints swings freely: the plan, the gain, and the rollout on its way.

A planner gets it when it first believes in such a joint. What of it is worth telling is in the room ``free``
of the planner's record.
"""

from functools import cache
from typing import Any

import numpy as np

SEGMENTS = 3
"""Segments of the look-ahead's plan."""
STARTS = 5
"""Postures from which a rest posture is looked for."""


@cache
def free_dtype(capacity: int) -> np.dtype[Any]:
    """The type of the work memory for arms of up to ``capacity`` joints.

    ``plan`` holds a factor of a_max for each segment and joint, or BRAKE. ``base_q``, ``base_v`` are the
    state that trials begin from, ``phase`` the time into the first segment, ``left`` how long the search goes
    on. ``borne`` is the speed of an impact up to which a task is followed, ``given_up`` how long ago one was
    given up. ``places`` are those of the joints and the tip when it was told; if the others had held still
    links would have gone ``held_reach`` from there, and the joint met a stop with ``held_energy``;
    ``clear_for`` counts looks ahead without an impact. ``goal`` is where the tip is to be held, ``rests`` are
    the postures found for it, ``rest`` the one that is tried or held; ``refused`` says for each set of rows
    what spoke against it (``Refusal``).
    ``gain`` is the feedback, (n, 2n), over the joints ``moving``; the matrices of the Riccati equation are
    (2n, 2n). A rollout under the gain is at step ``roll_step`` from ``roll_q``, ``roll_v``.
    """
    N, D = capacity, 2 * capacity
    floats = {
        "plan": (SEGMENTS, N),
        "base_q": (N,),
        "base_v": (N,),
        "q": (N,),
        "v": (N,),
        "a": (N,),
        "x": (N,),
        "goal": (3,),
        "goal_rotation": (9,),
        "places": (N + 1, 3),
        "start": (N,),
        "start_v": (N,),
        "trial": (N,),
        "rest": (N,),
        "slope": (N,),
        "step": (N,),
        "c": (7,),
        "C": (7, N),
        "square": (7, 7),
        "A": (D, D),
        "G": (D, D),
        "H": (D, D),
        "W": (D, D),
        "S": (D, D),
        "V": (D, D),
        "column": (D,),
        "gain": (N, D),
        "lever": (N,),
        "rests": (STARTS, N),
        "rest_costs": (STARTS,),
        "roll_q": (N,),
        "roll_v": (N,),
    }
    scalars = (
        "dt",
        "phase",
        "base_phase",
        "left",
        "since",
        "best",
        "impact_time",
        "impact_speed",
        "impact_energy",
        "reach",
        "lowest",
        "highest",
        "way",
        "recheck",
        "borne",
        "given_up",
        "held_reach",
        "held_energy",
    )
    whole = (
        "joint",
        "rows",
        "stage",
        "countdown",
        "period",
        "candidate",
        "side",
        "starts",
        "iteration",
        "roll_step",
        "rolling",
        "found",
        "unknowns",
        "quiet",
        "calming",
        "clear_for",
    )
    fields: list[Any] = [(name, "f8", shape) for name, shape in floats.items()]
    fields += [(name, "f8") for name in scalars]
    fields += [("moving", "i8", (N,)), ("pivots", "i8", (D,)), ("refused", "i8", (4,))]
    fields += [(name, "i8") for name in whole]
    return np.dtype(fields, align=True)
