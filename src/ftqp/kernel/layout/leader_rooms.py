"""What leads an arm beside the clock: the memory of a path, of a base that moves, and of joints' motions."""

from ftqp.kernel.layout.enums import DELAYS, TARGET_SIZE
from ftqp.kernel.layout.field_kinds import Fields, floats, scalars


def path_fields(N: int) -> Fields:
    """A path that is followed by its progress.

    ``progress``: path time reached [s]; ``rate``: its derivative in [0, 1], negative while not known;
    ``stop``: path time of the next jump of the twist; ``limit``: largest rate allowed now; ``ahead``:
    largest rate from which the arm can stop before the next jump; ``left``: largest rate beside an error
    that the feedback no longer corrects; ``feedback``: kp e of each row, where the path is blocked all but
    the velocity feedback; ``bend``: x'' - Jdot q' of each row; ``interval``: of the path's table;
    ``target``: the path's at the progress; ``drive``: velocity that the null space is drawn to where
    ``driven``; ``found``: whether it is a way past a singularity, looked for where ``speed`` is not 0;
    ``kept``: the error, while it is looked for.
    """
    return [
        *scalars("i8", "interval driven found"),
        *scalars("f8", "progress rate stop end limit ahead left speed"),
        *floats({"feedback": (6,), "bend": (6,), "kept": (6,), "target": (TARGET_SIZE,), "drive": (N,)}),
    ]


def base_fields(N: int) -> Fields:
    """A base that moves in the inertial frame I, see ``ftqp.kernel.rows.inertial_target``.

    ``tip_world`` and ``given``: measured poses of tip and base in I; ``rate``: given twist of the base at its
    origin, along I; ``now``: pose of the base when it was measured; ``pose``: the same brought to now;
    ``shift``: displacement of the tip by the base in one sample, as observed; ``twist``: of the tip by the
    base, predicted for the coming sample; ``error``: from the tip to the target along I; ``arm_history``:
    rotation and position of the tip in the base; ``setpoint``: sum of the commands since the start; ``age``:
    how long the base has not been seen [s]; ``patience``: how long it may not be seen [s]; ``observer``:
    low-pass factor of the disturbance observer, 0: none.
    """
    return [
        *scalars(
            "i8", "code attitude has delay ticks seen rates ever stale freezes hold leaning anti_windup"
        ),
        *scalars("f8", "gain observer age patience rank tolerance"),
        *floats(
            {
                "tip_world": (4, 4),
                "given": (4, 4),
                "rate": (6,),
                "rate_last": (6,),
                "nominal": (9,),
                "now": (4, 4),
                "last": (4, 4),
                "pose": (4, 4),
                "shift": (6,),
                "twist": (6,),
                "error": (6,),
                "turn": (9,),
                "tip": (9,),
                "product": (9,),
                "six": (6,),
                "setpoint": (N,),
                "arm_history": (DELAYS, 12),
            }
        ),
    ]


def joints_fields(N: int) -> Fields:
    """A motion of the joints that is followed, see ``ftqp.kernel.rows.joint_reference``.

    ``q`` and ``v``: where each joint should be now; ``x``: its mean acceleration, or velocity, until the next
    tick; ``demand``: what the QP is asked for; ``kp`` and ``kv``: gains on the error.
    """
    return [*scalars("f8", "kp kv"), *floats(dict.fromkeys(("q", "v", "x", "demand"), (N,)))]
