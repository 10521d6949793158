"""The detector: how often a healthy arm may be accused, and the monitor beside somebody else's planner."""

import warnings
from collections.abc import Iterable
from dataclasses import replace
from typing import Any, ClassVar, Final, Self, final

import numpy as np

from ftqp.control.drive.joint_drive import KINDS, Drive, Noise
from ftqp.control.drive.servo_prior import FALSE_ALARMS, fill_loop
from ftqp.core.checks import FloatArray, instance, non_negative, positive
from ftqp.core.errors import InputError, unknown
from ftqp.core.fixed import Fixed
from ftqp.core.setting import Setting, Settings
from ftqp.faults.calibrating import calibrated
from ftqp.faults.calibration import Calibration
from ftqp.faults.diagnosis import Diagnosis
from ftqp.faults.kinds import Fault, refuse_unknown
from ftqp.faults.motion_log import MotionLog, RecordedRun, motion_of
from ftqp.kernel.entry.session import Session, bound
from ftqp.kernel.layout.enums import DELAYS, HEALTHY, LOCKED
from ftqp.kernel.layout.record import load_chain
from ftqp.model.robot import Robot

NO_ARM: Final = "the detector knows no arm yet; give robot= and dt=, or hand it to ftqp.Planner(detector=...)"
GONE: Final = ("bandwidths", "patience", "quantum", "probe_after")
"""Settings of the detector before this one, without effect."""
ANEW: Final = "it was made with it; make another one, ftqp.Detector({name}=...)"
"""What to do about a setting."""


