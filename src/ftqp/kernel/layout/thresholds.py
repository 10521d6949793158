"""Thresholds that several rooms, or compiled code and Python, read alike.

A tuned number that gives no reason, here and elsewhere, is a guess that campaigns and tests have not
contradicted.
"""

from math import sqrt
from typing import Final

SCALED_FROM: Final = 0.999
"""A path scale or a path rate below this counts as scaled. A convention: what a solver leaves of 1 is
less."""
AT_REST: Final = 1e-3
"""A joint that moves slower than this share of its velocity limit is at rest."""
GOES_ON: Final = 0.05
"""A joint that is seen to be faster than this share of its limit while its command rests goes on ..."""
STANDS: Final = 0.02
"""... until it is slower than this, in a mean that noise does not count in; so is one that holds a joint that
swings freely in balance."""
TIME_SLACK: Final = 1e-9
"""Times nearer to each other than this count as equal [s], so that 3 * 0.1 s is 0.3 s. Some ten thousand
units of rounding of a path's time."""
LENGTH_FRACTION: Final = 1.0 / 6.0
"""Characteristic length by reach: where a norm mixes units, one radian counts as much as this length."""
REACHES: Final = 20.0
"""A place farther from the base than so many reaches is probably in millimetres. A convention."""
SINGULAR_FROM: Final = 0.02
"""Singular value of the Jacobian [characteristic lengths] below which a direction counts as singular."""
PROOF_SHARE: Final = 1e-9
"""What a proof of infeasibility must exceed, as a share of the sum of its terms: a million units of
rounding."""

RELAXED_FROM: Final = 1e-3
"""A task residual above this share of the task's right side, plus ..."""
TASK_FLOOR: Final = 1e-4
"""... this in the task's own unit [m/s2 or m/s, rad alike], counts as relaxed. Both are far above what a
solver may leave, so that backends agree."""

MISSED_FROM: Final = 0.5
"""A task beside the tip's, or after it, is missed where so much of what it asks for is left: D leaves some
while it has far to go."""

OUTSIDE_FROM: Final = 1e-6
"""A joint beyond its range by more than this [rad or m], or faster by more than this share, is outside. A
convention, finer than encoders."""
NOISE_LEVELS: Final = 6.0
"""So many standard deviations of a noise are noise: it exceeds them twice in 1e9 samples by itself."""
ROUNDING: Final = 1e-9
"""What rounding may add to a position, a speed, a torque or a rate: this, and this share of it. A million
units of rounding, and far below what an encoder shows."""
RETURNS: Final = 0.5
"""Share of its speed limit at which the command goes back to a joint that is held: the other half catches up
with what moves meanwhile."""
FASTEST: Final = 30.0
"""No joint is faster than this [rad/s or m/s], or than twice its limit ..."""
UNLIMITED: Final = 1e4
"""... and one without a limit not faster than this, nor is it sent so fast [rad/s or m/s]. Conventions, far
beyond arms: what is faster is a wrong number."""
MOST_ROWS: Final = 1 << 40
"""More rows of targets than any memory holds, few enough that their numbers can be counted."""

ERROR_BAND, BAND_TIME = 0.02, 0.1
"""A joint may be this far [rad or m] from its command, farther by what that moves in this time [s], and by
the noise of its sensor."""
COARSEST: Final = 5e-3
"""No encoder has larger steps [rad or m]."""
NOISE_OF_D: Final = sqrt(3.0) / 4.0
"""sigma_d = 0.43 sigma w^(5/2) dt^(1/2) is the noise of an observed acceleration. Derived, and compared with
a Monte Carlo (docs/theory/feedback.md, "The observer")."""
LEAST_SPEED: Final = 0.03
"""A reference slower than this [rad/s or m/s] does not show whether a joint stands."""
LATELY: Final = 0.02
"""Torques that two joints on one axis lack are looked at in the mean over such a time [s], so that noise
falls (docs/theory/feedback.md, "Two joints on nearly one axis")."""
PUSHED: Final = 0.1
"""A torque arm's joint that sticks is taken for one with more and more friction, up to this share of its
torque limit."""
STILL: Final = 0.01
"""A joint that is seen to be slower than this [rad/s or m/s], beside noise, may as well stand; ..."""
STILL_SAMPLES: Final = 8
"""... a failed one that has been seen to rest for so many samples does."""

