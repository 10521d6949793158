"""What is built around a planner reads of it: what its next step starts from, its table, its QP's labels."""

from typing import Any, NamedTuple, final

import numpy as np

from ftqp.control.drive.learned_servos import LearnedServos
from ftqp.control.drive.servo_prior import forget_servos, tell_servos
from ftqp.control.planner.collision_model import clearance_rows
from ftqp.control.planner.constraint_list import row_names
from ftqp.control.planner.task_list import held_rows
from ftqp.control.task.task import row_indices
from ftqp.core.checks import BoolArray, FloatArray
from ftqp.core.pose import transform
from ftqp.core.small_picture import html_table
from ftqp.kernel.entry.session import ArmSession, Session
from ftqp.kernel.layout.enums import HEALTHY
from ftqp.kernel.layout.rows import CLEARANCE, COMPONENTS, HOLD, constraint_labels
from ftqp.kernel.layout.thresholds import AT_REST
from ftqp.model.robot import Robot
from ftqp.model.robot_table import arm_svg

LIMITS = ("q_min", "q_max", "v_max", "a_brake", "tau_max")
"""What the kernel calls the limits that are believed."""


class TipState(NamedTuple):
    """Pose (4, 4), twist (6,) and acceleration (6,) of the tip along W."""

    pose: FloatArray
    twist: FloatArray
    acceleration: FloatArray


class JointState(NamedTuple):
    """Positions, velocities and accelerations of the joints, (nv,) each [rad or m, per s, per s2]."""

    q: FloatArray
    v: FloatArray
    a: FloatArray


class BelievedLimits(NamedTuple):
    """Limits as believed now, (nv,) each; ``a`` is what braking may count on."""

    q_min: FloatArray
    q_max: FloatArray
    v: FloatArray
    a: FloatArray
    tau: FloatArray


@final
class PlannerView:
    """The planner's last command and what it believes."""

    def __init__(self, session: Session, robot: Robot) -> None:
        self._session = session
        self._n = n = robot.nv
        self._arm = ArmSession(robot.chain.constants())
        self._is_reset = session.field("state", "is_reset")
        self._ticks = session.field("state", "ticks")
        self._command = [session.field("state", name)[:n] for name in ("q_command", "v_command", "a_command")]
        self._measured = session.field("feedback", "seen")[:n]
        self._code = session.field("faults", "code")[:n]
        self._limits = [session.field("limits", name)[:n] for name in LIMITS]
        self._loads = [session.field("chain", name)[:n] for name in ("mass", "com")]

    @property
    def is_reset(self) -> bool:
        """Whether a state is known."""
        return bool(self._is_reset[0])

    @property
    def ticks(self) -> int:
        """Number of steps since the last reset."""
        return int(self._ticks[0])

    @property
    def command(self) -> JointState:
        """The last command, or the state of the last reset; copies."""
        return JointState(*(part.copy() for part in self._command))

    @property
    def measured(self) -> FloatArray:
        """The measured joint positions as the last step believed them, (nv,) [rad or m]; a copy."""
        return np.array(self._measured)

    @property
    def working(self) -> BoolArray:
        """Which joints work, as believed, (nv,)."""
        result: BoolArray = self._code == HEALTHY
        return result

    @property
    def limits(self) -> BelievedLimits:
        """Limits as believed now; copies."""
        return BelievedLimits(*(part.copy() for part in self._limits))

    @property
    def pace(self) -> float:
        """Largest speed of a joint that works, as a share of its limit, which is finite here."""
        top = np.minimum(self.limits.v, 1.0 / AT_REST)
        return float((np.abs(self._command[1]) / top)[self.working].max(initial=0.0))

    @property
    def belief(self) -> bytes:
        """Something that changes whenever the belief in a joint, its limits or the load does."""
        return b"".join(part.tobytes() for part in (self._code, *self._limits, *self._loads))

    def expect_error(self) -> None:
        """Let the next step's error be no emergency: the target is led away from the arm on purpose."""
        watch = self._session.K.watch
        watch.last_position_error = watch.last_rotation_error = np.inf

    def forget_lateness(self) -> None:
        """Let the next target be followed as it is given, however late the arm was: its leader has waited."""
        feedback = self._session.K.feedback
        feedback.late = feedback.up = 0.0
        feedback.stored = feedback.until_stored = 0

    def forget_servos(self) -> None:
        """Let nothing be known of the servos, so that what is learned from now on is what they show."""
        forget_servos(self._session.K, self._n)

    def tell_servos(self, learned: LearnedServos) -> None:
        """Let what was estimated be what is stated of the servos, from the next reset on."""
        tell_servos(self._session.K, learned)

    def keep_rows(self) -> None:
        """Let the next step ask for the whole task, however long it has been infeasible."""
        K = self._session.K
        K.task.late = 0
        if K.task.given_up:
            K.task.given_up, K.terms.count, K.qp.warm = 0, K.terms.own, 0
            K.task.m, K.task.tool_rows = K.task.m_of[0], K.task.tool_of[0]

    def holding_torques(self, places: FloatArray) -> FloatArray:
        """The torques that hold the arm at rest with the load that is believed, (k, nv) [N m or N]."""
        arm, held = self._arm, np.empty_like(places)
        arm.adopt(self._session)
        h = arm.K.kinematics.h[: self._n]
        for q, tau in zip(places, held, strict=True):
            arm.dynamics(q)
            tau[:] = h
        return held

    @property
    def tip(self) -> TipState:
        """The tip's motion in the last command."""
        return self.tip_at(self.command)

    def tip_at(self, joints: JointState) -> TipState:
        """The tip's motion with a motion of the joints."""
        arm = self._arm
        arm.adopt(self._session)
        arm.kinematics(joints.q, joints.v)
        found = arm.K.kinematics
        J = np.array(found.J[:, : self._n])
        pose = transform(np.array(found.R_tip).reshape(3, 3), np.array(found.o_tip))
        return TipState(pose, J @ joints.v, J @ joints.a + found.drift)


