"""Records: types of all that compiled code reads in place, by name, and that of one planner.

A helper is handed the rooms that it reads and writes, so that its signature says so; stages of a tick, which
touch more of them, take the whole record K. A solver gets ``K.qp`` and nothing else.
"""

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from ftqp.core.errors import InputError
from ftqp.kernel.layout.detection_room import DETECTOR
from ftqp.kernel.layout.enums import JOINTS, TASK_ROWS
from ftqp.kernel.layout.other_records import CONSTRAINTS, OTHERS, VARIABLES
from ftqp.kernel.layout.other_records import ROWS as EQUALITIES
from ftqp.kernel.layout.rooms import ROOMS, qp_fields
from ftqp.kernel.layout.rows import CLEARANCES
from ftqp.kernel.layout.structures import structure

OF_ROOMS = {
    "record": tuple(ROOMS),
    "arm": ("state", "kinematics", "chain"),
    "belief": ("faults", "limits"),
}
"""Records of rooms that begin lines of the cache: a planner's, that of an arm without a planner, and the
rooms that faults are written into."""
KINDS = (*OF_ROOMS, *OTHERS, *DETECTOR)
"""All records by name."""
LINE = 64
"""Bytes of a line of the cache, and of the widest register that is loaded at once."""


def check_joints(joints: int) -> None:
    """Refuse an arm of more joints than a record holds."""
    if joints > JOINTS:
        raise InputError(f"the arm has {joints} joints, expected at most {JOINTS}")


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


def zeros_in_line(kind: np.dtype[Any]) -> Any:
    """Zeros of a type, (1,), that begin a line of the cache; the system maps only what is then written to."""
    room = np.zeros(kind.itemsize + LINE, np.uint8)
    begin = -room.ctypes.data % LINE
    return room[begin : begin + kind.itemsize].view(kind)


def in_line(memory: Any) -> Any:
    """A copy of (1,) that begins a line of the cache."""
    copy = zeros_in_line(memory.dtype)
    copy.view(np.uint8)[:] = memory.view(np.uint8)  # as bytes, not field by field
    return copy


@cache
def dtype(kind: str, joints: int = JOINTS) -> np.dtype[Any]:
    """The type of a record by its name, with room for so many joints."""
    if kind in OF_ROOMS:
        return _on_lines([(name, _on_lines(ROOMS[name](joints))) for name in OF_ROOMS[kind]])
    fields = (DETECTOR if kind in DETECTOR else OTHERS)[kind](joints)
    if kind == "study":  # its own room first: numba takes a record that begins as another one for that
        rooms = {name: structure(ROOMS[name](joints)) for name in (*OF_ROOMS["arm"], "ahead", "scene")}
        fields = [("study", structure(fields)), *rooms.items()]
    elif kind == "continuation":
        fields.append(("qp", structure(qp_fields(joints, TASK_ROWS, CLEARANCES))))
    elif kind == "standalone":
        fields = [*qp_fields(VARIABLES, EQUALITIES, CONSTRAINTS), *fields]
    return structure(fields)


def memory(kind: str) -> Any:
    """One record, (1,), of zeros; that of a reduced problem with unscaled unknowns."""
    made = zeros_in_line(dtype(kind))
    if kind == "reduced":
        made["column"] = 1.0
    return made


def record(joints: int = JOINTS) -> Any:
    """One planner's record, (1,), zero but for ``yielding``; no joint swings freely."""
    W = zeros_in_line(dtype("record", joints))
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
