"""Planner: one arm, one task, one QP a tick."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from ftqp.control.first_use import warm_up
from ftqp.control.planner.braking_reserve import BrakingReserve
from ftqp.control.planner.closed_form_memory import closed_form_memory
from ftqp.control.planner.filling import LEVELS, filled
from ftqp.control.planner.inputs import not_a_target, sized, vector
from ftqp.control.planner.network_memory import NETWORK, network_memory
from ftqp.control.planner.step import Step
from ftqp.control.planner.target import Target, Targets
from ftqp.control.task import bounds as bound_conversions
from ftqp.control.task import schemes
from ftqp.control.task.bounds import Bounds
from ftqp.control.task.emergency import EmergencyStop
from ftqp.control.task.resolvers import Resolver
from ftqp.control.task.scheme import Scheme
from ftqp.control.task.task import Task
from ftqp.core.checks import array, positive
from ftqp.core.clock import now
from ftqp.core.errors import InputError, ModelError, nearest
from ftqp.faults.belief import Belief
from ftqp.faults.kinds import Fault
from ftqp.kernel.entry import entries as entry
from ftqp.kernel.entry.compile import fast_call
from ftqp.kernel.layout import enums as codes
from ftqp.model.branch import within_branch
from ftqp.model.robot import Robot
from ftqp.qp.adapters.backend import Backend
from ftqp.qp.adapters.buffers import QPBuffers
from ftqp.qp.adapters.registry import backend as make_backend

IN_KERNEL = "active_set"


class Planner:
    """Redundancy resolution, one QP a tick, with failed joints as bounds.

    Args:
        robot: the arm; at most 32 joints, finite acceleration limits.
        dt: sampling period [s].
        level: ``acceleration`` or ``velocity``, what the QP decides.
        scheme: what to do with the redundancy: an ``ftqp.schemes`` recipe, its name or {name = ..., ...};
            None is ``mvn``.
        task: which rows, mode and gains; None is ``Task()``.
        bounds: ``viability``, ``jin`` or ``one_step``, or an object of ``ftqp.bounds``.
        backend: ``active_set``, ``dtrnn`` (both run in the kernel), or any name, table, profile file or
            object that ``ftqp.qp.backend`` takes.
        posture: rest posture of ``rmp`` and ``dlsm``, (nv,) [rad or m]; None is that given to ``reset``.
        torque_limits: keep torque limits as rows of the QP; ignored without inertia or torque limits.
        emergency: when to stop; None never does.
        timing: measure every step (``step.qp.time``).
        branch_limits: joint to (low, high) [rad or m], a range inside its own that keeps the arm on one side.

    Raises:
        InputError: a parameter is wrong.
        ModelError: the robot cannot be driven safely.
    """

    def __init__(
        self,
        robot: Robot,
        dt: float = 1e-3,
        *,
        level: str = "acceleration",
        scheme: Scheme | Resolver | str | Mapping[str, Any] | None = None,
        task: Task | None = None,
        bounds: Bounds | str | Mapping[str, Any] = "viability",
        backend: str | Path | Mapping[str, Any] | Backend = IN_KERNEL,
        posture: Any = None,
        torque_limits: bool = True,
        emergency: EmergencyStop | None = EmergencyStop(),  # noqa: B008  frozen
        timing: bool = False,
        branch_limits: Mapping[str | int, Any] | None = None,
    ) -> None:
        if level not in LEVELS:
            raise InputError(
                f"level is {level!r}{nearest(str(level), LEVELS)}, expected one of {', '.join(LEVELS)}"
            )
        if robot.nv > codes.JOINTS:
            raise ModelError(
                f"{robot.name} has {robot.nv} joints between base and tip; ftqp drives at most {codes.JOINTS}"
            )
        endless = [j for j, a in zip(robot.joints, robot.limits.a_max, strict=True) if not np.isfinite(a)]
        if endless:
            raise ModelError(
                f"{robot.name} has no acceleration limit on {', '.join(endless)}; braking needs one: "
                "robot.with_limits(a_max=...)"
            )
        robot = robot if branch_limits is None else within_branch(robot, branch_limits)
        self.robot = robot
        self.dt = positive("dt", dt, "s")
        self.level = level
        self.task = Task() if task is None else task
        self.scheme = schemes.by_name(scheme)
        self.bounds = bound_conversions.by_name(bounds)
        self.emergency = emergency
        self.posture = None if posture is None else array("posture", posture, (robot.nv,), "(nv,)")
        limited = bool(np.isfinite(robot.limits.tau_max).any())
        self._rows_every_tick = torque_limits and robot.has_inertia and limited
        criterion = self.scheme.at(level)
        if criterion.needs_inertia and not robot.has_inertia:
            raise InputError(
                f"scheme {self.scheme.name!r} needs inertia, which {robot.name} has not; use mvn, man or rmp"
            )
        self._needs_inertia = criterion.needs_inertia
        solver = None if isinstance(backend, str) and backend == IN_KERNEL else make_backend(backend)
        external = None if solver is None or solver.name in (IN_KERNEL, NETWORK) else solver
        network = solver.name == NETWORK if solver is not None else False
        self._name = IN_KERNEL if solver is None else solver.name
        self._guarded = (
            self._name == IN_KERNEL
            and level == "velocity"
            and not criterion.needs_inertia
            and self.task.mode != "lexicographic"
        )
        self._record = filled(robot, self.task, criterion, self.bounds, emergency, level=level, dt=self.dt)
        self._closed_form = closed_form_memory(
            self.scheme, robot, self.task, self._name == IN_KERNEL, self._record
        )
        closed_form = self._closed_form is not None
        warm_up(external=external is not None, network=network, closed_form=closed_form, base=False)
        self._address: int = self._record.ctypes.data
        self._belief = Belief(robot, self._record)
        self._reserve = BrakingReserve(self._record, robot.nv) if self._rows_every_tick else None
        self._adopt_belief()
        self._out = Step(self._record, robot.joints)
        self._timing = timing
        self._buffers: QPBuffers | None = None
        self._backend: Backend | None = None
        if external is not None:
            self._use_backend(external)
        if network:
            self._memory = network_memory(solver, self._record)
        self._cold = True
        self._entry = fast_call("step_dtrnn" if network else "step_closed_form" if closed_form else "step")
        self._take_inputs()

    def _use_backend(self, backend: Backend) -> None:
        self._backend = backend
        n, m, p = self.robot.nv, int(self._record["m"][0]), int(self._record["p"][0])
        n += (self.task.mode == "scaled") + (0 if self.task.mode == "hard" else m)
        fixed = not self._needs_inertia and self.task.mode != "scaled"
        self._buffers = QPBuffers.zeros(n, m, p, constant_hessian=fixed)
        if fixed:
            joints = self.robot.nv
            self._buffers.H[:] = float(self._record["w_norm"][0]) * np.eye(n)
            self._buffers.H[:joints, :joints] *= self._record["weight"][0, :joints]
        backend.setup(self._buffers)
        self._record["external"] = 1

    def _take_inputs(self) -> None:
        """Where the compiled step reads q and v: the caller's arrays once they recur, else copies."""
        nv, nq = self.robot.nv, self.robot.nq
        self._q_copy, self._v_copy = np.zeros(nq), np.zeros(nv)
        self._q_views = {size: memoryview(self._q_copy[:size]) for size in (nv, nq)}  # type: ignore[arg-type]
        self._v_view = memoryview(self._v_copy)  # type: ignore[arg-type]
        self._q_copy_at, self._v_copy_at = self._q_copy.ctypes.data, self._v_copy.ctypes.data
        self._q_last: Any = None
        self._v_last: Any = None
        self._seen: tuple[Any, ...] = (object(), object(), *(None,) * 6)  # nothing is these two
        self._plain = self._backend is None and not self._timing

    @property
    def record(self) -> Any:
        """The kernel's record, (1,): for what is built around a planner in ``ftqp.control``."""
        return self._record

    @property
    def backend(self) -> str:
        """Name of the solver."""
        return self._name

    @property
    def tick(self) -> int:
        """Number of the step, from 0 at the first one after ``reset``; -1 before it."""
        return int(self._record["ticks"][0]) - 1

    @property
    def faults(self) -> dict[str, Fault]:
        """The faults believed now, by joint name."""
        return self._belief.faults

    def reset(self, q: Any, v: Any = None) -> None:
        """Begin at (q, v): the latch of a stop, warm starts and the last command are forgotten, not faults.

        Args:
            q: measured configuration, (nv,) joint values or (nq,) [rad or m].
            v: measured velocity, (nv,) [rad/s or m/s]; None is rest.

        Raises:
            InputError: wrong shape or not finite.
        """
        K, n = self._record, self.robot.nv
        q = self.robot.angles(q)
        K["q_command"][0, :n] = K["q"][0, :n] = q
        v = np.zeros(n) if v is None else array("v", v, (n,), "(nv,)")
        K["v_command"][0, :n] = K["v"][0, :n] = v
        K["a_command"] = 0.0
        K["posture"][0, :n] = q if self.posture is None else self.posture
        K["latched"] = K["rising"] = K["fallbacks"] = K["warm"] = K["ticks"] = 0
        K["last_position_error"] = K["last_rotation_error"] = np.inf
        K["is_reset"] = 1
        self._cold = True

    def step(self, q: Any, v: Any, target: Target | Targets, *, tau: Any = None, tip: Any = None) -> Step:
        """The command for the next ``dt``.

        Args:
            q: measured configuration, (nv,) joint values or (nq,) [rad or m].
            v: measured velocity, (nv,) [rad/s or m/s].
            target: where the tip should be now; or ``targets.at(k)`` of a whole trajectory.
            tau: measured torque, (nv,) [N m or N]; checked to be finite.
            tip: measured pose of the tip, (4, 4), in place of the one of forward kinematics.

        Returns:
            The planner's own step, valid until the next one.

        Raises:
            InputError: a wrong shape or type, a position target for a task with rotation rows, or no
                ``reset`` before. What the world does (NaN, an infeasible task, a failing solver) never
                raises: see ``step.status``.
        """
        seen_q, seen_v, call, address, q_at, v_at, nv, out = self._seen
        if q is seen_q and v is seen_v and tau is None and tip is None:
            try:
                code = call(address, q_at, v_at, target.address, nv)
            except AttributeError as error:
                raise not_a_target(target) from error
            if code < 0:
                self._mistake(code, q, v)
            out.code = code
            return out  # type: ignore[no-any-return]
        return self._first_seen(q, v, target, tau, tip)

    def _first_seen(self, q: Any, v: Any, target: Target | Targets, tau: Any, tip: Any) -> Step:
        """The same for other arrays than the last, other types, measured torques or tip, and backends."""
        if not isinstance(target, Target | Targets):
            raise not_a_target(target)
        began = now() if self._timing else 0
        try:
            nq = len(q)
            self._q_views[nq][:] = q
            self._v_view[:] = v
        except (TypeError, ValueError, KeyError, BufferError):
            nq = self._converted(q, v)
        if self._plain and tau is None and tip is None:
            code: int = self._entry(self._address, self._q_copy_at, self._v_copy_at, target.address, nq)
            if q is self._q_last and v is self._v_last:
                self._adopt(q, v)
            self._q_last, self._v_last = q, v
        else:
            code = self._full_step(nq, target, tau, tip)
        if code < 0:
            self._mistake(code, q, v)
        out = self._out
        out.code = code
        if self._timing:
            out.duration = (now() - began) * 1e-9
        return out

    def _converted(self, q: Any, v: Any) -> int:
        """Lists, other dtypes and layouts into the copies; how many numbers q has."""
        q, v = vector("q", q), vector("v", v)
        if len(q) not in self._q_views or len(v) != self.robot.nv:
            self._mistake(codes.WRONG_SHAPE, q, v)
        self._q_copy[: len(q)] = q
        self._v_copy[:] = v
        return len(q)

    def _adopt(self, q: Any, v: Any) -> None:
        """From now on the compiled step reads these very arrays, which the planner keeps alive."""
        shape = (self.robot.nv,)
        if all(
            type(x) is np.ndarray and x.dtype == np.float64 and x.shape == shape and x.flags.carray
            for x in (q, v)
        ):
            at = (self._address, q.ctypes.data, v.ctypes.data)
            self._seen = (q, v, self._entry, *at, self.robot.nv, self._out)

    def _full_step(self, nq: int, target: Target | Targets, tau: Any, tip: Any) -> int:
        """A step with measured torques or tip, an external backend or timing."""
        if tau is not None and not np.isfinite(sized("tau", tau, (self.robot.nv,))).all():
            target = Target(pose=np.eye(4))
            target.packed[:] = np.nan
        if tip is not None:
            self._record["tip_measured"][0] = sized("tip", getattr(tip, "homogeneous", tip), (4, 4))
            self._record["has_tip_measured"] = 1
        try:
            return self._solved((self._address, self._q_copy_at, self._v_copy_at, target.address, nq))
        finally:
            self._record["has_tip_measured"] = 0

    def _solved(self, inputs: tuple[int, int, int, int, int]) -> int:
        """The tick with the planner's solver; the status."""
        if self._backend is None or self._buffers is None:
            return int(self._entry(*inputs))
        address, q_at, v_at, target_at, nq = inputs
        code: int = entry.prepare_external(address, q_at, v_at, target_at, nq, self._buffers.flat)
        if code != codes.READY:
            return code
        claim = self._backend.solve(cold=self._cold)
        self._cold = claim != codes.SOLVED
        iterations = int(self._backend.iterations)
        return int(entry.finish_external(self._address, self._buffers.solution, int(claim), iterations))

    def _mistake(self, code: int, q: Any, v: Any) -> NoReturn:
        if code == codes.NOT_RESET:
            raise InputError("the planner has no start; call planner.reset(q) before the first step")
        if code == codes.NO_ROTATION:
            raise InputError(
                "the task has rotation rows but the target has a position only; give Target(pose=...)"
            )
        nv, nq = self.robot.nv, self.robot.nq
        expected = f"(nv,) = ({nv},)" if nq == nv else f"(nv,) = ({nv},) or (nq,) = ({nq},)"
        if np.shape(q) not in ((nv,), (nq,)):
            raise InputError(f"q has shape {np.shape(q)}, expected {expected}")
        raise InputError(f"v has shape {np.shape(v)}, expected (nv,) = ({nv},)")

    def report(self, fault: Fault) -> None:
        """Believe ``fault`` from the next step on: ``Locked``, ``FreeSwinging`` or ``Degraded``.

        Raises:
            InputError: unknown joint or not a fault.
        """
        self._belief.report(fault)
        self._adopt_belief()

    def withdraw(self, joint: str | int) -> None:
        """Believe the joint to be healthy again from the next step on.

        Raises:
            InputError: unknown joint.
        """
        self._belief.withdraw(joint)
        self._adopt_belief()

    def _adopt_belief(self) -> None:
        """What follows from the belief: need of dynamics, braking reserve, a cold start."""
        K, n = self._record, self.robot.nv
        K["dynamic"] = self._rows_every_tick or self._needs_inertia or self._belief.needs_dynamics
        a_max, tau_max = K["a_max"][0, :n], K["tau_max"][0, :n]
        if not self._rows_every_tick:
            tau_max[:] = np.inf
        share = 1.0 if self._reserve is None else self._reserve.share(a_max, tau_max)
        K["a_brake"][0, :n] = share * a_max
        K["guard"] = 0.0
        if self._reserve is not None and self._guarded and not self._belief.needs_dynamics:
            K["guard"] = self._reserve.guard(a_max, tau_max)
        K["warm"] = 0
        self._cold = True
