"""The rooms of the loop between the reference and the arm: its state, the last ticks, what is learned."""

from typing import Final

from ftqp.kernel.layout import enums, hypotheses
from ftqp.kernel.layout.structures import sections

POLES = 4
"""Of the filters: one more than a second difference needs to be smooth."""
UNKNOWNS = 6
"""What the torque of one joint says something of: its rotor, its dry friction, mass and first moment of a
load."""
KEPT = 6
"""So many earlier estimates are kept, so that one can be gone back to that a fault has not touched."""
LATER = 5
"""Samples may come so many ticks later than was stated: the latency of common arms."""
SOFTER = 2
"""The loop of a torque arm that rings becomes softer so many times."""
SERVO = 6
"""Learned of the servo of a joint: lag, rotor, friction, droop, and that by weight and by inertia."""
PACES = ("stiffness", "pole", "kappa", "missing_noise", "gain")
"""What changes with the delay and where a loop rings, the last in the room ``learned``, the others in
``feedback``."""

TEXT: Final = """
feedback  The loop between the reference and the arm, see ``ftqp.kernel.feedback``.
    active  i8  this tick is posed at the reference
    fresh  i8  the loop begins anew, and how
    kind  i8  what the arm takes
    latency  i8  ticks by which samples are late
    span now  i8  length and place of the ring ``past``
    refused  i8  bad samples now
    holding  i8  so many samples are looked through
    exact displaced has_tip  i8
    quiet  i8  the displacement rests
    lagging far stored until_stored  i8
    stride  i8  ticks between kept targets
    isolated_joint  i8  the joint that is farthest from its command, -1 none
    any_counted  i8  some joint is out of hand
    brakes  i8  which the arm has
    moving  i8  the joint that goes on, from 1, 0 none
    samples  i8  ticks of observation
    softened  i8  ``soft_one`` and ``soft_other`` are on one axis, and one of them seems not to obey
    touched  i8  ticks for which something has pushed the tip
    soft_one soft_other  i8
    kappa hold  f8  bandwidth of the tip's and of a velocity arm's loop [1/s]
    stiffness  f8  bandwidth of a torque arm's loop [1/s]
    pole pole_failed  f8  of the observer
    sigma  f8  noise of the samples
    patience  f8
    failed_noise missing_noise  f8  what observers make of the noise of samples, whose unit is 1
    tolerance rotation_tolerance gap tip_gap rate rate_change late up speed  f8
    spent_elsewhere  f8
    time_error  f8  by how much samples were late or early at most, those of all joints alike [s]
    speed_margin  f8  share of the speed limits that is left to servos
    silent unheard  f8  for how long no sensor has said anything new, with this tick and before it [s]
    wide  f8  for how long samples may still be far off, after an impact or a late loop
    thrown  f8  the same after an impact alone
    strongest  f8  push at the tip as a share of the torque limits
    c c_rate  f8[6]  displacement of the target
    push  f8[6]  what the displacement feeds forward
    off left  f8[6]  measured tip less that of the reference, and their sum
    angle  f8[N]  samples that were numbers, to the turn of those before
    seen  f8[N]  samples as believed
    good  f8[N]  last good ones, ``age`` ticks old, ``offset`` from the reference
    raw  f8[N]  what was measured last, ``same`` times in a row more, while the reference went ``moved``
    offset  f8[N]
    foretold  f8[N]  where the last good one was expected by those that went with each other
    spent  f8[N]  patience that bad samples have cost
    q_hat v_hat d_hat tau_slow q_now v_now q_sent v_sent tau_sent h  f8[N]
    wound  f8[N]  integral part of a velocity arm's hold
    bent  f8[N]  memory
    baseline  f8[N]  torques that disturb for long
    reduced_torque  f8[N]  what corrections ask for beyond a_max, of each motor
    missing  f8[N]  torques less ``baseline``, in a short mean
    same moved  f8[N]
    increment  f8[N]  the smallest step between samples
    grain  f8[N]  the smallest one that noise does not make
    way  f8[N]  the farthest that the reference went while a working sensor repeated itself
    going  f8[N]  speeds in a stop, in a short mean
    innovation  f8[N]
    age  i8[N]
    held  i8[N]  samples that repeat are looked through, see ``ftqp.kernel.feedback.repeats``
    restless  i8[N]  ... because its noise would have changed them
    jump  f8[N]  how far samples went beside what was sent since the last good ones
    step jumps  f8[N]  by how much an encoder that has jumped is off; by how much more it seems to be
    step_at  i8[N]  the tick at which that was found
    lost bad still known_failed  i8[N]
    asks  i8[N]  for its brake, as ``brakes`` says that the arm has them
    others  i8[N]  memory
    persistence  i8[HYPOTHESES,N]  ticks for which each hypothesis of the monitor has had evidence, those of
        the whole arm at joint 0
    tip  f8[12]
    push_at_tip  f8[3]
    M  f8[N,N]
past  The last ticks in a ring: reference, what was sent, tip of the reference and its error.
    known  i8[DELAYS]
    q v  f8[DELAYS,N]
    a tau  f8[DELAYS,N]  acceleration and torque that were sent
    tip  f8[DELAYS,12]
    error  f8[DELAYS,6]
history  Given targets of the last second, every few ticks.
    newest  i8
    halved  i8  how often every second one was dropped, as the arm was held for longer
    age  f8  of the newest
    held  f8  for how long of the lateness the arm was held or stopped
    last  f8[TARGET_SIZE]  given in the last tick, while something is late
    given  f8[TARGET_SIZE]
    turn  f8[9]
    target  f8[HISTORY,TARGET_SIZE]
gate  What ``ftqp.kernel.feedback.gate`` keeps for itself: what was last let through; every tick begins at it.
    shut  i8  ticks in which it was shut
    q v  f8[N]  the reference that was last let through
    sent speed  f8[N]  positions and velocities that went to the arm with it; 0 where a joint swings freely
    tau  f8[N]  the torques
held  What ``ftqp.kernel.feedback.held`` keeps of the arm as a whole: it stands although it should move.
    on  i8  the whole arm is held
    sees  i8  so many samples before this one are known, as far as is counted
    alone  i8  the joint that should have moved stayed behind when others were let go: no evidence
    stood  f8  for how long all joints have stood
    ahead  f8  how far ahead of the arm it is sent
    since  f8  time since the sample before
    last speed  f8[N]  the sample before, and its change, filtered
    asked  f8[N]  each joint was sent to move
    moved_lately  f8[N]  for how long it still counts as one that has just moved, with its sign
    begun  f8[N]  its reference when all began to stand
    baseline  f8[N]  how far ahead of its sample it is sent in the mean, or what disturbs a torque arm
    at  f8[N]  where it is held
    older  f8[2,N]  the two samples before the last one
    sigma  f8[N]  the standard deviation of samples, learned, and at least what was stated
    usual  f8[N]  the same by what is usual of them: of some that are far off it knows nothing
    near  f8[N]  where it stands now, as this may go slowly
    way  f8[N]  the sign of where it was to go
monitor  What ``ftqp.kernel.monitor`` learns of each servo, and what speaks against each joint.
    on  i8  the arm takes positions or velocities
    names  i8  what is found is said, so that the planner counts on it
    sees  i8  the filters hold samples
    ideal  i8  samples were the commands to the last bit while the arm moved
    every count  i8  ticks from one look at a joint to the next, and since the last one at joint 0
    news  i8  ``found`` has changed
    holds  i8  all joints stand though they should not, which is one cause
    settles  i8  ticks until an arm that was switched on is judged: first it goes where its load draws it
    suspect  i8  the joint that most speaks against
    pole w D  f8  of the filters, their corner [1/s], and the gain of their differences [1/s]
    decay  f8  of motion that was asked for, from one look to the next
    leak fades  f8  what a tick and a look take of what is older, of an arm that takes velocities; else 0
    kappa  f8  the share of an independent look that a look is
    level top  f8  evidence that decides, and the most that is kept
    worst  f8  the most that speaks against a joint, as a share of what decides
    full  f8  by how much a command was held back, as a share of how far it may lead
    u y  f8[N]  what was sent, or its integral, and the sample that came after it
    speed  f8[N]  what was sent a tick before
    u_f y_f  f8[3,N]  both behind one, two and three poles
    total  f8[N]  samples since the last look, and their means over the last looks
    means  f8[4,N]
    v a  f8[N]  of the samples and of what was sent, each as far as it can be trusted
    follows  f8[2,N]  how fast it is if it follows what was sent with half its lag, and with all of it
    differs  f8[2,N]  squares of how far the samples' v and a are from those of what was sent, lately
    blurs  f8[2]  what noise of the samples is in v and a, as variances of one of 1
    peak_v peak_a  f8[N]  the most of what was asked for lately
    act  f8[N]  motion that was asked for [rad/s or m/s]
    unit  f8[N]  one over a fifth of the torque limits
    weight inertia own  f8[N]  g, M a, and M_ii of the model, in these units
    slow  f8[N,SERVO]  what is older in what the parameters multiply
    sense hold  f8[N]  to which side friction acts, from -1 to 1; what it holds the joint back by [rad or m]
    theta stated  f8[N,SERVO]  what is known of the servo now, and what was stated of it
    doubt  f8[N,SERVO]  standard deviations of what was stated
    P  f8[N,SERVO,SERVO]
    safe  f8[2,N,SERVO]  what was known when the evidence was zero, the last time and a while before
    safe_P  f8[2,N,SERVO,SERVO]
    safe_at  i8[N]  the tick of the last time
    missed sharp tail  f8[N]  motion that the model misses [s]; believed sooner; the most that was seen lately
    way  f8[N]  motion that was learned from [0.05 rad or m]
    r spread S z z_old  f8[N]  the residual, noise and what is missed, its variance, r/sqrt(S), the last one
    S_sharp z_sharp z_sharp_old  f8[N]  the same with ``sharp``: what a lock is judged by
    G G_lock G_free anchor  f8[N]  evidence that a joint does not follow, stands, has no motor; since where
    asked  f8[N]  what it had been sent, lag aside, when it last moved
    rests blind  i8[N]  it has not moved lately; ticks until its samples count again
    found found_at  i8[N]  what was found, a set of kinds, and the tick
    began  i8[N]  the tick at which the evidence was last zero, until something is found
    counted  i8[N]  what of it the planner counts on
    place tell  f8[N]  where it stood then, and by how much more it is asked for
    used  f8[N,SERVO]  what of it leads the command, which follows what is known slowly
    stated_lead droop  f8[N]  lag that was stated [s], and by how much a joint that stands is led
    unsure response  f8[N]  variance of what leads a command, and how long a servo may take to follow [s]
    room  f8[N]  how far ahead of a joint its command may be
    scatter uneven  f8[N]  variance of samples at rest [rad2 or m2]; beside it in motion, of a look's way
    ripple  f8[N]  by what share it goes faster between two commands than in the mean
    phi gain  f8[SERVO]  memory
    alone  f8[N]  memory
learned  What ``ftqp.kernel.feedback.learned_inertia`` finds that a torque arm's model does not say.
    on  i8  it is learned
    based  i8  ``base_`` holds the model
    samples  i8  ticks since the filters began
    wait  i8  ticks until they count
    start  i8  ticks until they have forgotten how they began in motion
    every  i8  ticks between two estimates
    estimates  i8  how many there were
    until_kept  i8  estimates until the next one is kept
    until_free  i8  ticks until a joint that swings freely is heard
    working  i8  joints that worked at the last tick
    later  i8  ticks that samples come later than was stated
    softer  i8  how often the loop was softened, as it rang
    until_later  i8  estimates until the delay is learned again
    quiet  i8  estimates in which the arm has moved and nothing shook
    shook  i8  something did lately
    pole  f8  of the filters
    forget  f8  what an estimate leaves of the information of the one before
    doubt  f8  rotor inertia that the model may lack
    gain  f8  of ``tau_slow``
    begun  f8  what the filters make of a constant, ``one`` that of one
    felt  f8  what they make of the noise of samples, as an acceleration
    reach base_mass base_lever base_stoutness  f8
    delay_known delay_moment  f8  information of what is left of the delay [1/ticks2], and the product of both
    delay_missed  f8  squares of what the equations miss
    fixed  i8[N]  rotor and friction are at a bound
    q tau sense  f8[POLES,N]  filters in a row, of samples, torques and the sense of motion
    rotor friction  f8[N]  estimates
    sigma  f8[N]  how wrong the rotor may be
    used  f8[N]  the rotor that counts
    slowness  f8[N]  of ``tau_slow`` of each joint
    missed  f8[N]  mean square of what the equations miss, in units of what is taken for noise
    base_armature  f8[N]
    a sent  f8[N]  acceleration and torque that are looked at
    noise  f8[N]  variance of the noise of samples
    one  f8[POLES]
    raw  f8[3,N]  samples
    q_was  f8[2,N]  last outputs of the filters
    tau_was  f8[N]  the same
    moment  f8[N,UNKNOWNS]  of the least squares of a joint's torque: rotor, friction, mass, first moment
    information  f8[N,UNKNOWNS,UNKNOWNS]  the same
    row  f8[UNKNOWNS]
    load  f8[4]  estimate
    base_com  f8[3]
    base_inertia  f8[6]
    S  f8[4,4]
    total  f8[4]
    slope  f8[N]  of the filtered torque [N m/s or N/s]
    slope_mean off_mean a_mean  f8[N]  slow means of it, of what the equation misses, and of ``a``
    swung  f8[N]  how far an acceleration was from its slow mean at a joint's last swing to and fro
    swings  f8[N]  how many of these there were lately
    paces  f8[SOFTER+1,LATER+1,5]  the loop's gains, softer and with more ticks, as ``PACES``; stiffness 0:
        none
    kept_load  f8[KEPT,4]
    kept_rotor kept_friction kept_sigma  f8[KEPT,N]
"""
FEEDBACK_ROOMS: Final = sections(TEXT, vars(enums) | vars(hypotheses) | globals())
"""What gives the fields of each."""
