"""Step: what one tick gives back, read from the planner's record when it is asked for."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ftqp.control.planner.certificate import Certificate, Obstacle, Unreached
from ftqp.control.planner.status import STATUSES, StepStatus
from ftqp.control.task.task import COMPONENTS
from ftqp.core.checks import FloatArray
from ftqp.kernel.closed_forms.reduced_problem import memory
from ftqp.kernel.entry.compile import fast_call
from ftqp.kernel.layout import enums as codes
from ftqp.qp.problem import SolveStatus

_LIMIT_NAMES = {
    codes.BY_ACCELERATION: "acceleration",
    codes.BY_VELOCITY: "velocity",
    codes.BY_POSITION: "position",
}
ACTIVE = 1e-9
"""A multiplier above this share of the largest counts as active."""


@dataclass(frozen=True, slots=True, kw_only=True)
class QPReport:
    """How the QP of a step went.

    Attributes:
        status: what the residuals made of the solver's answer; None when the step needed no task QP.
        iterations: of the solver, in its own counting.
        residual: the largest of the scaled residuals below, of the QP that gave the command.
        residual_task, residual_bounds, residual_dual: see ``ftqp.kernel.judge.verdict.judge``.
        time: duration of the whole step [s], or None unless the planner was made with ``timing=True``.
    """

    status: SolveStatus | None
    iterations: int
    residual: float
    residual_task: float
    residual_bounds: float
    residual_dual: float
    time: float | None


class Measures(NamedTuple):
    """How near the arm is to losing a direction of its task, see
    ``ftqp.kernel.closed_forms.singularity.measure``."""

    sigma_min: float
    manipulability: float
    condition: float


_SOLVE_STATUS = (SolveStatus.SOLVED, SolveStatus.MAX_ITERATIONS, SolveStatus.INFEASIBLE, SolveStatus.FAILED)


class Step:
    """One command and what there is to know of it.

    It belongs to the planner and is valid until its next step; ``copy()`` keeps one.

    Attributes:
        q, v, a: command: position [rad or m], velocity, acceleration, (nv,); v = a = 0.0 for a locked joint.
        task_error: from tip to target before the step, along W, (6,): position [m], rotation vector [rad].
        code: the status as a number, the position of ``status`` in ``StepStatus``.
    """

    __slots__ = ("_joints", "_memory", "_record", "a", "code", "duration", "q", "task_error", "v")

    def __init__(self, record: Any, joints: Sequence[str]) -> None:
        self._record = record
        self._joints = tuple(joints)
        self._memory: Any = None
        n = len(self._joints)
        K = record[0]
        self.q: FloatArray = K["q_command"][:n]
        self.v: FloatArray = K["v_command"][:n]
        self.a: FloatArray = K["a_command"][:n]
        self.task_error: FloatArray = K["error"]
        self.code: int = int(K["status"])
        self.duration: float | None = None

    @property
    def status(self) -> StepStatus:
        """What the step says to the operator."""
        return STATUSES[self.code]

    @property
    def tau(self) -> FloatArray:
        """Motor torque for the command, (nv,) [N m or N]; 0.0 for a failed joint, NaN without inertia."""
        return self._torques("tau")

    @property
    def tau_brake(self) -> FloatArray:
        """Torque that the brake of a locked joint carries, (nv,) [N m or N]; 0.0 for every other joint."""
        return self._torques("tau_brake")

    def _torques(self, name: str) -> FloatArray:
        K = self._record[0]
        n = len(self._joints)
        if not K["has_torques"]:
            if not K["mass"][:n].any():
                return np.full(n, np.nan)
            fast_call("torques")(self._record.ctypes.data)
        result: FloatArray = K[name][:n]
        return result

    @property
    def position_error(self) -> float:
        """Norm of the position error over the task's rows [m]."""
        return float(self._record["position_error"][0])

    @property
    def rotation_error(self) -> float:
        """Norm of the rotation error over the task's rows [rad]."""
        return float(self._record["rotation_error"][0])

    @property
    def slack(self) -> FloatArray:
        """A x - b of the task rows, (m,) [m/s2 and rad/s2; m/s and rad/s at the velocity level]."""
        K = self._record[0]
        m = int(K["m"])
        result: FloatArray = K["slack"][:m] / K["row_scale"][K["rows"][:m]]
        return result

    @property
    def scale(self) -> float:
        """Path scale of the ``scaled`` mode, 1 at full speed; 0 while stopping."""
        return float(self._record["scale"][0])

    @property
    def measures(self) -> Measures:
        """sigma_min, manipulability and condition at once; computed when read."""
        if self._memory is None:
            P = memory()
            values = tuple(P[name] for name in Measures._fields)
            self._memory = (P, values, fast_call("measures"), self._record.ctypes.data, P.ctypes.data)
        _, values, call, record_at, memory_at = self._memory
        call(record_at, memory_at)
        return Measures(*(value.item() for value in values))

    @property
    def sigma_min(self) -> float:
        """Smallest singular value of the task's Jacobian over the healthy joints, metres by the length.

        0 when fewer joints work than the task has rows.
        """
        return self.measures.sigma_min

    @property
    def manipulability(self) -> float:
        """sqrt(det J J') of the same Jacobian."""
        return self.measures.manipulability

    @property
    def condition(self) -> float:
        """Largest by smallest singular value of the same Jacobian; inf where a direction is lost."""
        return self.measures.condition

    @property
    def kappa(self) -> float:
        """Damping of a singularity-robust inverse, in squared singular values; 0 without damping."""
        return float(self._record["kappa"][0])

    @property
    def lower(self) -> FloatArray:
        """Lower end of every joint's interval, (nv,), in units of the decision variable."""
        result: FloatArray = self._record["lb"][0, : len(self._joints)]
        return result

    @property
    def upper(self) -> FloatArray:
        """Upper end of every joint's interval, (nv,), in units of the decision variable."""
        result: FloatArray = self._record["ub"][0, : len(self._joints)]
        return result

    @property
    def torque_excess(self) -> float:
        """Excess over torque rows [N m; N m s at the velocity level]; 0 unless no motion could keep them."""
        excess = float(self._record["torque_excess"][0])
        return excess if excess > float(self._record["tolerance"][0]) * 10.0 else 0.0

    @property
    def limits_active(self) -> tuple[str, ...]:
        """The limits that hold the command back, such as ``panda_joint2 upper position``."""
        return tuple(
            f"{obstacle.joint} {obstacle.limit}"
            for obstacle in self._obstacles()
            if obstacle.limit != "locked"
        )

    def _obstacles(self) -> list[Obstacle]:
        K = self._record[0]
        found: list[tuple[str, str, float]] = []
        for i, joint in enumerate(self._joints):
            z = float(K["z_box"][i])
            fault = int(K["fault"][i])
            if fault in (codes.LOCKED, codes.BRAKING):
                found.append((joint, "locked", abs(z)))
            elif z != 0.0:
                by = int(K["upper_by"][i] if z > 0.0 else K["lower_by"][i])
                found.append(
                    (joint, f"{'upper' if z > 0.0 else 'lower'} {_LIMIT_NAMES.get(by, 'bound')}", abs(z))
                )
            if i < int(K["nc"]) and (z := float(K["z"][i])) != 0.0:
                name = "free-swinging" if fault == codes.FREE else f"{'upper' if z > 0.0 else 'lower'} torque"
                found.append((joint, name, abs(z)))
        largest = max((weight for _, _, weight in found), default=0.0)
        if largest == 0.0:
            return []
        kept = [Obstacle(joint=j, limit=l, weight=w / largest) for j, l, w in found if w > ACTIVE * largest]
        return sorted(kept, key=lambda obstacle: -obstacle.weight)

    @property
    def certificate(self) -> Certificate | None:
        """Why the task is not followed exactly, or None when it is (or when no task was attempted)."""
        if self.status not in (StepStatus.RELAXED, StepStatus.FALLBACK):
            return None
        K = self._record[0]
        names = [COMPONENTS[c] for c in K["rows"][: int(K["m"])]]
        slack = self.slack
        largest = float(np.abs(slack).max())
        unreached = [
            Unreached(direction=name, amount=float(s))
            for name, s in zip(names, slack, strict=True)
            if abs(s) > 1e-3 * largest
        ]
        return Certificate(
            unreached=tuple(sorted(unreached, key=lambda u: -abs(u.amount))),
            obstacles=tuple(self._obstacles()),
        )

    @property
    def qp(self) -> QPReport:
        """How the QP went."""
        K = self._record[0]
        claim = int(K["claim"])
        parts = [float(K[name]) for name in ("residual_task", "residual_bounds", "residual_dual")]
        status = None if claim < 0 else _SOLVE_STATUS[claim]
        refuted = self.status is StepStatus.FALLBACK
        refuted = refuted or (K["mode"] == codes.HARD and self.status is StepStatus.RELAXED)
        if status is SolveStatus.SOLVED and refuted:
            status = SolveStatus.FAILED
        return QPReport(
            status=status,
            iterations=int(K["qp_iterations"]),
            residual=max(parts),
            residual_task=parts[0],
            residual_bounds=parts[1],
            residual_dual=parts[2],
            time=self.duration,
        )

    def copy(self) -> "Step":
        """A step of its own, which later steps of the planner do not touch."""
        kept = Step(self._record.copy(), self._joints)
        kept.code, kept.duration = self.code, self.duration
        return kept

    def __repr__(self) -> str:
        errors = f"position_error={self.position_error:.2e}, rotation_error={self.rotation_error:.2e}"
        return f"Step({self.status.name}, {errors})"