@final
class Detector:
    """How often a healthy arm may be accused, for ``ftqp.Planner(detector=...)``, and the monitor alone.

    A planner detects failures without one, at 0.1 false alarms an hour. Next to another planner ``update`` is
    called once a tick with what was measured, and with what was then sent.

    Args:
        robot: The arm; None where a planner will give it.
        dt: The sampling period, > 0 [s]; None where a planner will give it.
        drive: What the arm takes: ``position``, ``velocity`` or ``torque``, or an ``ftqp.Drive``.
        noise: Standard deviations of positions and torques, an ``ftqp.Noise``.
        delay: How late samples are, >= 0 [s]; None is that of the drive, or none.
        false_alarms_per_hour: How often a healthy joint may be named, > 0 [1/h]. A smaller one names those
            that have failed later.
        calibration: What ``calibrate`` found on healthy motion: the friction that a monitor of torques begins
            with.
        bandwidths: Has no effect any more, and warns; it will go.
        patience: The same.
        quantum: The same.
        probe_after: The same.

    Raises:
        InputError: A number is out of its range, or the calibration is of another arm.

    Source: docs/theory/monitor.md.
    """

    __slots__ = (
        "_calibration", "_delay", "_diagnosis", "_drive", "_dt", "_false_alarms_per_hour", "_listen",
        "_noise", "_q", "_reference", "_robot", "_session", "_tau",
    )  # fmt: skip

    robot: Fixed[Robot | None] = Fixed("_robot", remedy=ANEW)
    dt: Fixed[float | None] = Fixed("_dt", remedy=ANEW)
    drive: Fixed[Drive | None] = Fixed("_drive", remedy=ANEW)
    noise: Fixed[Noise | None] = Fixed("_noise", remedy=ANEW)
    delay: Fixed[float | None] = Fixed("_delay", remedy=ANEW)
    false_alarms_per_hour: Fixed[float] = Fixed("_false_alarms_per_hour", remedy=ANEW)
    calibration: Fixed[Calibration | None] = Fixed("_calibration", remedy=ANEW)

    settings: ClassVar[Settings] = {
        "bandwidths": Setting("has no effect any more", unit="1/s"),
        "patience": Setting("has no effect any more", unit="s", least=0.0),
        "quantum": Setting("has no effect any more", unit="rad or m", least=0.0),
        "probe_after": Setting("has no effect any more", unit="s", above=0.0),
        "calibration": Setting(
            "a file made by a calibration: friction to begin with", of=str | None, file=True
        ),
    }

    def __init__(
        self,
        *,
        robot: Robot | None = None,
        dt: float | None = None,
        drive: Any = None,
        noise: Noise | None = None,
        delay: float | None = None,
        false_alarms_per_hour: float = FALSE_ALARMS,
        calibration: Calibration | None = None,
        bandwidths: tuple[float, float] | None = None,
        patience: float | None = None,
        quantum: float | None = None,
        probe_after: float | None = None,
    ) -> None:
        given = (bandwidths, patience, quantum, probe_after)
        if named := [name for name, value in zip(GONE, given, strict=True) if value is not None]:
            warnings.warn(
                f"{' and '.join(named)} of a detector: no effect any more, since each joint is compared with "
                "what is estimated of it; leave it out",
                DeprecationWarning,
                stacklevel=2,
            )
        self._false_alarms_per_hour = positive("false_alarms_per_hour", false_alarms_per_hour, "1/h")
        self._calibration, self._robot, self._dt, self._noise = calibration, robot, dt, noise
        self._drive = _drive(drive)
        latency = (None if self._drive is None else self._drive.latency) if delay is None else delay
        self._delay = None if latency is None else non_negative("delay of the detector", latency, "s")
        self._session: Session | None = None
        if robot is not None and dt is not None:
            self._build(robot, dt)

    def __repr__(self) -> str:
        return f"Detector(false_alarms_per_hour={self._false_alarms_per_hour:g})"

    def _build(self, robot: Robot, dt: float) -> None:
        """The record, for this arm."""
        instance("robot of the detector", robot, Robot, "an ftqp.Robot")
        self._dt = dt = positive("dt of the detector", dt, "s")
        drive = self._drive or Drive()
        if self._delay is not None:
            most = DELAYS - 10
            if self._delay > most * dt:
                raise InputError(
                    f"delay of the detector is {self._delay:g} s, expected at most {most * dt:g} s, "
                    f"{most} samples"
                )
            drive = replace(drive, latency=self._delay)
        if self._calibration is not None:
            self._calibration.refuse_others(robot.joints)
        self._session = session = Session(robot.nv)
        K, n, limits = session.K, robot.nv, robot.limits
        load_chain(K, **robot.chain.constants())
        K.state.dt, K.monitor.names = dt, 1
        for name in ("q_min", "q_max", "v_max", "a_max", "tau_max"):
            getattr(K.limits, name)[:n] = getattr(limits, name)
        noise = Noise() if self._noise is None else self._noise
        fill_loop(K, robot, dt, drive, noise, self._false_alarms_per_hour, self._calibration)
        self._q, self._reference, self._tau = np.zeros(n), np.zeros((3, n)), np.zeros(n)
        self._listen = bound("listen", session.memory, self._q, self._reference, self._tau)
        self._diagnosis = Diagnosis(robot.joints, K)

    def for_arm(
        self, robot: Robot, dt: float, *, drive: Any = None, noise: Noise | None = None,
        delay: float | None = None,
    ) -> Self:  # fmt: skip
        """A working detector with these settings for what they leave open.

        Args:
            robot: The arm.
            dt: The sampling period [s].
            drive: What the arm takes.
            noise: Of the measurements.
            delay: How late samples are [s].

        Raises:
            InputError: As at construction.
        """
        offered = {"robot": robot, "dt": dt, "drive": drive, "noise": noise, "delay": delay}
        own = {key: getattr(self, key) for key in offered}
        return self._but_with(**{key: offered[key] if own[key] is None else own[key] for key in own})

    def _but_with(self, **changes: Any) -> Self:
        """A detector with these settings, some of them changed."""
        names = ("robot", "dt", "drive", "noise", "delay", "false_alarms_per_hour", "calibration")
        return type(self)(**({name: getattr(self, name) for name in names} | changes))

    def _working(self) -> Session:
        if self._session is None:
            raise InputError(NO_ARM)
        return self._session

    @property
    def diagnosis(self) -> Diagnosis:
        """What is held for likely; it follows the detector."""
        self._working()
        return self._diagnosis

    def reset(self, q: Any = None) -> None:
        """Begin anew: what was found is forgotten, sensors are believed again, failed joints are not.

        Args:
            q: Where the arm is, (nv,) [rad or m]; it is taken from the first command.

        Raises:
            InputError: q has another shape.
        """
        K = self._working().K
        if q is not None and np.shape(q) != self._q.shape:
            raise InputError(f"q has shape {np.shape(q)}, expected (nv,) = ({len(self._q)},)")
        K.state.is_reset = 0
        K.monitor.found[:] = 0

    def update(self, q: Any, v: Any, tau: Any, command: Any) -> Diagnosis:
        """One tick.

        Args:
            q: Measured positions, (nv,) [rad or m]; NaN where there is none.
            v: Measured velocities; not looked at, since those of encoders say nothing new. May be None.
            tau: Measured torques; not looked at. May be None.
            command: The planner's step of this tick, or an ``ftqp.Commanded``: what a servo is then sent, and
                the torques that are sent to an arm that takes them.

        Returns:
            The diagnosis, the same object every tick.

        Raises:
            InputError: Something has a wrong shape, or the detector knows no arm.
        """
        kind = self._working().K.feedback.kind
        reference = getattr(command, "reference", command)
        self._q[:] = _column("q", q, self._q)
        if tau is not None:
            _column("tau", tau, self._tau)
        sent = command if kind != KINDS["torque"] else reference
        for row, (name, one) in enumerate((("q", sent.q), ("v", sent.v), ("a", reference.a))):
            self._reference[row] = _column(f"{name} of the command", one, self._q)
        if kind == KINDS["torque"]:
            if command.tau is None:
                raise InputError("the command has no tau, which an arm that takes torques is sent")
            self._tau[:] = _column("torques of the command", command.tau, self._q)
        np.nan_to_num(self._reference, copy=False, nan=0.0, posinf=0.0, neginf=0.0)
        np.nan_to_num(self._tau, copy=False, nan=0.0, posinf=0.0, neginf=0.0)
        self._listen()
        return self._diagnosis

    def believe(self, fault: Fault) -> None:
        """A planner believes in a fault: that joint is not diagnosed again, the remaining ones are.

        Args:
            fault: What it believes.

        Raises:
            InputError: The joint is unknown, or this is no fault.
        """
        refuse_unknown(fault)
        self._working().K.faults.code[self._index(fault.joint)] = LOCKED

    def forget(self, joint: str | int) -> None:
        """Look at a joint again, and believe its sensor.

        Args:
            joint: Its name or its 0-based index.

        Raises:
            InputError: The joint is unknown.
        """
        i, K = self._index(joint), self._working().K
        K.faults.code[i] = HEALTHY
        K.monitor.found[i] = 0
        K.feedback.lost[i], K.feedback.spent[i], K.feedback.step[i] = 0, 0.0, 0.0

    def _index(self, joint: str | int) -> int:
        if self._robot is None:
            raise InputError(NO_ARM)
        return int(self._robot.chain.lead[self._robot.joint(joint)])

    def calibrate(
        self, log: MotionLog | RecordedRun | Iterable[MotionLog | RecordedRun],
        false_alarms_per_hour: float | None = None, *, extrapolate: bool = False,
    ) -> Self:  # fmt: skip
        """A detector that begins with the friction of healthy motion.

        Args:
            log: Motion of the healthy arm, or the log of a run, ``ftqp.load_log(run)``, or several of them.
            false_alarms_per_hour: How often a healthy joint may be named, > 0 [1/h]; None is what the
                detector was made with.
            extrapolate: Has no effect any more: no threshold is made from the log.

        Raises:
            InputError: The log is not healthy, lets a joint rest all the time, or is noisier than was stated.
        """
        self._working()
        assert self._robot is not None and self._dt is not None
        drive = self._drive or Drive()
        rate = self._false_alarms_per_hour if false_alarms_per_hour is None else false_alarms_per_hour
        rate = positive("false_alarms_per_hour", rate, "1/h")
        given = [log] if isinstance(log, MotionLog | RecordedRun) else list(log)
        about = (self._robot.joints, self._dt, drive.kind)
        logs = [one if isinstance(one, MotionLog) else motion_of(one, *about) for one in given]
        stated = None if self._noise is None else self._noise.q
        found = calibrated(self._robot, self._dt, drive.kind, drive.ticks(self._dt), stated, logs)
        return self._but_with(false_alarms_per_hour=rate, calibration=found)


def _column(name: str, given: Any, like: FloatArray) -> FloatArray:
    """Numbers of a tick, (nv,)."""
    try:
        found = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{name} is no array of numbers, expected (nv,) = {like.shape}") from error
    if found.shape != like.shape:
        raise InputError(f"{name} has shape {found.shape}, expected (nv,) = {like.shape}")
    return found


def _drive(drive: Any) -> Drive | None:
    """A drive, given as a word or as an ``ftqp.Drive``."""
    if drive is None or isinstance(drive, Drive):
        return drive
    if drive not in KINDS:
        raise unknown("drive", drive, "a detector", tuple(KINDS))
    return Drive(kind=str(drive))
