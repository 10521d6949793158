"""What each row of a planner's QP stands for: the kinds of rows, their order, their labels and units.

Packing for external solvers, labels of a recording, certificates and explanations read this table; the
compiled loops that fill the rows are in ``ftqp.kernel.rows``, one file a kind.
"""

from collections.abc import Sequence
from dataclasses import dataclass

COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")
"""The rows that a task can have, in the order of a twist."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RowKind:
    """Two-sided rows l <= C x <= u of one meaning; torque rows carry dt at the velocity level.

    Attributes:
        name: What a row limits; its label is the name and the joint, or the name of what is kept.
        unit: The unit of what is limited, at a joint that turns.
        sliding_unit: The unit at a joint that slides.
        symmetric: Whether what is limited has limits of equal size on both sides; it is then C x minus the
            middle of l and u, and is shown so.
        needs_inertia: Whether the rows need M or h, so that an arm without masses has none of them.
        module: The file in ``ftqp.kernel.rows`` whose ``fill(K, at)`` writes them.
        per_joint: Whether there is one row a joint; otherwise there are as many as a planner asks for.
    """

    name: str
    unit: str
    sliding_unit: str
    symmetric: bool
    needs_inertia: bool
    module: str
    per_joint: bool = True

    def label(self, joint: str) -> str:
        """The label of the row of a joint, for example ``torque panda_joint2``."""
        return f"{self.name} {joint}"

    @property
    def prefix(self) -> str:
        """What the labels of these rows begin with."""
        return f"{self.name} "

    def count(self, joints: int, has_inertia: bool, keeps: int = 0) -> int:
        """How many rows of this kind an arm of so many joints has, whose planner keeps so many points."""
        if not self.per_joint:
            return keeps
        return joints if has_inertia or not self.needs_inertia else 0


TORQUE = RowKind(
    name="torque",
    unit="N m",
    sliding_unit="N",
    symmetric=True,
    needs_inertia=True,
    module="torque_rows",
)

KEEPS = 8
"""The most points that a planner may keep on their side of a plane. A convention, which sizes memory."""
KEEP = RowKind(
    name="keep",
    unit="m/s2",
    sliding_unit="m/s2",
    symmetric=False,
    needs_inertia=False,
    module="keep_rows",
    per_joint=False,
)

ROW_KINDS: tuple[RowKind, ...] = (TORQUE, KEEP)
"""The kinds in the order in which their rows stand in C.

Torque rows are the first: that of joint i, which is an equality when the joint swings freely, is row i.
"""


def constraint_capacity(joints: int) -> int:
    """The most rows that C can have for so many joints."""
    return constraint_count(joints, True, KEEPS)


def constraint_count(joints: int, has_inertia: bool, keeps: int = 0) -> int:
    """How many rows C has, all kinds together."""
    return sum(kind.count(joints, has_inertia, keeps) for kind in ROW_KINDS)


def constraint_labels(joints: Sequence[str], has_inertia: bool, keeps: Sequence[str] = ()) -> tuple[str, ...]:
    """Labels of the rows of C, in their order."""
    return tuple(
        kind.label(of)
        for kind in ROW_KINDS
        for of in (joints if kind.per_joint else keeps)
        if kind.count(len(joints), has_inertia, len(keeps))
    )


def constraint_owner(row: int, joints: int, has_inertia: bool) -> tuple[RowKind, int]:
    """The kind of a row of C, and the joint, or which of what is kept."""
    for kind in ROW_KINDS[:-1]:
        count = kind.count(joints, has_inertia)
        if row < count:
            return kind, row
        row -= count
    return ROW_KINDS[-1], row


def kind_of(label: str) -> RowKind | None:
    """The kind of the row with this label, or None if it is no label of a row of C."""
    return next((kind for kind in ROW_KINDS if label.startswith(kind.prefix)), None)
