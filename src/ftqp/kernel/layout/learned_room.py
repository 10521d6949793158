"""The room of what is learned of a torque arm that its model does not say: rotors, a load, friction."""

from ftqp.kernel.layout.field_kinds import Fields, floats, integers, scalars

POLES = 4
"""Of the filters: one more than a second difference needs to be smooth."""
UNKNOWNS = 6
"""What the torque of one joint says something of: its rotor, its dry friction, mass and first moment of a
load."""
KEPT = 6
"""So many earlier estimates are kept, so that one can be gone back to that a fault has not touched."""

LATER = 5
"""Samples may come so many ticks later than was stated: the latency of common arms."""
PACES = ("stiffness", "pole", "kappa", "felt_noise", "missing_noise", "gain")
"""What changes with the delay, the last in the room ``learned``, the others in ``feedback``."""


def learned_fields(N: int) -> Fields:
    """What ``ftqp.kernel.feedback.learned_inertia`` needs.

    ``on``: it is learned; ``based``: ``base_`` holds the model; ``heard``: ticks since the filters began;
    ``start``: ticks until they have forgotten how they began in motion, ``wait``: until they count;
    ``begun``: what they make of a constant, ``one`` its filter; ``every``: ticks between two estimates;
    ``estimates``: how many there were; ``until_kept``: estimates until the next one is kept; ``until_free``:
    ticks until a joint that swings freely is heard; ``working``: joints that worked at the last tick.
    ``pole``: of the filters; ``forget``: what an estimate leaves of the information of the one before;
    ``doubt``: rotor inertia that the model may lack [kg m2 or kg]; ``gain``: of d_slow. ``q``, ``tau``,
    ``sense``: filters in a row, of samples, torques and the sense of motion; ``felt``: what they make of the
    noise of samples, as an acceleration, ``noise``: its variance, from the samples ``raw``; ``q_was``,
    ``tau_was``: their last outputs; ``a``, ``sent``: acceleration and torque that are looked at.
    ``information`` and ``moment``: of the least squares of a joint's torque, in the order rotor, friction,
    mass, first moment. ``rotor``, ``friction``, ``load``: estimates; ``sigma``: how wrong the rotor may be,
    ``missed``: mean square of what the equations miss, in units of what is taken for noise; ``fixed``:
    whether rotor and friction are at a bound; ``used``: the rotor that counts. ``slowness``: of d_slow of
    each joint.

    ``later``: ticks that samples come later than was stated; ``until_later``: estimates until the delay is
    learned again; ``delay_known`` and ``delay_moment``: information of what is left of it [1/ticks2] and its
    product with that; ``delay_missed``: squares of what the equations miss; ``quiet``: estimates in which the
    arm has moved and nothing shook; ``shook``: whether something did lately; ``slope``: of the filtered
    torque [N m/s or N/s]; ``slope_mean``, ``off_mean``, ``a_mean``: slow means of it, of what the equation
    misses, and of ``a``. ``by_delay``: what the loop's gains are with each number of ticks, in the order of
    ``PACES``; a stiffness of 0 is none.
    """
    return [
        *scalars("i8", "on based heard wait start every estimates until_kept until_free working"),
        *scalars("i8", "later until_later quiet shook"),
        *scalars("f8", "pole forget doubt gain begun felt reach base_mass base_lever base_stoutness"),
        *scalars("f8", "delay_known delay_moment delay_missed"),
        *integers({"fixed": (N,)}),
        *floats(dict.fromkeys(("q", "tau", "sense"), (POLES, N))),
        *floats(
            dict.fromkeys(
                (
                    *("rotor", "friction", "sigma", "used", "slowness", "missed", "base_armature"),
                    *("a", "sent", "noise"),
                ),
                (N,),
            )
        ),
        *floats({"one": (POLES,), "raw": (3, N), "q_was": (2, N), "tau_was": (N,), "moment": (N, UNKNOWNS)}),
        *floats({"information": (N, UNKNOWNS, UNKNOWNS), "row": (UNKNOWNS,)}),
        *floats({"load": (4,), "base_com": (3,), "base_inertia": (6,), "S": (4, 4), "total": (4,)}),
        *floats(dict.fromkeys(("slope", "slope_mean", "off_mean", "a_mean"), (N,))),
        *floats({"by_delay": (LATER + 1, len(PACES))}),
        *floats({"kept_load": (KEPT, 4)}),
        *floats(dict.fromkeys(("kept_rotor", "kept_friction", "kept_sigma"), (KEPT, N))),
    ]
