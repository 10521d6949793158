"""The record of a detector: what it was given, its observers and filters, the last ticks, what it found."""

from typing import Final

from ftqp.kernel.layout import enums
from ftqp.kernel.layout.enums import Residual
from ftqp.kernel.layout.structures import sections

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

TEXT: Final = """
detector  One detector, see ``ftqp.kernel.detection``.
    n  i8
    fresh  i8  nothing was seen yet
    latency span now  i8  of the ring ``past_``
    ticks  i8  since the reset
    at  i8  place in the rings of the last samples
    has_effort  i8  the motors' torque is known, ``motor_torque``
    asked  i8  it is what was asked for, else what was measured
    from_command  i8  it comes with earlier commands, else with the samples
    has_motor  i8  both are known
    probed  i8  the planner moves joints to see whether they stand
    got_tau got_effort  i8  how many torques came with this tick
    has_inertia has_dynamics  i8
    suspect  i8  the joint that explains the residuals best
    said said_of agreed  i8  the last verdict, its joint, and how often in a row
    touched  i8  ticks in which a force at the tip explained them better than any joint
    bank  i8  the observers that were looked at
    fitted  i8  the joint whose torque is being fitted, ``fit_``
    fit_best  i8
    watch quiet  i8  ticks of suspicion, and of these without
    held  i8  ticks for which the means have stood still
    taken  i8  samples in them
    known  i8  these are enough
    waiting  i8  a finding that nobody has believed yet
    pause  i8  ticks without verdicts
    patience settle  i8
    bandwidth_fast dt sigma quantum  f8
    slip  f8  speed below which a joint may stick
    worst  f8
    slowness  f8  of the means, whose names begin with ``usual``
    load_fade fit_xx fit_share fit_onset fit_spread fit_size  f8
    pole k_s k_w k_d  f8[BANKS]  of the observers
    q tau q_ref v_ref a_ref effort good step raw travel  f8[N]
    hop  f8[N]  largest jump of a sample that was refused
    seen e psi psi_before tau_before loose loose_before  f8[N]
    coulomb viscous  f8[N]  friction
    tau_max motor_torque side  f8[N]
    usual usual_e usual_side  f8[N]  mean of a residual of torque, of e, and of the side that friction is on
    deviation  f8[N]  how odd a joint's motion was during this suspicion
    z  f8[N]  the largest excess/room of a joint
    jump  f8[N]  largest jump of a sample that motion explains
    onset share  f8[N]  of what was found
    told_coulomb  f8[N]  what was told of ``coulomb``, negative where nothing was
    holds  f8[N]  the push of a motor that friction may hold, 0 where that is not known
    doubt  f8[N]  inertia that the model of a joint may lack
    light  f8[N]  1/M_ii
    faint  f8[N]  share of its room below which a residual of torque is not divided by M_ii
    column odd score  f8[N]
    spread finest  f8[N]  mean square of a residual, and its least
    went  f8[N]  how far a joint has gone along with its reference since that turned round
    gone  f8[N]  how far that has gone away since
    same missing off turns sensor  i8[N]
    blind  i8[N]  the joint's sensor or motion tells nothing
    believed  i8[N]
    kinds since  i8[N]  of what was found
    standing  i8[N]
    s w d  f8[BANKS,N]
    rub  f8[3,N]
    f band motor  f8[BANKS,3,N]
    x  f8[RESIDUALS,N]
    excess  f8[RESIDUALS,N]  what a residual has beside friction
    room sharp  f8[RESIDUALS,N]  its largest healthy size, and the inverse of that
    peak  f8[RESIDUALS,N]  the largest excess since it was last set to zero
    past_q past_v past_a past_effort  f8[DELAYS,N]
    kept kept_v kept_x kept_e kept_side kept_effort  f8[WINDOW,N]
    g  f8[ONSETS,BANKS,3]
    fit_gg fit_gx  f8[ONSETS]
    pull jolt  f8[LOADS,N]  what a unit of each of ``load`` takes of the joints
    strain usual_pull  f8[LOADS,N]  ``drawn`` less its mean, and that
    drawn  f8[LOADS,3,N]  what a unit takes, filtered
    kept_pull  f8[WINDOW,LOADS,N]
    load load_sum  f8[LOADS]  mass and first moments of an unknown load, by sums
    load_square load_factor  f8[LOADS,LOADS]
    tally  f8[N,8]
    factor  f8[N,N]
    along  f8[3,N]  columns by which a force at the tip explains residuals
    gram  f8[3,3]  of these
    pushed  f8[3]
"""
DETECTOR: Final = sections(TEXT, vars(enums) | globals())
"""What gives its fields."""
