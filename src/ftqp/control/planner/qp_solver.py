"""Who solves a planner's QP: the kernel's active set, its network, a closed form, or an external backend."""

from typing import Any, Final, final

import numpy as np

from ftqp.control.planner.stages import CLOCK, Stage, Tick
from ftqp.control.task.resolvers import Resolver
from ftqp.control.task.scheme import Scheme
from ftqp.control.task.task import Task
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.kernel.entry.session import Memory, Session
from ftqp.kernel.layout.enums import SOLVED, TASK_ROWS, ClosedForm, Level, Turn
from ftqp.kernel.layout.flat_arrays import OPTIONS, planner_memory_size
from ftqp.kernel.layout.rows import constraint_capacity
from ftqp.model.robot import Robot
from ftqp.qp.adapters.backend import Backend, QPBuffers

TOLERANCE = 1e-6
"""Largest distance of an axis from the common point [m] ..."""
PARALLEL = 1e-6
"""... and sine of the angle below which two axes count as parallel. A convention, so that numbers which a
file gives to six digits pass."""


def closed_form_memory(resolver: Resolver, robot: Robot, session: Session) -> Memory:
    """The memory in which a planner's closed form is solved."""
    name = resolver.name
    reduced = Memory("reduced")
    P = reduced.fields
    P.method, P.rule, P.threshold = resolver.method, resolver.rule_code, resolver.threshold
    if resolver.weights is not None:
        if len(resolver.weights) != robot.nv:
            raise InputError(
                f"scheme {name!r} has {len(resolver.weights)} weights, expected one a joint: {robot.nv}"
            )
        P.column[: robot.nv] = 1.0 / np.sqrt(resolver.weights)
    if resolver.method == ClosedForm.DAMPED and resolver.limit is None:
        endless = [j for j, v in zip(robot.joints, robot.limits.v_max, strict=True) if not np.isfinite(v)]
        if endless:
            raise InputError(
                f"{robot.name} has no velocity limit on {', '.join(endless)}; give {name}(limit=...)"
            )
        P.own_limits = 1
    elif resolver.limit is not None:
        P.limit = resolver.limit
    if resolver.method == ClosedForm.APPROXIMATE:
        if session.K.task.m != TASK_ROWS or session.K.task.tool_rows:
            raise InputError(f"scheme {name!r} follows whole poses; use Task(rows='pose')")
        P.wrist = wrist_height(robot)
    return reduced


def wrist_height(robot: Robot) -> float:
    """Where the wrist centre lies on the axis of the last joint but one, from its origin [m]."""
    robot.refuse_tree("approximate_pseudoinverse needs")
    chain = robot.chain
    reason = ""
    if robot.nv < 4:
        reason = f"it has {robot.nv} joints"
    elif chain.prismatic[-3:].any():
        reason = "one of them slides"
    else:
        along, at = chain.rotation[-1][:, 2], chain.translation[-1]  # the last axis in the middle frame
        across = float(along[0] ** 2 + along[1] ** 2)
        turn, shift = chain.rotation[-2], chain.translation[-2]
        if across < PARALLEL**2 or float(np.hypot(turn[0, 2], turn[1, 2])) < PARALLEL:
            reason = "two of their axes are parallel"
        else:
            near = at - along * float(along[0] * at[0] + along[1] * at[1]) / across
            centre = shift + turn @ np.array([0.0, 0.0, near[2]])
            if max(float(np.hypot(near[0], near[1])), float(np.hypot(centre[0], centre[1]))) <= TOLERANCE:
                return float(near[2])
            reason = "their axes do not meet in one point"
    raise InputError(
        f"approximate_pseudoinverse needs a spherical wrist, but the last three joints of {robot.name} form "
        f"none: {reason}; use pseudoinverse or singularity_robust"
    )


NETWORK: Final = "dtrnn"
"""The backend that takes the place of the active set in the kernel."""
MARGIN = 10.0
"""Largest scaled residual that counts as solved, in tolerances of the network."""