def planner_html(planner: Any) -> str:
    """What a planner was made with, its tasks and constraints, and what it believes now."""
    robot, task = planner.robot, planner.task
    rows = [
        ("robot", f"{robot.name}, {robot.nv} joints"),
        ("tick", f"{1e3 * planner.dt:g} ms, {planner.level} level"),
        ("scheme, solver", f"{planner.scheme.name}, {planner.backend}"),
        (f"task of {robot.tip}", f"{', '.join(planner.task_rows)}; {task.mode}"),
    ]
    rows += [
        (f"task {name}", f"{type(one.given).__name__}, level {one.given.level}, weight {one.weight:g}")
        for name, one in planner.tasks.items()
    ]
    rows += [(f"constraint {name}", type(one.given).__name__) for name, one in planner.constraints.items()]
    believed = [f"{joint} {fault.happens}" for joint, fault in planner.faults.items()]
    note = f"It believes that {', '.join(believed)}." if believed else "It believes that every joint works."
    stopped = planner.stopped_because
    return html_table(
        f"Planner of {robot.name}",
        (),
        rows,
        f"{note} Stopped: {stopped}." if stopped else note,
        arm_svg(robot, robot.neutral),
    )


SCALE = "scale"
SLACK = "slack "


def variable_labels(planner: Any) -> tuple[str, ...]:
    """The joints, ``scale`` in mode scaled, and ``slack x``, ... in every mode but hard, (n,)."""
    mode = planner.task.mode
    scale = (SCALE,) if mode == "scaled" else ()
    slacks = () if mode == "hard" else tuple(SLACK + row for row in _task_rows(planner))
    return (*planner.robot.joints, *scale, *slacks)


def row_labels(planner: Any) -> tuple[str, ...]:
    """The task rows ``x``, ``rz``, ... of A, then the rows of C, such as ``torque <joint>``."""
    robot = planner.robot
    held = held_rows([task.given for task in planner.tasks.values()])
    asked = {
        **row_names([one.given for one in planner.constraints.values()]),
        HOLD.name: held,
        CLEARANCE.name: clearance_rows(planner.clearance is not None),
    }
    return (
        *_task_rows(planner),
        *constraint_labels(robot.joints, robot.has_inertia, asked),
    )


def _task_rows(planner: Any) -> tuple[str, ...]:
    rows = planner.robot.default_rows if planner.task.rows is None else planner.task.rows
    return tuple(COMPONENTS[index] for index in row_indices(rows))
