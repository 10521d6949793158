"""An arm on a moving base: a task given in inertial space, followed whatever the base does."""

from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from ftqp.control.moving_base.base_gain import Observer, checked_gain
from ftqp.control.planner.given_arrays import not_a_target
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.status import with_reason
from ftqp.control.planner.step import Step
from ftqp.control.planner.target import Target, Targets
from ftqp.control.task.compatibility import refuse
from ftqp.core.checks import FloatArray, instance, positive, seen, sized
from ftqp.core.errors import InputError
from ftqp.core.fixed import MADE, Fixed
from ftqp.core.pose import pose as checked_pose
from ftqp.core.setting import refuse_out_of_range, setting
from ftqp.kernel.entry.session import Memory
from ftqp.kernel.layout.enums import DELAYS, HAS_BASE, HAS_POSITION, HAS_TIP, HAS_TWIST, Attitude, BaseCode
from ftqp.kernel.layout.thresholds import SINGULAR_FROM

ATTITUDES = {attitude.name.lower(): attitude for attitude in Attitude}
SENSINGS = ("unknown", "known", "late")
TOLERANCE = 1e-3
"""Error beyond which a target that cannot be neared counts as out of reach [m; rad times length]. A
millimetre, which is a convention."""


class BaseStatus(Enum):
    """How the inertial task goes; its value is the sentence for the operator.

    The position of a member is the kernel's code for it.
    """

    TRACKING = "the end effector follows its inertial target"
    SATURATED = "the arm's limits keep the end effector from its inertial target for the moment"
    RANK_DEFICIENT = "the working joints cannot move the end effector in every direction of the task"
    UNREACHABLE = "the end effector comes no closer: the inertial target is out of the arm's reach"
    STALE = (
        "no valid measurement of base or end effector; the last base pose is held for a moment, then the "
        "arm brakes"
    )
    HALTED = "the planner brakes or has stopped the arm"


_STATUSES = tuple(BaseStatus[code.name] for code in BaseCode)


@dataclass(frozen=True, slots=True, kw_only=True)
class MovingBase:
    """What is known of a base that moves, and what is made of it.

    Args:
        sensing: ``unknown`` when only the end effector is measured in inertial space, ``known`` when the
            base's pose or twist is given as it is, ``late`` when it is given or measured ``delay`` too late
            and has to be extrapolated.
        attitude: The attitude by which the error is turned into the base frame: ``estimated`` is that of T_b
            = T_E T_arm(q)^-1 (default), ``nominal`` is that of Holt and Desrochers 1994, which is stable
            below ``gain_limit`` of the deviation only, and ``measured`` is the one that was given.
        observer: Predicts the base's next displacement from its last one; None does without.
        nominal: Attitude of the undisturbed base in the inertial frame, (3, 3) or a pose (4, 4); None is the
            inertial axes.
        delay: How late measurements are, > 0 with ``late`` and 0 without [s]; it is rounded to whole samples,
            at most 63.
        patience: How long the last base pose is used when no valid measurement comes, >= 0 [s]; then the arm
            brakes. A longer one rides out longer gaps and trusts older poses.
        anti_windup: Whether the commands go to a servo that adds them up; see ``InertialTask.setpoint``.

    Raises:
        InputError: A name is unknown, one of delay and ``late`` comes alone, or a time is negative.
    """

    sensing: str = setting("unknown", choices=SENSINGS)
    attitude: str = setting("estimated", choices=tuple(ATTITUDES))
    observer: Observer | None = setting(None, off=True)
    nominal: Any = None
    delay: float = setting(0.0, unit="s", least=0.0)
    patience: float = setting(0.05, unit="s", least=0.0)
    anti_windup: bool = setting(False)

    def __post_init__(self) -> None:
        refuse_out_of_range(self)
        if not isinstance(self.observer, Observer | None):
            raise InputError(f"observer is {self.observer!r}, expected ftqp.Observer(...) or None")
        late = self.delay > 0.0
        if late != (self.sensing == "late"):
            raise InputError(
                f"sensing is {self.sensing!r} with a delay of {self.delay:g} s; a delay goes with 'late' only"
            )
        self.rotation()

    def rotation(self) -> FloatArray:
        """The nominal attitude, (3, 3)."""
        if self.nominal is None:
            return np.eye(3)
        if np.shape(self.nominal) == (3, 3):
            whole = np.eye(4)
            whole[:3, :3] = self.nominal
            return checked_pose(whole, "nominal")[:3, :3]
        return checked_pose(self.nominal, "nominal")[:3, :3]


