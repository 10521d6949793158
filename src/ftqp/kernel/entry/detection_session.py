"""The record of a detector beside that of its arm, and what is called on both."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.kernel.entry.session import Call, Session, bound, rooms
from ftqp.kernel.layout.detection_room import RESIDUALS
from ftqp.kernel.layout.enums import ToldDetector
from ftqp.kernel.layout.record import check_joints, dtype, load_chain

COLUMNS = ("q", "tau", "q_ref", "v_ref", "a_ref", "effort")
"""Of a log, in the order in which compiled code takes them."""
NO_END = 1 << 30
"""An answer that no tick gives."""


class DetectionSession:
    """A detector's record.

    Args:
        constants: Of the arm's chain, by the argument names of ``load_chain``.

    Attributes:
        memory: The record, (1,).
        D: Its fields, by attribute.
    """

    def __init__(self, constants: dict[str, Any]) -> None:
        joints = len(constants["mass"])
        check_joints(joints)
        self.memory, self._arm = np.zeros(1, dtype("detector")), np.zeros(1, dtype("arm"))
        load_chain(rooms(self._arm), **constants)
        self.D: Any = rooms(self.memory)
        self.D.n = joints
        self.D.has_inertia = int(rooms(self._arm).chain.has_inertia)

    def fit(self, constants: dict[str, Any]) -> None:
        """Count on another load or tool of the same arm, by the argument names of ``load_chain``."""
        load_chain(rooms(self._arm), **constants)

    def field(self, name: str) -> Any:
        """A field as an array that follows the record: (1,) for a number, else of the field's own shape."""
        view = self.memory[name]
        return view if view.ndim == 1 else view[0]

    def tell(self, what: ToldDetector, joint: int = -1) -> None:
        """Tell the detector something, of a joint where it is about one."""
        bound("tell_detector", self.memory)(joint, int(what))

    def detect(self) -> Call:
        """What takes (q, tau, q_ref, v_ref, a_ref, effort) of one tick."""
        return bound("detect", self.memory, self._arm)

    def watch(self, planner: Session) -> Call:
        """What looks on after a tick of a planner of the same arm; it is told where torques lie, or 0."""
        return bound("watch", planner.memory, self.memory, self._arm)

    def run(
        self,
        columns: Mapping[str, FloatArray | None],
        block: int,
        until: int = NO_END,
        first: int = 0,
        end: int | None = None,
    ) -> tuple[int, FloatArray, FloatArray]:
        """The rows of a log from ``first`` to ``end``, or up to an answer ``until``.

        Columns are (rows, n) or None, by the names of ``COLUMNS``.

        Returns:
            The rows done, the largest excess of each residual over every ``block`` rows,
            (rows // block, residuals, N), and z of every row, (rows,).
        """
        kept = [columns[name] for name in COLUMNS]
        rows = len(kept[0]) if kept[0] is not None else 0
        peaks = np.zeros((max(rows // block, 1), RESIDUALS, len(self.D.q)))
        trace, last = np.zeros(rows), rows if end is None else end
        things = (self.memory, self._arm, *kept, rows, first, last, block, peaks, trace, until)
        done = bound("detect_log", *things)()
        return done, peaks[: rows // block], trace

    def copy(self) -> "DetectionSession":
        """A session of its own that holds the same."""
        other = DetectionSession.__new__(DetectionSession)
        other.__setstate__(self.__getstate__())
        return other

    def __getstate__(self) -> dict[str, Any]:
        return {"memory": self.memory, "arm": self._arm}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.memory, self._arm = state["memory"].copy(), state["arm"].copy()
        self.D = rooms(self.memory)
