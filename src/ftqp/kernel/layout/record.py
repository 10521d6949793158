"""The record: all that one planner knows, in rooms, in one array element that compiled code reads in place.

A helper is handed the rooms that it reads and writes, so that its signature says so; stages of a tick, which
touch more of them, take the whole record K. A solver gets ``K.qp`` and nothing else. Sizes are read at run
time. SI units; ``f8`` unless another type is named.
"""

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from ftqp.core.errors import InputError
from ftqp.kernel.layout.enums import DELAYS, JOINTS, TARGET_SIZE
from ftqp.kernel.layout.field_kinds import Fields, floats, scalars
from ftqp.kernel.layout.rooms import ROOMS


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


CAPACITIES = (JOINTS,)
"""Classes of records, by the most joints that they hold."""


def capacity_for(joints: int) -> int:
    """The smallest class of records that holds so many joints."""
    for capacity in CAPACITIES:
        if joints <= capacity:
            return capacity
    raise InputError(f"the arm has {joints} joints, expected at most {JOINTS}")


ARM_ROOMS = ("state", "kinematics", "chain")
"""The rooms of an arm without a planner: what kinematics and dynamics need."""


BELIEF_ROOMS = ("faults", "limits")
"""The rooms that faults are written into."""


LINE = 64
"""Bytes of a line of the cache, and of the widest register that is loaded at once."""


