"""The outer loop of the tip: the target is displaced by what the arm leaves of the reference."""

from typing import Any

from ftqp.kernel.arm.kinematics import forward_kinematics, tip_of
from ftqp.kernel.arm.pose_error import turn_between
from ftqp.kernel.feedback.reference import follows
from ftqp.kernel.feedback.samples import slot
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import ACCELERATION
from ftqp.kernel.maths.side_by_side import load_lanes, store_lanes
from ftqp.kernel.maths.vectors import three
from ftqp.kernel.settling.rest import gives_up

STOOD = 0.3
"""How long the target has stood [s] before the displacement may rest, ..."""
QUIET, LOUD = 0.04, 0.1
"""... when what is left of the error is below the first share of tolerance, until it is above the second. Two
shares, so that it does not flicker: dry friction would make an integrator hunt (docs/theory/feedback.md, "The
tip")."""


@jit
def _keep_tip(kinematics: Any, place: Any) -> None:
    """The tip of the present kinematics, rotation by rows and origin, into (12,)."""
    place[8] = kinematics.R_tip[8]
    place[9], place[10], place[11] = three(kinematics.o_tip)
    store_lanes(place, 0, load_lanes(kinematics.R_tip, 0))


@jit
def _difference(seen: Any, reference: Any, off: Any) -> None:
    """d = seen (-) reference: difference of the origins, rotation vector of R_seen R_ref', along W."""
    for k in range(3):
        off[k] = seen[9 + k] - reference[9 + k]
    S, R = seen, reference
    off[3], off[4], off[5] = turn_between(S, 3, R, 3)


@jit
def look_at_tip(K: Any) -> None:
    """Kinematics of the reference, and d: the measured tip beside that of the reference of the same time."""
    feedback, past, task = K.feedback, K.past, K.task
    n, now = K.chain.n, feedback.now
    exact = follows(feedback, K.chain, past)
    feedback.exact = exact
    if not (exact or task.has_tip_measured):
        for i in range(n):
            K.supposed.q[i] = feedback.seen[i]
        tip_of(K, K.supposed)
        _keep_tip(K.kinematics, feedback.tip)
    forward_kinematics(K, K.state)
    if exact and not task.has_tip_measured and feedback.latency == 0:
        for k in range(6):
            feedback.off[k] = 0.0
        return
    _keep_tip(K.kinematics, past.tip[now])
    past.known[now] = 1
    then = slot(feedback, feedback.latency)
    if task.has_tip_measured:
        for r in range(3):
            for c in range(3):
                feedback.tip[3 * r + c] = task.tip_measured[r, c]
            feedback.tip[9 + r] = task.tip_measured[r, 3]
        feedback.has_tip = 1
    else:
        feedback.has_tip = 0
        if exact:
            for k in range(6):
                feedback.off[k] = 0.0
            return
    if past.known[then]:
        _difference(feedback.tip, past.tip[then], feedback.off)


@jit
def _rests(feedback: Any, settling: Any) -> bool:
    """Whether the displacement rests: near a target that stands, where dry friction would make it hunt."""
    if settling.stood < STOOD or feedback.tip_gap > LOUD:
        feedback.quiet = 0
    elif feedback.tip_gap < QUIET:
        feedback.quiet = 1
    return feedback.quiet != 0


@jit
def correct(K: Any) -> None:
    """c'' = -kappa^2 (c + d) - 2 kappa c', and what it adds to the task: c to its error, the rest to b.

    It takes back what a measured tip shows, and nothing else: what joints leave is taken back by what leads
    them or by their own loops, of which one that is slower than this one would be chased. It
    rests while a sample is refused, while the whole arm is held, during a stop, near a target that stands,
    when the arm holds, and when it has swung for so long that it gives up. The task's own gains do not see c:
    its velocity and its acceleration are fed forward, so that kappa alone decides how fast the arm's error is
    taken back.
    Source: docs/theory/feedback.md, "The tip".
    """
    state, task, watch, feedback, settling = K.state, K.task, K.watch, K.feedback, K.settling
    c, rate, kappa, dt = feedback.c, feedback.c_rate, feedback.kappa, state.dt
    share = 1.0 if feedback.has_tip else 0.0
    feedback.displaced = 0
    for k in range(6):
        if c[k] != 0.0 or rate[k] != 0.0 or share * feedback.off[k] != 0.0:
            feedback.displaced = 1
    if not feedback.displaced:
        return
    blind = feedback.refused > 0 or feedback.holding > 0
    frozen = (
        blind or watch.latched != 0 or _rests(feedback, settling) or settling.holding or gives_up(settling)
    )
    frozen = frozen or K.held.on != 0
    for k in range(6):
        if frozen:
            rate[k] = feedback.push[k] = 0.0
            continue
        change = -kappa * kappa * (c[k] + share * feedback.off[k]) - 2.0 * kappa * rate[k]
        rate[k] += dt * change
        c[k] += dt * rate[k]
        feedback.push[k] = change + task.kv * rate[k] if state.level == ACCELERATION else rate[k]


@jit
def displace(task: Any, feedback: Any) -> None:
    """The task's error becomes that to the displaced target."""
    if not feedback.displaced:
        return
    for k in range(6):
        task.error[k] += feedback.c[k]
