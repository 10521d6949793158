"""The room of what is known of the arm as a whole: whether it stands although it should move."""

from ftqp.kernel.layout.field_kinds import Fields, floats, scalars


def held_fields(N: int) -> Fields:
    """What ``ftqp.kernel.feedback.held`` keeps for itself.

    ``on``: the whole arm is held; ``sees``: the samples before this one are known; ``alone``: the joint that
    should have moved stayed behind when others were let go, so that one joint is no evidence; ``stood``: for
    how long all joints have stood [s]; ``ahead``: how far ahead of the arm it is sent [rad or m]; ``since``:
    time since the sample before [s]; ``still``: for how long all have stood, whatever they were sent [s].
    ``last``: the sample before, ``speed``: its change, filtered; ``asked``: each joint was sent to move;
    ``went``: for how long it still counts as one that has just moved, with its sign [s]; ``begun``: its
    reference when all began to stand; ``usual``: how far ahead of its sample it is sent in the
    mean, or by what it is disturbed where it takes torques; ``at``: where it is held, or began to
    stand; ``near``: where it stands now, as this may go slowly; ``way``: the sign of where it was to go.
    """
    names = ("last", "speed", "asked", "went", "begun", "usual", "at", "near", "way")
    return [
        *scalars("i8", "on sees alone"),
        *scalars("f8", "stood still ahead since"),
        *floats(dict.fromkeys(names, (N,))),
    ]
