"""The rooms of the loop between the reference and the arm: its state, the last ticks, the last targets."""

from ftqp.kernel.layout.enums import DELAYS, HISTORY, TARGET_SIZE
from ftqp.kernel.layout.field_kinds import Fields, floats, integers, scalars
from ftqp.kernel.layout.hypotheses import HYPOTHESES


def feedback_fields(N: int) -> Fields:
    """The loop between the reference and the arm, see ``ftqp.kernel.feedback``.

    ``active``: this tick is posed at the reference; ``fresh``: the loop begins anew, and how; ``kind``: what
    the arm takes; ``latency``: ticks by which samples are late; ``span``, ``now``: length and place of the
    ring ``past``; ``refused``: bad samples now; ``stride``: ticks between kept targets; ``culprit``: the
    joint that is farthest from its command, -1 none; ``kappa``, ``hold``, ``stiffness``: bandwidth of the
    tip's, a velocity arm's and a torque arm's loop [1/s]; ``servo``: of the slowest servo, inf if it is
    not known [rad/s]; ``pole``, ``pole_failed``: of the
    observer; ``sigma``: noise of the samples; ``c``: displacement of the target; ``off``: measured tip
    less that of the reference; ``left``: their sum; ``push``: what the displacement feeds forward;
    ``seen``: samples as believed; ``good``: last good ones, ``age`` ticks old, ``offset`` from the
    reference; ``raw``: what was measured last, ``same`` times in a row more, while the reference went
    ``moved``; ``increment``: the smallest step between samples, ``way``: the farthest that the reference
    went while a working sensor repeated itself, ``restless``: samples that jittered at rest; ``held``:
    samples that repeat are looked through, see ``ftqp.kernel.feedback.repeats``, ``holding`` of them;
    ``wide``: for how long samples may still be far off, after an impact or a late loop, ``thrown``: the
    same after an impact alone [s]; ``spent``: patience that bad ones
    have cost [s]; ``lasting``: ticks for which each hypothesis of the monitor has had evidence, those of
    the whole arm at joint 0; ``any_counted``: some joint is out of hand; ``asks``: for its brake, as
    ``brakes`` says that the
    arm has them; ``going``: speeds in a stop, in a short mean, ``moving``: the joint that goes on, from
    1, 0 none; ``others``, ``bent``: scratch; ``quiet``: the displacement rests; ``unresponsive``: joints
    that do not obey, ``unresponsive_count`` of them; ``touched``: ticks for which something has pushed the
    tip, with ``push_at_tip``, ``strongest`` as a share
    of the torque limits; ``heard``: ticks of observation; ``usual``: torques that disturb for long;
    ``asked``: accelerations that those joints should have; ``own_``: their observer if they obey,
    ``alone``: their inertia then; ``place``: the suspect's column of ``past.own``; ``softened``:
    ``soft_one`` and ``soft_other`` are on one axis, and one of them seems not to obey, ``softly``: what
    holds them; ``odd``: torques less ``usual``, ``missing`` in a short mean;
    ``felt_noise``: of d_hat; ``wound``: integral part of a velocity arm's hold; ``speed_margin``: share
    of the speed limits that is left to servos.
    """
    names = ("seen", "good", "raw", "offset", "spent", "q_hat", "v_hat", "d_hat", "d_slow", "q_now", "v_now",
             "q_sent", "v_sent", "tau_sent", "h", "wound", "bent", "usual", "asked", "softly", "missing",
             "odd", "own_q", "own_v", "own_d", "own_slow", "alone",
             "same", "moved", "increment", "way", "restless", "going",
             "innovation", "own_missed", "dead_missed")  # fmt: skip
    return [
        *scalars("i8", "active fresh kind latency span now refused holding exact displaced has_tip quiet"),
        *scalars("i8", "lagging far stored until_stored stride culprit any_counted"),
        *scalars("i8", "brakes moving"),
        *scalars("i8", "unresponsive_count heard place_taken softened touched soft_one soft_other"),
        *scalars("f8", "kappa hold servo stiffness pole pole_failed sigma patience"),
        *scalars("f8", "failed_noise felt_noise missing_noise"),
        *scalars(
            "f8", "tolerance rotation_tolerance gap tip_gap gap_filtered rate rate_change late up speed"
        ),
        *scalars("f8", "waited spent_elsewhere speed_margin wide thrown strongest"),
        *floats(dict.fromkeys(("c", "c_rate", "push", "off", "left"), (6,))),
        *floats(dict.fromkeys(names, (N,))),
        *integers(dict.fromkeys(("age", "held", "lost", "bad", "still", "known_failed"), (N,))),
        *integers(dict.fromkeys(("asks", "others", "unresponsive", "place"), (N,))),
        *integers({"lasting": (HYPOTHESES, N)}),
        *floats({"tip": (12,), "push_at_tip": (3,), "M": (N, N)}),
    ]


def past_fields(N: int) -> Fields:
    """The last ticks in a ring: reference, what was sent, tip of the reference and its error.

    ``a``, ``tau``: acceleration and torque that were sent.

    ``own``: what a suspect, and the one before it, was sent.
    """
    return [
        *integers({"known": (DELAYS,)}),
        *floats(dict.fromkeys(("q", "v", "a", "tau"), (DELAYS, N))),
        *floats({"own": (DELAYS, 2)}),
        *floats({"tip": (DELAYS, 12), "error": (DELAYS, 6)}),
    ]


def history_fields(N: int) -> Fields:
    """Given targets of the last second, every few ticks; ``age`` of the newest [s].

    ``halved``: how often every second one was dropped, as the arm was held for longer; ``held``: for how long
    of the lateness it was [s].
    """
    return [
        *scalars("i8", "newest halved"),
        *scalars("f8", "age held"),
        *floats({"given": (TARGET_SIZE,), "turn": (9,), "target": (HISTORY, TARGET_SIZE)}),
    ]
