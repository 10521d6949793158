"""What each row of a planner's QP stands for: the kinds of rows, their order, their labels and units.

Packing for external solvers, labels of a recording, certificates and explanations read this table; the
compiled loops that fill the rows are in ``ftqp.kernel.rows``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")
"""The rows that a task can have, in the order of a twist."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RowKind:
    """Two-sided rows l <= C x <= u of one meaning; torque rows carry dt at the velocity level."""

    name: str  # What a row limits; its label is the name and the joint, or the name of what is kept
    unit: str  # The unit of what is limited, at a joint that turns
    sliding_unit: str  # The unit at a joint that slides
    symmetric: bool  # Limits of equal size on both sides of their middle; C x is shown less that
    needs_inertia: bool  # The rows need M or h, so that an arm without masses has none of them
    module: str = "row_blocks"  # The file in ``ftqp.kernel.rows`` that writes them ...
    fill: str = "fill"  # ... by this function of (K, at)
    most: int | None = None  # The most rows that a planner may ask for; None where there is one a joint
    seldom: bool = False  # The rows are there only while a joint has lost torque, behind those of every tick

    def label(self, joint: str) -> str:
        """The label of the row of a joint, for example ``torque panda_joint2``."""
        return f"{self.name} {joint}"

    @property
    def prefix(self) -> str:
        """What the labels of these rows begin with."""
        return f"{self.name} "

    def owners(self, joints: Sequence[str], has_inertia: bool, asked: "Asked") -> Sequence[str]:
        """What each row of this kind belongs to: joints, or what the planner asks for."""
        if self.most is not None:
            return asked.get(self.name, ())
        return joints if has_inertia or not self.needs_inertia else ()


def _kind(name: str, most: int, fill: str, *, unit: str = "m/s2", symmetric: bool = False) -> RowKind:
    """Rows that a planner may ask for, as many as ``most``."""
    return RowKind(
        name=name,
        unit=unit,
        sliding_unit=unit,
        symmetric=symmetric,
        needs_inertia=False,
        fill=fill,
        most=most,
    )


KEEPS = 8
"""The most planes and cones that a planner may keep to."""
HELD_ROWS = 12
"""The most rows of tasks that go before that of the tip: two poses."""
OWN_ROWS = 8
"""The most rows of the user's own."""
CLEARANCES = 16
"""The most pairs of bodies that are kept apart at once. All these are conventions, which size memory."""

TORQUE = RowKind(
    name="torque", unit="N m", sliding_unit="N", symmetric=True, needs_inertia=True, fill="fill_torques"
)
KEEP = _kind("keep", KEEPS, "fill_keeps")
HOLD = _kind("hold", HELD_ROWS, "fill_held", symmetric=True)
OWN_ROW = _kind("row", OWN_ROWS, "fill_own", unit="1")
CLEARANCE = _kind("clearance", CLEARANCES, "fill_clearances")
HOLDING = RowKind(
    name="holding torque",
    unit="rad/s2",
    sliding_unit="m/s2",
    symmetric=False,
    needs_inertia=True,
    module="holding_rows",
    seldom=True,
)
ROW_KINDS: tuple[RowKind, ...] = (TORQUE, KEEP, HOLD, OWN_ROW, CLEARANCE, HOLDING)
"""The kinds in the order in which their rows stand in C.

Torque rows are the first: that of joint i, which is an equality when the joint swings freely, is row i. Those
of clearance are the last, but for those of holding torque: both alone give way in every QP.
"""


Asked = Mapping[str, Sequence[str]]
"""Names of the rows that a planner asks for, by the name of their kind."""
NOTHING_ASKED: Asked = {}


def constraint_capacity(joints: int) -> int:
    """The most rows that C can have for so many joints."""
    return sum(joints if kind.most is None else kind.most for kind in ROW_KINDS)


def constraint_owners(
    joints: Sequence[str], has_inertia: bool, asked: Asked = NOTHING_ASKED
) -> tuple[tuple[RowKind, int, str], ...]:
    """Of each row of C its kind, its number in that kind, and what it belongs to."""
    return tuple(
        (kind, i, name)
        for kind in ROW_KINDS
        for i, name in enumerate(kind.owners(joints, has_inertia, asked))
    )


def constraint_labels(
    joints: Sequence[str], has_inertia: bool, asked: Asked = NOTHING_ASKED
) -> tuple[str, ...]:
    """Labels of the rows of C that are there in every tick, in their order."""
    owners = constraint_owners(joints, has_inertia, asked)
    return tuple(kind.label(name) for kind, _, name in owners if not kind.seldom)


def kind_of(label: str) -> RowKind | None:
    """The kind of the row with this label, or None if it is no label of a row of C."""
    return next((kind for kind in ROW_KINDS if label.startswith(kind.prefix)), None)
