"""The arm that a detector sees beside a planner: with the rotors, load and friction that were learned."""

from typing import Any

from ftqp.kernel.feedback.learned_inertia import is_known
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.thresholds import PUSHED

BEYOND_FRICTION = 0.8
"""Friction of which nobody knows holds no push of this share of the most that it is taken for, ``PUSHED`` of
the torque limit. Less than one, so that a joint that is pushed harder and harder gets there."""
UNSURE = 1.3
"""Friction that is known may hold so many times itself, as it may have changed by 30 % (``FRICTION_UNSURE``)
since it was identified. A guess that `python studies/detection.py` has not contradicted."""
LEAST_HELD = 0.02
"""And any joint this [N m or N]. A guess that `python studies/detection.py` has not contradicted."""

DOUBTS = 3.0
"""A rotor may be so many standard deviations heavier than it counts: two, as usual for errors, and one by
which it counts less than its estimate. A guess that `python studies/healthy_arms.py` has not contradicted."""


@jit
def see_arm(D: Any, A: Any, K: Any) -> None:
    """Take what the planner K has learned of its arm into the arm A that the detector D looks at.

    It stands still while something is suspected, because the planner learns from the fault, too. Until the
    planner knows its arm the means of residuals are not begun, so that no fault is read out of the model's
    errors. ``holds`` is the push of a motor that friction may hold: known friction, or as much as the planner
    pushes a joint that sticks; ``doubt`` is the rotor that a joint may have beside what counts.
    Source: docs/theory/detection.md, "The arm that is looked at".
    """
    learned = K.learned
    if learned.on == 0 or learned.based == 0:
        return
    if not is_known(K.state, learned):
        D.taken = 0
    if D.watch != 0:
        return
    body = K.chain.tip_joint
    A.chain.mass[body] = K.chain.mass[body]
    for k in range(3):
        A.chain.com[body, k] = K.chain.com[body, k]
    for k in range(6):
        A.chain.inertia[body, k] = K.chain.inertia[body, k]
    for i in range(D.n):
        A.chain.armature[i] = K.chain.armature[i]
        D.doubt[i] = DOUBTS * learned.sigma[i]
        D.coulomb[i] = max(D.told_coulomb[i], learned.friction[i])
        if D.told_coulomb[i] < 0.0:
            D.holds[i] = BEYOND_FRICTION * PUSHED * D.tau_max[i]
        else:
            D.holds[i] = UNSURE * D.coulomb[i] + LEAST_HELD
