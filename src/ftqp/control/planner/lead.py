"""Lead: the way in for whoever leads a planner in place of the clock."""

from collections.abc import Callable
from typing import Any, final

from ftqp.control.planner.step import Step
from ftqp.core.checks import BoolArray, FloatArray, IntArray
from ftqp.kernel.entry.session import BaseMemory, JointsMemory, PathMemory, Session
from ftqp.kernel.layout.enums import HEALTHY


@final
class Lead:
    """Ticks of one planner that somebody else leads: nothing of the planner is changed by them but its state.

    Attributes:
        step: Makes a tick: (q, v, target as a tuple of what is left of the entry's arguments, tau, tip).
        memory: The leader's own memory.
    """

    def __init__(
        self,
        step: Callable[[Any, Any, tuple[Any, ...], Any, Any], Step],
        session: Session,
        memory: PathMemory | BaseMemory | JointsMemory,
    ) -> None:
        self.step = step
        self.memory = memory
        self._session = session

    @property
    def uses_rotation(self) -> bool:
        """Whether the task has rotation rows."""
        return bool(self._session.K.task.uses_rotation)

    @property
    def length(self) -> float:
        """The characteristic length [m]."""
        return float(self._session.K.task.length)

    @property
    def q(self) -> FloatArray:
        """The joint positions of the last reset or tick, (nv,) [rad or m]; a copy."""
        K = self._session.K
        result: FloatArray = K.state.q[: K.chain.n].copy()
        return result

    @property
    def working(self) -> BoolArray:
        """Which joints work, as believed, (nv,)."""
        K = self._session.K
        result: BoolArray = K.faults.code[: K.chain.n] == HEALTHY
        return result

    def rows(self) -> tuple[IntArray, FloatArray, FloatArray]:
        """The task of the last tick: components (m,), their scale (m,), and rows over the joints (m, nv)."""
        K = self._session.K
        m, n = int(K.task.m), int(K.chain.n)
        components = K.task.rows[:m].copy()
        return components, K.task.row_scale[components].copy(), K.qp.A[:m, :n].copy()
