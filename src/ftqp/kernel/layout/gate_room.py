"""The room of the output gate: what was last let through."""

from ftqp.kernel.layout.field_kinds import Fields, floats, scalars


def gate_fields(N: int) -> Fields:
    """What ``ftqp.kernel.feedback.gate`` keeps for itself; every tick begins at it.

    ``q`` and ``v``: the reference that was last let through; ``sent``: the positions that went to the arm
    with it, ``speed``: the velocities, 0 of a joint that swings freely; ``tau``: the torques. ``lead``: how
    far ahead of the reference positions are sent [s]. ``shut``: ticks in which it was shut.
    """
    return [
        *scalars("i8", "shut"),
        *scalars("f8", "lead"),
        *floats(dict.fromkeys(("q", "v", "sent", "speed", "tau"), (N,))),
    ]
