"""Ways in for whoever leads a planner in place of the clock, and many ticks at once in closed loop."""

from collections.abc import Callable
from typing import Any, final

import numpy as np

from ftqp.control.planner.step import Step
from ftqp.control.planner.step_parts import StepHeader
from ftqp.core.checks import BoolArray, FloatArray, IntArray
from ftqp.core.pose import rotation_exp, rotation_vector
from ftqp.kernel.entry.session import Memory, Session
from ftqp.kernel.layout.enums import BRAKING, HEALTHY, LAGGING, LOCKED, OK, RELAXED, TARGET_POSE
from ftqp.kernel.layout.thresholds import STILL_SAMPLES
from ftqp.model.robot import Robot


def with_error_to(K: Any, said: StepHeader, step: Step, meant: FloatArray) -> Step:
    """The step, with errors to another pose, and a status that is no ``OK`` where that is far."""
    task, rows = K.task, K.task.rows[: K.task.m]
    led = np.array(task.target[TARGET_POSE : TARGET_POSE + 16]).reshape(4, 4)
    seen = np.array(task.seen)  # from the measured tip to where the motion has it
    task.seen[:3] = meant[:3, 3] - led[:3, 3] + seen[:3]
    task.seen[3:] = rotation_vector(meant[:3, :3] @ led[:3, :3].T @ rotation_exp(seen[3:]))
    task.position_error = float(np.linalg.norm(task.seen[rows[rows < 3]]))
    task.rotation_error = float(np.linalg.norm(task.seen[rows[rows > 2]]))
    far = task.position_error > K.feedback.tolerance or task.rotation_error > K.feedback.rotation_tolerance
    if far and step.code in (OK, RELAXED):
        said.code = LAGGING
    return step


@final
class Lead:
    """Ticks of one planner that somebody else leads: nothing of the planner is changed by them but its state.

    Attributes:
        step: Makes a tick: (q, v, target as a tuple of what is left of the entry's arguments, tau, tip).
        memory: The leader's own memory.
        give_up: Gives up the next set of rows of the task; False where no more may be.
    """

    def __init__(
        self,
        step: Callable[[Any, Any, tuple[Any, ...], Any, Any], Step],
        session: Session,
        memory: Memory,
        give_up: Callable[[], bool],
    ) -> None:
        self.step, self.give_up = step, give_up
        self.memory = memory
        self._session = session

    @property
    def given_up(self) -> int:
        """How many sets of rows the task has been reduced by."""
        return int(self._session.K.task.given_up)

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
        return np.array(K.state.q[: K.chain.n])

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


@final
class Blocks:
    """Ticks of one planner led by the clock, run in compiled code; each is what ``Planner.step`` does."""

    def __init__(self, session: Session, tick: Callable[..., int], robot: Robot) -> None:
        n = robot.nv
        self._K = session.K
        self._state = np.zeros(2 * n)
        self._q, self._v = self._state[:n], self._state[n:]
        self._tick, self._inertia = tick, int(robot.has_inertia)
        self._block = session.bind("block")

    @property
    def q(self) -> FloatArray:
        """Joint positions after the last block, (nv,) [rad or m]; belongs to this object."""
        return self._q

    @property
    def v(self) -> FloatArray:
        """Joint velocities after the last block, (nv,) [rad/s or m/s]; belongs to this object."""
        return self._v

    def run(
        self, q: FloatArray, v: FloatArray, targets: FloatArray, rows: FloatArray, places: IntArray
    ) -> int:
        """Make a tick for each target: how many were made, fewer where a step would have raised.

        None is made while the planner takes a failed joint to be elsewhere than it is, or does not know yet
        that it stands: that joint does not do what it is told.
        """
        if self._K.faults.working < len(q) and not self._is_settled():
            return 0
        self._q[:], self._v[:] = q, v
        packed = np.ascontiguousarray(targets)
        return self._block(
            self._tick,
            self._q,
            self._v,
            packed,
            self._state.ctypes.data,
            0,
            len(packed),
            self._inertia,
            rows.ctypes.data,
            rows.shape[1],
            places.ctypes.data,
        )

    def _is_settled(self) -> bool:
        """Whether the planner's failed joints are where they are measured, and known to stand if locked."""
        feedback, code = self._K.feedback, self._K.faults.code
        if not feedback.active:
            return True
        known = np.all(feedback.still[code == LOCKED] >= STILL_SAMPLES) and not np.any(code == BRAKING)
        return bool(feedback.exact and known)
