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
    """Two-sided rows l <= C x <= u of one meaning, one row a joint.

    Attributes:
        name: What a row limits; its label is the name and the joint.
        unit: Of l, u and C x at the acceleration level; times s at the velocity level.
        needs_inertia: Whether an arm without masses has no such rows.
        module: The file in ``ftqp.kernel.rows`` whose ``fill(K, at)`` writes them.
    """

    name: str
    unit: str
    needs_inertia: bool
    module: str

    def label(self, joint: str) -> str:
        """The label of the row of a joint, for example ``torque panda_joint2``."""
        return f"{self.name} {joint}"

    @property
    def prefix(self) -> str:
        """What the labels of these rows begin with."""
        return f"{self.name} "

    def count(self, joints: int, has_inertia: bool) -> int:
        """How many rows of this kind an arm of so many joints has."""
        return joints if has_inertia or not self.needs_inertia else 0


TORQUE = RowKind(name="torque", unit="N m", needs_inertia=True, module="torque_rows")

ROW_KINDS: tuple[RowKind, ...] = (TORQUE,)
"""The kinds in the order in which their rows stand in C."""


def constraint_capacity(joints: int) -> int:
    """The most rows that C can have for so many joints."""
    return sum(kind.count(joints, True) for kind in ROW_KINDS)


def constraint_count(joints: int, has_inertia: bool) -> int:
    """How many rows C has in an external solver's QP, all kinds together."""
    return sum(kind.count(joints, has_inertia) for kind in ROW_KINDS)


def constraint_labels(joints: Sequence[str], has_inertia: bool) -> tuple[str, ...]:
    """Labels of the rows of C, in their order."""
    return tuple(
        kind.label(joint) for kind in ROW_KINDS if kind.count(len(joints), has_inertia) for joint in joints
    )


def constraint_owner(row: int, joints: int) -> tuple[RowKind, int]:
    """The kind and the joint of a row of C."""
    return ROW_KINDS[row // joints], row % joints