def _on_lines(fields: Sequence[Any]) -> np.dtype[Any]:
    """A type whose arrays and rooms each begin a line, so that no wide load of theirs needs two."""
    plain = np.dtype(list(fields), align=True)
    kinds, offsets, end = [plain[name] for name in plain.names or ()], [], 0
    for kind in kinds:
        unit = LINE if kind.itemsize >= LINE else kind.alignment
        offsets.append(-(-end // unit) * unit)
        end = offsets[-1] + kind.itemsize
    size = -(-end // LINE) * LINE
    layout: Any = {"names": plain.names, "formats": kinds, "offsets": offsets, "itemsize": size}
    return np.dtype(layout, align=True)


def zeros_in_line(dtype: np.dtype[Any]) -> Any:
    """Zeros of a type, (1,), that begin a line of the cache; the system maps only what is then written to."""
    room = np.zeros(dtype.itemsize + LINE, np.uint8)
    begin = -room.ctypes.data % LINE
    return room[begin : begin + dtype.itemsize].view(dtype)


def in_line(memory: Any) -> Any:
    """A copy of (1,) that begins a line of the cache."""
    copy = zeros_in_line(memory.dtype)
    copy.view(np.uint8)[:] = memory.view(np.uint8)  # as bytes, not field by field
    return copy


def _nested(rooms: dict[str, Any], capacity: int) -> np.dtype[Any]:
    return _on_lines([(name, _on_lines(fields(capacity))) for name, fields in rooms.items()])


@cache
def record_dtype(capacity: int) -> np.dtype[Any]:
    """The type of a record that holds up to ``capacity`` joints."""
    return _nested(ROOMS, capacity)


@cache
def arm_dtype(capacity: int) -> np.dtype[Any]:
    """The type of the record of an arm alone."""
    return _nested({name: ROOMS[name] for name in ARM_ROOMS}, capacity)


@cache
def belief_dtype(capacity: int) -> np.dtype[Any]:
    """The type of what is believed of an arm's joints: its rooms of limits and of faults."""
    return _nested({name: ROOMS[name] for name in BELIEF_ROOMS}, capacity)


@cache
def path_dtype(capacity: int) -> np.dtype[Any]:
    """The type of the record of a path that is followed by its progress."""
    return np.dtype(path_fields(capacity), align=True)


@cache
def base_dtype(capacity: int) -> np.dtype[Any]:
    """The type of the record of a base that moves."""
    return np.dtype(base_fields(capacity), align=True)


@cache
def joints_dtype(capacity: int) -> np.dtype[Any]:
    """The type of the record of a motion of the joints."""
    return np.dtype(joints_fields(capacity), align=True)


def record(capacity: int) -> Any:
    """One planner's record, (1,), zero but for ``yielding``; no joint swings freely."""
    W = zeros_in_line(record_dtype(capacity))
    W["task"]["yielding"] = 1.0
    W["free"]["joint"] = -1
    return W


def load_chain(K: Any, *, rotation: Any, translation: Any, mass: Any, com: Any, inertia: Any, prismatic: Any,
               continuous: Any, tip_rotation: Any, tip_translation: Any, gravity: Any,
               armature: Any = 0.0, viscous: Any = 0.0, coulomb: Any = 0.0, parent: Any = None,
               tip_joint: int | None = None, floating: int = 0, lead: Any = None,
               ratio: Any = 1.0, offset: Any = 0.0) -> None:  # fmt: skip
    """Write the constants of an arm, or of a tree of arms, into a record.

    Args:
        K: The rooms of one record, by attribute.
        rotation: Of each joint's frame in its parent's at q = 0, (n, 3, 3).
        translation: Of each joint's frame in its parent's, (n, 3) [m].
        mass: (n,) [kg].
        com: Centre of mass of each body in its joint's frame, (n, 3) [m].
        inertia: About the com, along the joint frame's axes, (n, 3, 3) [kg m2].
        prismatic: Which joints slide, (n,).
        continuous: Which joints turn without end, (n,).
        tip_rotation: Of the tip's frame in that of ``tip_joint``, (3, 3).
        tip_translation: Of the tip's frame in that of ``tip_joint``, (3,) [m].
        gravity: Along W, (3,) [m/s2].
        armature: Rotor inertia at the joint, (n,) [kg m2 or kg].
        viscous: Viscous friction at the joint, (n,) [N m s/rad or N s/m].
        coulomb: Coulomb friction at the joint, (n,) [N m or N].
        parent: The joint that each hangs on, lower than itself, -1 is the base, (n,); None is a serial arm.
        tip_joint: The joint that the tip moves with; None is the last.
        floating: How many joints from the first on have no motor.
        lead: The joint that each follows, itself where it mimics none, (n,); None is the latter for all.
        ratio: Of a joint's motion to that of its leader, (n,); 1 where it mimics none.
        offset: Where a joint is when its leader is at 0, (n,) [rad or m]; 0 where it mimics none.
    """
    chain, n = K.chain, len(mass)
    chain.n, chain.floating = n, floating
    _load_tree(
        chain, range(-1, n - 1) if parent is None else parent, n - 1 if tip_joint is None else tip_joint
    )
    chain.nq = n + int(np.count_nonzero(continuous))
    chain.has_inertia = bool(np.any(mass) or np.any(inertia))
    chain.rotation[:n] = np.reshape(rotation, (n, 9))
    chain.translation[:n] = translation
    chain.mass[:n] = mass
    chain.com[:n] = com
    upper = np.triu_indices(3)
    chain.inertia[:n] = np.asarray(inertia)[:, upper[0], upper[1]]
    chain.span[:n] = np.linalg.norm(translation, axis=1)
    chain.lever[:n] = np.linalg.norm(com, axis=1)
    chain.stoutness[:n] = np.abs(np.linalg.eigvalsh(inertia)).max(axis=1)
    chain.armature[:n] = armature
    chain.viscous[:n] = viscous
    chain.coulomb[:n] = coulomb
    chain.prismatic[:n] = prismatic
    chain.continuous[:n] = continuous
    chain.tip_rotation[:] = np.ravel(tip_rotation)
    chain.tip_translation[:] = tip_translation
    chain.gravity[:] = gravity
    chain.lead[:n] = np.arange(n) if lead is None else lead
    chain.ratio[:n], chain.offset[:n] = ratio, offset
    chain.mimics = int(np.count_nonzero(chain.lead[:n] != np.arange(n)))


def _load_tree(chain: Any, parent: Any, tip_joint: int) -> None:
    n = chain.n
    chain.parent[:n] = parent
    chain.tip_joint = tip_joint
    chain.branches[:] = 0
    for i in range(n):
        above = int(chain.parent[i])
        chain.ancestors[i] = np.uint64(1 << i).astype(np.int64)
        if above >= 0:
            chain.ancestors[i] |= chain.ancestors[above]
            chain.branches[above] |= above != i - 1
    chain.is_tree = any(chain.parent[i] != i - 1 for i in range(n)) or tip_joint != n - 1
