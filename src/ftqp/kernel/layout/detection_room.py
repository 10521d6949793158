"""The record of a detector: what it was given, its observers and filters, the last ticks, what it found."""

from functools import cache
from typing import Any

import numpy as np

from ftqp.kernel.layout.enums import DELAYS, Residual
from ftqp.kernel.layout.field_kinds import Fields, floats, integers, scalars

BANKS = 2
"""Observers of each joint: a slow and a fast one."""
SLOW, FAST = 0, 1
WINDOW = 64
"""Samples that are kept of every joint, a power of two."""
ONSETS = 8
"""Times at which a fault of the torque may have begun that are compared."""
LOADS = 4
"""Of a load at the tip: its mass and its first moments along the tip's axes."""
LOAD_EVERY = 8
"""Ticks from one estimate of the load to the next."""
RESIDUALS = len(Residual)


def detection_fields(N: int) -> Fields:
    """One detector, see ``ftqp.kernel.detection``.

    ``fresh``: nothing was seen yet; ``got_``: how many torques came with this tick; ``latency``, ``span``,
    ``now``: of the ring ``past_``; ``ticks`` since the reset; ``at``: place in the rings of the last samples.
    ``has_effort``: the motors' torque is known, ``motor_torque``; ``asked``: it is what was asked for, else
    what was measured; ``from_command``: it comes with earlier commands, else with the samples; ``has_motor``:
    both are known. ``watch``: ticks of suspicion, ``quiet`` of them without; ``suspect``: the joint that
    explains the residuals best; ``said``, ``said_of``, ``agreed``: the last verdict, its joint, and how often
    in a row; ``fitted``: the joint whose torque is being fitted, ``fit_``; ``waiting``: a finding that nobody
    has believed yet; ``pause``: ticks without verdicts. ``pole``, ``k_``: of the observers; ``slip``: speed
    below which a joint may stick; ``slowness``: of the means, ``usual`` of a residual of torque, ``usual_e``
    of e, ``usual_side`` of the side that friction is on, ``usual_pull``; ``taken``: samples in them, enough
    if ``known``; ``held``: ticks for which they have stood still. ``load``: mass and first moments of an
    unknown load, by sums ``load_``; ``pull``, ``jolt``: what a unit of each takes of the joints, ``drawn``
    filtered, ``strain`` less its mean; ``spread``: mean square of a residual, ``finest`` its least.
    ``coulomb``: dry friction, ``told_coulomb`` what was told of it, negative where nothing was; ``holds``:
    the push of a motor that friction may hold, 0 where that is not known; ``doubt``: inertia that its
    model may lack.
    ``touched``: ticks in which a force at the tip explained them better than any joint, by the columns
    ``along`` and their
    ``gram``, ``pushed``; ``bank``: the observers that were looked at.
    ``probed``: the planner moves joints to see whether they stand; ``deviation``: how odd a joint's motion
    was during this suspicion; ``went``: how far it has gone along with its reference since that turned
    round; ``gone``: how far that has gone away since. ``room``: largest healthy size of each residual,
    ``sharp`` its inverse; ``excess``: what it has beside friction, and z of a joint is the largest
    excess/room; ``peak``: the largest since it was last set to zero. ``blind``: joints whose sensor or
    motion tells nothing; ``jump``: largest jump of a sample that motion explains, ``hop`` that of one that
    was refused; ``light``: 1/M_ii; ``faint``: share of its room below which a residual of torque is not
    divided by M_ii. ``kinds``, ``since``, ``onset``, ``share``: what was found.
    """
    names = ("q", "tau", "q_ref", "v_ref", "a_ref", "effort", "good", "step", "raw", "travel", "hop", "seen",
             "e", "psi", "psi_before", "tau_before", "loose", "loose_before", "coulomb", "viscous", "tau_max",
             "motor_torque", "side", "usual", "usual_e", "usual_side", "deviation", "z", "jump", "onset",
             "share", "told_coulomb", "holds", "doubt", "light", "faint", "column", "odd", "score", "spread",
             "finest", "went", "gone")  # fmt: skip
    counts = ("same", "missing", "off", "turns", "sensor", "blind", "believed", "kinds", "since", "standing")
    return [
        *scalars("i8", "n fresh latency span now ticks at has_effort asked from_command has_motor probed"),
        *scalars("i8", "got_tau got_effort has_inertia has_dynamics suspect said said_of agreed"),
        *scalars(
            "i8", "touched bank fitted fit_best watch quiet held taken known waiting pause patience settle"
        ),
        *scalars("f8", "bandwidth_fast dt sigma quantum slip worst slowness load_fade"),
        *scalars("f8", "fit_xx fit_share fit_onset fit_spread fit_size"),
        *floats({"pole": (BANKS,), "k_s": (BANKS,), "k_w": (BANKS,), "k_d": (BANKS,)}),
        *floats(dict.fromkeys(names, (N,))),
        *integers(dict.fromkeys(counts, (N,))),
        *floats(dict.fromkeys(("s", "w", "d"), (BANKS, N))),
        *floats({"rub": (3, N)}),
        *floats(dict.fromkeys(("f", "band", "motor"), (BANKS, 3, N))),
        *floats(dict.fromkeys(("x", "excess", "room", "sharp", "peak"), (RESIDUALS, N))),
        *floats(dict.fromkeys(("past_q", "past_v", "past_a", "past_effort"), (DELAYS, N))),
        *floats(
            dict.fromkeys(("kept", "kept_v", "kept_x", "kept_e", "kept_side", "kept_effort"), (WINDOW, N))
        ),
        *floats({"g": (ONSETS, BANKS, 3), "fit_gg": (ONSETS,), "fit_gx": (ONSETS,)}),
        *floats(dict.fromkeys(("pull", "jolt", "strain", "usual_pull"), (LOADS, N))),
        *floats({"drawn": (LOADS, 3, N), "kept_pull": (WINDOW, LOADS, N)}),
        *floats(dict.fromkeys(("load", "load_sum"), (LOADS,))),
        *floats(dict.fromkeys(("load_square", "load_factor"), (LOADS, LOADS))),
        *floats({"tally": (N, 8), "factor": (N, N), "along": (3, N), "gram": (3, 3), "pushed": (3,)}),
    ]


@cache
def detection_dtype(capacity: int) -> np.dtype[Any]:
    """The type of the record of a detector for arms of up to ``capacity`` joints."""
    return np.dtype(detection_fields(capacity), align=True)
