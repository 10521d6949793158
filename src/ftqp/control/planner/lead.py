"""Steps of a planner: those of the clock, of whoever leads in its place, and many at once in closed loop."""

from collections.abc import Callable, Mapping
from typing import Any, final

import numpy as np

from ftqp.control.planner.assembly import Assembly
from ftqp.control.planner.given_arrays import (
    converted_tick,
    is_row,
    made_up_for,
    measured_tick,
    mistake,
    not_a_target,
    whole_ticks,
)
from ftqp.control.planner.stages import Tick
from ftqp.control.planner.step import Step
from ftqp.control.planner.step_parts import StepHeader
from ftqp.control.planner.target import Target, Targets
from ftqp.core.checks import BoolArray, FloatArray, IntArray
from ftqp.core.clock import now
from ftqp.core.pose import rotation_exp, rotation_vector
from ftqp.kernel.entry.session import Memory
from ftqp.kernel.layout.enums import HEALTHY, LAGGING, NEWS, OK, RELAXED, TARGET_POSE


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
class Ticks:
    """Steps of one planner, whoever leads them, of what a caller hands in."""

    def __init__(self, parts: Assembly) -> None:
        self._parts, self._timing = parts, parts.given.timing
        self.at_rest = np.zeros(parts.given.robot.nv)

    def target(self, given: Any, more: object = None) -> tuple[Any, int]:
        """The packed target of a step, and its row; ``more`` is what stands behind it."""
        if isinstance(given, Mapping):
            given = self._parts.tasks.distributed(given)
        if more is not None or not isinstance(given, Target | Targets) or not is_row(given.row):
            raise not_a_target(given, more)
        return given.packed, given.row

    def make(
        self, tick: Tick | None, q: Any, v: Any, target: tuple[Any, ...], tau: Any, tip: Any,
        path: Memory | None = None, ticks: int = 1,
    ) -> Step:  # fmt: skip
        """A step of any leader, None the clock, with measured torques or tip, converted arrays and times."""
        parts, at_rest = self._parts, self.at_rest
        # a joint that swings freely leads in the place of a path, which stands
        if path is not None and parts.free is not None and parts.free.leads:
            held = parts.free.held_target(path)
            if held is not None:
                tick, target = None, (held, 0)
        tick = parts.tick if tick is None else tick
        began = now() if self._timing else 0
        v = at_rest if v is None else v
        if ticks != 1:
            made_up_for(parts.commands, tick, target, whole_ticks(ticks), at_rest)
        if tau is None and tip is None:
            code = converted_tick(tick, q, v, target)
        else:
            code = measured_tick(parts.session, tick, q, v, target, tau, tip)
        if code < 0:
            raise mistake(code, q, v, parts.given.robot.nv, parts.given.robot.nq)
        if code >= NEWS:
            code = self.respond(code)
        parts.said.code = code
        if code == RELAXED or parts.rest.held:
            parts.rest.tell(parts.out)
        if self._timing:
            parts.said.duration = (now() - began) * 1e-9
        return parts.out

    def respond(self, code: int) -> int:
        """Act upon what the monitor has found in a tick: the tick's status."""
        if self._parts.response is not None:
            self._parts.response.respond()
        return code - NEWS


@final
class Lead:
    """Ticks of one planner that somebody else leads, the tip ``meant`` to be somewhere, or as led."""

    def __init__(
        self, make: Callable[..., Step], parts: Assembly, leader: Memory, meant: FloatArray | None
    ) -> None:
        self._make, self._tick, self.memory, self._meant = make, parts.led_tick(leader), leader, meant
        self.give_up: Callable[[], bool] = parts.commands.give_up  # the next set of rows, if one may be
        self._path = leader if leader.kind == "path" else None
        self._session, self._said = parts.session, parts.said

    def step(self, q: Any, v: Any, target: tuple[Any, ...], tau: Any, tip: Any) -> Step:
        """Make a tick; ``target`` is what is left of the entry's arguments."""
        out = self._make(self._tick, q, v, target, tau, tip, self._path)
        return out if self._meant is None else with_error_to(self._session.K, self._said, out, self._meant)

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