def network_memory(solver: Any, session: Session) -> FloatArray:
    """The memory of the network that solves a planner's QPs, (k,), its options filled in."""
    K = session.K
    n, m = int(K.chain.n), int(K.task.m)
    memory = np.zeros(planner_memory_size(n + 1, m, constraint_capacity(n)))
    memory[:OPTIONS] = solver.numbers[:OPTIONS]
    K.cascade.external = 1
    K.cascade.accept = max(float(K.cascade.accept), MARGIN * solver.settings.accuracy)
    return memory


IN_KERNEL: Final = "active_set"


@final
class Solver:
    """One way to solve the QPs of one planner, whoever leads it."""

    def __init__(
        self,
        session: Session,
        robot: Robot,
        task: Task,
        scheme: Scheme | Resolver,
        backend: Backend | None,
        adds_terms: bool,
    ) -> None:
        self._session = session
        K = session.K
        self._cold = True
        self._backend: Backend | None = None
        self._memory: tuple[Any, ...] = ()
        self._family = "step"
        if isinstance(scheme, Resolver):
            self._family = "closed_form"
            K.settling.on = 0  # a closed form has a way of its own with singularities
            self._reduced = closed_form_memory(scheme, robot, session)
            self._memory = (self._reduced.memory,)
        elif backend is not None and backend.name == NETWORK:
            self._family = "network"
            memory = network_memory(backend, session)
            self._memory = (memory, len(memory))
        elif backend is not None and backend.name != IN_KERNEL:
            self._family = "external"
            criterion = scheme.at(Level(int(K.state.level)).name.lower())
            fixed = criterion.has_constant_hessian and task.mode != "scaled" and not adds_terms
            joints, m = robot.nv, int(K.task.m)
            n = joints + (task.mode == "scaled") + (0 if task.mode == "hard" else m)
            self._buffers = QPBuffers.zeros(n, m, int(K.cascade.p), constant_hessian=fixed)
            if fixed:
                self._buffers.H[:] = criterion.norm * np.eye(n)
                self._buffers.H[:joints, :joints] *= K.criteria.weight[:joints]
            backend.setup(self._buffers)
            self._backend = backend
            K.cascade.external = 1

    @property
    def stage(self) -> Stage:
        """Its part in a planner's life."""
        return Stage(begin=lambda *_: self.forget(), believe=lambda _: self.forget())

    @property
    def has_qp(self) -> bool:
        """Whether there is a QP, with rows and limits, and not a closed form."""
        return self._family != "closed_form"

    @property
    def sizes_may_change(self) -> bool:
        """Whether rows may be left out from one tick to the next: no foreign memory is laid out for them."""
        return self._family == "step"

    def forget(self) -> None:
        """The next solve begins cold."""
        self._cold = True

    @property
    def is_compiled(self) -> bool:
        """Whether Python has no part in a tick."""
        return self._family != "external"

    def tick(self, leader: str, *memory: Any) -> Tick:
        """A tick led by CLOCK or one of LED: from its inputs to a status or mistake."""
        session, family = self._session, self._family
        if family != "external" or leader == "joints":
            name = self._entry(leader)
            own = () if leader == "joints" else self._memory
            return session.bind(name, *own, *memory)
        prepare = session.bind(f"prepare_{leader}", self._buffers.flat, *memory)
        finish = session.bind(f"finish_{leader}", *memory[:1], self._buffers.solution)

        def tick(*inputs: Any) -> int:
            code = prepare(*inputs)
            return self._solved(finish) if code == Turn.QP_READY else code

        return tick

    def _entry(self, leader: str) -> str:
        if self._family != "step" and leader != "joints":
            return f"{self._family}_{leader}"
        return "step" if leader == CLOCK else f"step_{leader}"

    def _solved(self, finish: Tick) -> int:
        """The second half of a tick: the external solver runs, its answer becomes the command."""
        backend = self._backend
        assert backend is not None
        claim = backend.solve(cold=self._cold)
        self._cold = claim != SOLVED
        return finish(int(claim), int(backend.iterations))