FREE_SHARE: Final = 1e-3
"""Weight of a free-swinging joint as a share of the others': its own row decides what it does."""
HANGS: Final = 0.05
"""A free joint slower than this may be hanging where it can rest [rad/s or m/s]."""

NEARER = 1e-3
"""Bodies that are nearer than they are to be kept by more than this [m] are said to be."""
LAST = 1e-8
"""Compliance of rows that keep bodies apart beside |x - x_rest|^2 and the like, whose weight is 1: where they
cannot be kept apart, the excess costs more than any way to rest."""
MOST_TICKS = 5
"""A gap of more periods counts as one of so many. A convention: until then an arm that holds its last command
is at most five periods of motion behind it, which samples may be (``python studies/late_loops.py``)."""
SERVO_PRIOR: Final = (0.07, 0.004, 0.05, 0.05, 0.05, 0.05)
"""Standard deviations of what a servo may have before anything is known of it, lag [s], rotor over stiffness
[s2], friction, droop, and droop by weight and by inertia [rad or m]; a servo of 3 Hz lags by 0.1 s."""
SPEED_SERVO_PRIOR: Final = (0.07, 0.016, 0.05, 0.05, 0.2, 0.2)
"""The same of servos that take velocities, whose integral part is a fourth as stiff at the same bandwidth."""
TORQUE_PRIOR: Final = (0.1, 0.0, 0.25, 1.0, 0.1, 0.0)
"""Of joints that take torques, in fifths of their torque limit: viscous friction [a rad/s], the rotor, which
the drive says, dry friction, what nobody knows, and shares by which the model's masses are wrong."""
SERVO_DRIFT: Final = (0.003, 1e-4, 5e-4, 0.008, 1e-3, 1e-3)
"""How they change, per root of a radian or metre that the joint goes."""
GEAR: Final = 2e-4
"""By so much [rad or m] a joint moves whose brake is closed: play of common gears."""
LEAST_SHIFT, MOST_SHIFT = 3.0, 8.0
"""Standard deviations of the shifts that the evidence tests: below, learning takes them; above, all are
clear."""
MONITOR_POLES: Final = 3.0
"""Poles in a row behind which the monitor looks: it is so many time constants late, and forgets as fast."""
SUSPECTS: Final = 0.3
"""From this share of the evidence that decides on, a joint is said to be suspected."""
BESIDE: Final = 1e-6
"""A healthy joint farther than this from its command [rad or m] belongs to an arm with servos. More than
rounding of an arm that follows exactly, less than any servo's lag, so that it distinguishes the two."""
LONGEST: Final = 0.25
"""Positions are sent at most so far ahead of the reference [s]: the slowest servos lag by 0.12."""

ENDLESS: Final = 1e3
"""What an infinite limit of speed counts as [rad/s or m/s], far beyond any joint."""
ACCELERATION_SHARE: Final = 0.99
"""Share of the limits of acceleration and jerk that the motion uses: what is left corrects errors."""
LEAST_ACCELERATION: Final = 0.05
"""Share of a_max that the motion uses even where gravity leaves less, so that it ends."""
DEVIATION: Final = 0.01
"""A command so far from the motion begins it anew, because limits have held the arm back: by its place [rad
or m] ..."""
SPEED_DEVIATION: Final = 0.05
"""... or by its speed, as a share of v_max."""
STRONG: Final = 0.98
"""Motors that hold the arm at rest by this share of their limits are strong enough. A convention."""
EXACT: Final = 1e-6
"""A command so near to its goal has arrived [m, rad]. A convention."""
PATIENCE: Final = 1.0
"""An arm that comes no nearer and is slow for so long rests as near as it gets [s]."""
RESTLESS_PATIENCE: Final = 5.0
"""One that comes no nearer for so long and is not slow is stopped [s]."""
COMES_NEARER: Final = 0.02
"""Share of the distance, and of the tolerance, that counts as coming nearer."""
SLOW_SHARE: Final = 0.02
"""An arm whose joints are all slower than this share of their limit is slow. What these do stands in
docs/theory/ways-to-a-goal.md, "When the arm has arrived"."""
RISE_TIME: Final = 0.05
"""The time [s] in which the acceleration rises from zero to its limit, where nobody says another. It is that
of a stop (``STOP_RISE``)."""
BANDWIDTH, BANDWIDTH_STEPS = 20.0, 0.2
"""How fast an error to the motion decays, at most [1/s] and times dt: a fifth of it is taken off in a tick,
so that the sampled loop does not overshoot."""