class InertialTask:
    """A planner's task in inertial space: ``step`` takes the target in the frame I in which the base moves.

    Every tick the inertial error e is turned into the base frame, and the planner's velocity becomes, where
    its limits, failed joints and scheme leave it, J v = R'(gain/dt e + V_target - V_base), V_base being the
    twist of the end effector by the base that was given or observed. The planner's gain kp becomes gain/dt.
    Path scaling makes no sense here, as no path waits: use mode ``slack`` or ``hard``. The emergency stop
    counts the inertial error too; ``emergency=None`` lets large disturbances pass.

    Args:
        planner: The planner that is led, at the velocity level and without a kp of its own;
            ``scheme="approximate_pseudoinverse"`` gives the law of Holt and Desrochers 1994, eq. 19.
        base: What is known of the base; None is ``MovingBase()``.
        gain: The share k_c of the error that one step removes, in (0, 2). A larger one rejects slow base
            motion better and passes more noise; 1 is usual.
        tolerance: The error beyond which a target that cannot be neared is called out of reach, > 0 [m; rad
            times the characteristic length]. A larger one says so later.

    Raises:
        InputError: The planner has another level or mode, the gain is out of its range, or the delay is
            longer than the memory.

    Source: Holt and Desrochers 1994; ``docs/theory/moving-base.md`` says what differs.
    """

    __slots__ = ("_base", "_base_pose", "_error", "_gain", "_lead", "_planner", "_setpoint", "_state")

    planner: Fixed[Planner] = Fixed("_planner")
    base: Fixed[MovingBase] = Fixed("_base")
    gain: Fixed[float] = Fixed("_gain")
    base_pose: Fixed[FloatArray] = Fixed(
        "_base_pose", "Pose of the base when it was measured last, (4, 4) along I; read-only.", MADE
    )
    error: Fixed[FloatArray] = Fixed(
        "_error", "From the end effector to the target, (6,) along I [m, rad]; read-only.", MADE
    )
    setpoint: Fixed[FloatArray] = Fixed(
        "_setpoint", "Sum of the commands since the start, (nv,) [rad or m]; read-only.", MADE
    )

    def __init__(
        self,
        planner: Planner,
        base: MovingBase | None = None,
        *,
        gain: float = 1.0,
        tolerance: float = TOLERANCE,
    ) -> None:
        instance("planner", planner, Planner, 'an ftqp.Planner, ftqp.Planner(robot, level="velocity")')
        base = self._base = MovingBase() if base is None else base
        instance("base", base, MovingBase, "an ftqp.MovingBase or None")
        self._gain = checked_gain(gain)
        refuse(leader="base", level=planner.level, mode=planner.task.mode)
        if planner.task.kp is not None:
            raise InputError(
                f"task kp is {planner.task.kp:g}, but here gain sets it to gain/dt; leave kp out"
            )
        delay = round(base.delay / planner.dt)
        if delay >= DELAYS:
            raise InputError(
                f"delay is {base.delay:g} s, {delay} samples of {planner.dt:g} s; expected at most "
                f"{DELAYS - 1} samples"
            )
        self._planner = planner
        memory = Memory("base")
        state = memory.fields
        state.gain = self._gain
        state.attitude = ATTITUDES[base.attitude]
        state.nominal[:] = base.rotation().ravel()
        state.delay, state.patience = delay, base.patience
        state.rank, state.tolerance = SINGULAR_FROM, positive("tolerance", tolerance, "m")
        state.anti_windup = base.anti_windup
        observer = base.observer
        state.observer = 0.0 if observer is None else observer.factor(planner.dt, self._gain)
        state.freezes = observer is not None and observer.frozen
        state.code = BaseCode.STALE
        self._state = state
        self._lead = planner.lead(memory)
        state.pose[3] = (0.0, 0.0, 0.0, 1.0)
        self._base_pose, self._error = seen(state.pose), seen(state.error)
        self._setpoint = seen(state.setpoint[: planner.robot.nv])

    @property
    def status(self) -> BaseStatus:
        """How the inertial task goes."""
        return _STATUSES[self.code]

    @property
    def sentence(self) -> str:
        """How the inertial task goes, and why the planner has stopped the arm where it has."""
        halted = self.status is BaseStatus.HALTED
        return with_reason(self.status.value, self._planner.stopped_because if halted else None)

    @property
    def code(self) -> int:
        """The status as a number, its position in ``BaseStatus``."""
        return int(self._state.code)

    @property
    def observed_twist(self) -> FloatArray:
        """Twist of the end effector by the base for the coming sample, known or observed, (6,) along I."""
        return seen(self._state.twist)

    def reset(self, q: Any, v: Any = None) -> None:
        """Begin at (q, v), as ``Planner.reset`` does; what is known of the base is forgotten.

        Args:
            q: The measured configuration, (nv,) or (nq,) [rad or m].
            v: The measured velocity, (nv,) [rad/s or m/s]; None is rest.
        """
        self._planner.reset(q, v)
        state = self._state
        for name in ("ticks", "seen", "rates", "ever", "hold", "leaning"):
            setattr(state, name, 0)
        state.shift[:] = state.twist[:] = 0.0
        state.age = 0.0
        self._state.setpoint[: len(self._setpoint)] = self._lead.q
        state.code = BaseCode.STALE

    def step(
        self,
        q: Any,
        v: Any = None,
        target: Target | Targets | None = None,
        *,
        tip: Any = None,
        base: Any = None,
        base_twist: Any = None,
    ) -> Step:
        """The command for the next ``dt``.

        Args:
            q: The measured configuration, (nv,) or (nq,) [rad or m].
            v: The measured velocity, (nv,) [rad/s or m/s], or None: the planner observes it from q.
            target: Where the end effector should be, in the inertial frame I.
            tip: The measured pose of the end effector in I, (4, 4), or its position, (3,), for a task without
                rotation rows; NaN and None count as not seen.
            base: The measured pose of the base in I, (4, 4); next to a target in the base only its attitude
                counts, with ``measured``.
            base_twist: The twist of the base at its origin along I, (6,) [m/s, rad/s]: the mean over the
                sample that begins now, or with ``late`` over the one that began ``delay`` ago.

        Returns:
            The planner's own step, valid until the next one; its ``task_error`` is along the base's axes,
                ``error`` here along those of I.

        Raises:
            InputError: A shape or type is wrong. What the world does never raises, see ``status``.
        """
        if not isinstance(target, Target | Targets):
            raise not_a_target(target)
        state, has = self._state, 0
        if tip is not None:
            has = self._take_tip(tip)
        if base is not None:
            state.given[:] = sized("base", getattr(base, "homogeneous", base), (4, 4))
            has |= HAS_BASE
        if base_twist is not None:
            state.rate[:] = sized("base_twist", base_twist, (6,))
            has |= HAS_TWIST
        state.has = has
        return self._lead.step(q, v, (target.packed, target.row), None, None)

    def _take_tip(self, tip: Any) -> int:
        place = self._state.tip_world
        if np.shape(tip) != (3,):
            place[:] = sized("tip", getattr(tip, "homogeneous", tip), (4, 4))
            return HAS_TIP
        if self._lead.uses_rotation:
            raise InputError("tip is a position, (3,), but the task has rotation rows; give its pose, (4, 4)")
        place[:3, 3] = tip
        return HAS_TIP | HAS_POSITION

    def __repr__(self) -> str:
        return f"InertialTask({self._planner.robot.name}, {self.status.name}, gain={self.gain:g})"
