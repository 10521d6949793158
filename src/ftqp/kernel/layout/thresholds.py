"""Thresholds that compiled code and Python read alike."""

from typing import Final

SCALED_FROM: Final = 0.999
"""A path scale or a path rate below this counts as scaled."""
OUTSIDE_FROM: Final = 1e-6
"""A joint beyond its range by more than this [rad or m], or faster by more than this share, is outside."""
OUTSIDE_SIGMAS: Final = 6.0
"""One that is measured there is outside by so many standard deviations of its sensor's noise more."""
ORTHONORMAL_TOLERANCE: Final = 1e-6
"""Largest entry of |R'R - I| that still counts as a rotation, as in ``ftqp.core.pose``."""
LATELY: Final = 0.02
"""Torques that two joints on one axis lack are looked at in the mean over such a time [s]."""
STILL_SAMPLES: Final = 8
"""A locked joint that has been seen to rest for so many samples stands."""
MOST_ROWS: Final = 1 << 40
"""More rows of targets than any memory holds, few enough that their numbers can be counted."""
FASTEST: Final = 30.0
"""No joint is faster than this [rad/s or m/s], or than twice its limit."""
UNLIMITED: Final = 1e4
"""... and one without a limit not faster than this, nor is it sent so fast."""
